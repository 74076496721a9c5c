//! Options that several commands share.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nephroid::scene::LoadOptions;

use super::bake_options;
use super::values::{self, Exposure};

/// Maximum number of worker threads.
const MAX_THREADS: usize = 1024;

/// A choice that is on unless it is turned off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Switch {
    On,
    Off,
}

#[derive(Debug, Args)]
pub struct SceneOptions {
    /// Add a sun and a clear sky to a scene without light
    #[arg(long, hide_short_help = true)]
    default_light: bool,
    /// Closed transmissive meshes are solid glass
    #[arg(
        long,
        hide_short_help = true,
        value_name = "on|off",
        value_enum,
        num_args = 0..=1,
        require_equals = true,
        default_value = "on",
        default_missing_value = "on"
    )]
    solid_glass: Switch,
    /// Light the scene by an equirectangular .hdr or .exr [W/(m² sr)]
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    environment: Option<PathBuf>,
}

impl SceneOptions {
    /// How to load the scene; `adds_light` lights a dark scene unasked.
    pub fn load_options(&self, adds_light: bool) -> LoadOptions {
        LoadOptions {
            solid_glass: self.solid_glass == Switch::On,
            default_light: self.default_light || adds_light,
            environment: self.environment.clone(),
            ..LoadOptions::default()
        }
    }
}

/// How progress is told on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProgressForm {
    /// A bar for people, where stderr is a terminal.
    Bar,
    /// Lines for programs: `{"stage":"caustic","done":12,"total":100}`.
    Json,
}

#[derive(Debug, Args)]
pub struct RunOptions {
    /// Worker threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::within(1..=MAX_THREADS, "threads"), hide_short_help = true)]
    pub threads: Option<usize>,
    /// No progress bar
    #[arg(long, hide_short_help = true)]
    pub quiet: bool,
    /// Progress on stderr: a bar, or JSON lines for other programs
    #[arg(long, value_enum, default_value = "bar", hide = true)]
    pub progress: ProgressForm,
    /// Print the result as one JSON document
    #[arg(long)]
    pub json: bool,
    /// Do not cache unwrapped texture coordinates
    #[arg(long, hide_short_help = true)]
    pub no_cache: bool,
    /// Log to stderr: error, warn, info, debug or trace
    #[arg(long, value_name = "LEVEL", default_value = "off", value_parser = values::log_level(), hide_short_help = true)]
    pub log: log::LevelFilter,
}

impl RunOptions {
    /// Requested threads; 0 = one per core.
    pub fn threads(&self) -> usize {
        self.threads.unwrap_or(0)
    }
}

#[derive(Clone, Debug, Args)]
pub struct PictureOptions {
    /// Camera of the file [default: the first, or a view of all]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Exposure in stops [default: auto]
    #[arg(long, value_name = "auto|STOPS", value_parser = values::exposure, allow_hyphen_values = true)]
    pub exposure: Option<Exposure>,
    /// Size of the window or picture
    #[arg(long, value_name = "WxH", value_parser = values::picture_size, default_value = "1280x720")]
    pub size: (u32, u32),
}

/// Maps that were baked before, instead of baking.
#[derive(Debug, Args)]
pub struct MapsOption {
    /// Use the maps of this folder instead of baking
    #[arg(long, value_name = "DIR", conflicts_with = bake_options::GROUP)]
    pub maps: Option<PathBuf>,
}
