//! Flags and arguments, as they are typed.

use std::path::PathBuf;

use clap::error::ErrorKind as ClapErrorKind;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use nephroid::error::{Error, Result};
use nephroid::eye_pass::{ToneMap, WhiteBalance};
use nephroid::light_pass::share::Share;

use super::bake_options::BakeOptions;
use super::compare::LayerChoice;
use super::export::{
    BitsChoice, CarrierChoice, ContentChoice, ExportFormat, LightsChoice, PackingChoice, TransferChoice,
    UnitsChoice,
};
use super::job::Job;
use super::study::StudyArguments;
use super::terminal::{self, Terminal};
use super::values::{self, Exposure};

/// Bakes light through glass, mirrors and water into illumination maps, and lets you walk through the result.
///
/// A scene is a .glb or .gltf file, or builtin:NAME.
#[derive(Debug, Parser)]
#[command(
    name = "nephroid",
    version,
    args_conflicts_with_subcommands = true,
    max_term_width = 110
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub view: ViewArguments,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Open a window on a scene and bake it; without a display, write maps and a picture instead (the default command)
    View(ViewArguments),
    /// Bake illumination maps and a manifest into a folder
    Bake(BakeArguments),
    /// Make one picture
    Render(RenderArguments),
    /// Say what is in a scene, which effects it calls for and why
    Inspect(InspectArguments),
    /// Measure a map against a reference: relative RMSE, ARD, peak, flux
    Compare(CompareArguments),
    /// Write baked maps for other programs
    Export(ExportArguments),
    /// Add up the shards of a bake
    Merge(MergeArguments),
    /// Study what accuracy costs
    Study(StudyArguments),
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Scene options")]
pub struct SceneOptions {
    /// Add a sun to a scene without light
    #[arg(long)]
    pub default_light: bool,
    /// Take transmissive materials without a volume for solid glass, where their meshes are closed
    #[arg(long)]
    pub solid_glass: bool,
    /// Surround the scene with an image of radiance in W/(m² sr), equirectangular, .hdr or .exr, and light it by that
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Run options")]
pub struct RunOptions {
    /// Worker threads [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// No progress bar
    #[arg(long)]
    pub quiet: bool,
    /// Print the result as one JSON document
    #[arg(long)]
    pub json: bool,
    /// Neither read nor keep unwrapped texture coordinates in the user's cache folder
    #[arg(long)]
    pub no_cache: bool,
    /// Log messages of this level and above to stderr
    #[arg(long, value_name = "LEVEL", default_value = "off", value_parser = values::log_level())]
    pub log: log::LevelFilter,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Picture options")]
pub struct PictureOptions {
    /// Camera of the file, by name or index [default: the first, or one that frames the scene]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Stops by which radiance is multiplied before tone mapping, or `auto` [default: auto]
    #[arg(long, value_name = "auto|STOPS", value_parser = values::exposure, allow_hyphen_values = true)]
    pub exposure: Option<Exposure>,
    /// Size of the window or picture [default: 1280x720]
    #[arg(long, value_name = "WxH", value_parser = values::picture_size)]
    pub size: Option<(u32, u32)>,
}

/// Maps that were baked before, instead of baking.
#[derive(Debug, Args)]
pub struct MapsOption {
    /// Use the maps of this folder instead of baking
    #[arg(long, value_name = "DIR", conflicts_with = "BakeOptions")]
    pub maps: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ViewArguments {
    /// .glb, .gltf or builtin:NAME [default: builtin:gallery]
    pub scene: Option<String>,
    /// Write one JSON line per change of state of the window
    #[cfg(feature = "viewer")]
    #[arg(long, value_name = "FILE")]
    pub event_log: Option<PathBuf>,
    /// Read the scene again whenever its files are written
    #[cfg(feature = "viewer")]
    #[arg(long)]
    pub watch: bool,
    /// Leave camera, settings and edits of the last time alone
    #[cfg(feature = "viewer")]
    #[arg(long)]
    pub fresh: bool,
    /// Without a display: write into ./nephroid-out even if it holds other files
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub maps: MapsOption,
    #[command(flatten)]
    pub picture: PictureOptions,
    #[command(flatten)]
    pub scene_options: SceneOptions,
    #[command(flatten)]
    pub bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Debug, Args)]
pub struct BakeArguments {
    /// .glb, .gltf or builtin:NAME
    pub scene: String,
    /// Folder for the maps and manifest.json
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Write into the folder even if it holds other files
    #[arg(long)]
    pub force: bool,
    /// Bake part I of N alone, as sums that `merge` adds up; with --density and a fixed --map-resolution
    #[arg(long, value_name = "I/N", value_parser = values::share_of_bake, allow_hyphen_values = true)]
    pub shard: Option<Share>,
    #[command(flatten)]
    pub scene_options: SceneOptions,
    #[command(flatten)]
    pub bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Debug, Args)]
pub struct MergeArguments {
    /// Folders that `bake --shard` wrote, of all shards of a bake
    #[arg(required = true, value_name = "DIR")]
    pub shards: Vec<PathBuf>,
    /// Folder for the maps and manifest.json
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Write into the folder even if it holds other files
    #[arg(long)]
    pub force: bool,
    /// Where the scene is now [default: where the first shard found it]
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<String>,
    /// Where the image around the scene is now [default: where the first shard found it]
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// Raster on the graphics card
    Gpu,
    /// Reference ray tracer
    Cpu,
}

#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("motion").args(["path", "turntable"]))]
pub struct RenderArguments {
    /// .glb, .gltf or builtin:NAME
    pub scene: String,
    /// Picture: .png for display, .exr for radiance in W/(m² sr); with --path or --turntable a folder for the frames as
    /// .png
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["path", "turntable"])]
    pub output: Option<PathBuf>,
    /// Draw the frames of a camera's path, a JSON file, on the graphics card
    #[arg(long, value_name = "FILE", conflicts_with = "camera")]
    pub path: Option<PathBuf>,
    /// Draw so many frames of a camera that goes once around the middle of the scene, beginning where --camera is
    #[arg(long, value_name = "FRAMES", conflicts_with = "path", value_parser = values::frames)]
    pub turntable: Option<usize>,
    /// With --path or --turntable: time every frame with and without what is seen in mirrors and through glass
    #[arg(long, requires = "motion")]
    pub stats: bool,
    #[command(flatten)]
    pub maps: MapsOption,
    /// How radiance becomes display colour [default: soft]
    #[arg(long, value_parser = values::one_of::<ToneMap>())]
    pub tone_map: Option<ToneMap>,
    /// Which light is shown as white: the display's, the lamps', or light of a temperature or chromaticity
    /// [default: none]
    #[arg(long, value_name = "none|lamps|KELVIN|X,Y", value_parser = values::white_balance)]
    pub white_balance: Option<WhiteBalance>,
    /// What makes the picture [default: gpu where there is one, else cpu]
    #[arg(long, value_enum)]
    pub backend: Option<Backend>,
    #[command(flatten)]
    pub picture: PictureOptions,
    #[command(flatten)]
    pub scene_options: SceneOptions,
    #[command(flatten)]
    pub bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Debug, Args)]
pub struct InspectArguments {
    /// .glb, .gltf or builtin:NAME
    pub scene: String,
    #[command(flatten)]
    pub scene_options: SceneOptions,
    #[command(flatten)]
    pub bake: BakeOptions,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Debug, Args)]
pub struct CompareArguments {
    /// Map to judge: .exr or .pfm
    pub map: PathBuf,
    /// What it should be: .exr or .pfm
    pub reference: PathBuf,
    /// Layer of EXR maps [default: caustic where there is one, else sum]
    #[arg(long, value_enum)]
    pub layer: Option<LayerChoice>,
    /// Write a picture of the difference: red where the map is brighter, blue where it is darker
    #[arg(long, value_name = "FILE.png")]
    pub difference: Option<PathBuf>,
    /// Fail (exit 1) if the relative RMSE is above this many percent
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true)]
    pub max_rmse: Option<f64>,
    #[command(flatten)]
    pub run: RunOptions,
}

#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Folder that `bake` wrote
    pub maps: PathBuf,
    /// Kind of file: the scene with its maps, or its maps as textures with an index
    #[arg(long, value_enum, default_value_t = ExportFormat::Glb)]
    pub format: ExportFormat,
    /// File to write, or folder for the textures [default: the scene's or the format's name in the folder of the maps]
    #[arg(short, long, value_name = "FILE|FOLDER")]
    pub output: Option<PathBuf>,
    /// Of textures: write into the folder even if it holds other files
    #[arg(long)]
    pub force: bool,
    /// Scene of the maps [default: the one that the folder names]
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<String>,
    /// What numbers mean: E and E/pi in W/m^2 (Blender), lux and lux/pi beside lights in candela (three.js)
    /// [default: lux for a .glb, E for textures]
    #[arg(long, value_enum)]
    pub units: Option<UnitsChoice>,
    /// Of a .glb: how materials carry the light: for programs that know light maps, that know none, or that shall not
    /// light at all [default: lightmap]
    #[arg(long = "as", value_enum)]
    pub carrier: Option<CarrierChoice>,
    /// Of a .glb: keep the scene's lights and write the caustic layer, or remove them and write every layer
    /// [default: remove where the direct layer was baked]
    #[arg(long, value_enum)]
    pub lights: Option<LightsChoice>,
    /// Of textures: which light they hold [default: sum]
    #[arg(long, value_enum)]
    pub layer: Option<ContentChoice>,
    /// Bits a channel: 8 or 16 of the images of a .glb, 16 of .png, 16 or 32 of .exr [default: 16, but 8 for a .glb with
    /// light maps or unlit, which is what browsers read]
    #[arg(long, value_enum)]
    pub bits: Option<BitsChoice>,
    /// Of .png: how numbers between black and white are coded [default: srgb]
    #[arg(long, value_enum)]
    pub transfer: Option<TransferChoice>,
    /// Of textures: many maps in one file, with sides of up to so many texels [default: one file for each; N: 4096]
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "4096", value_parser = values::atlas_side)]
    pub atlas: Option<usize>,
    /// Of .ktx2: how texels are packed [default: rgb9e5]
    #[arg(long, value_enum)]
    pub packing: Option<PackingChoice>,
    /// Of .ktx2: all sizes down to one texel; else the image alone
    #[arg(long)]
    pub mips: bool,
    /// Of a .glb or .png: share of a map's light that its brightest texels may lose so that dim ones have finer steps
    /// [default: 0.5%]
    #[arg(long, value_name = "PERCENT", value_parser = values::share, allow_hyphen_values = true)]
    pub cut: Option<f64>,
    /// Stops by which light is multiplied: of a .glb with --as unlit [default: the brightest hundredth is white], of
    /// textures [default: 0; of .png as --cut allows]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    pub exposure: Option<f64>,
    #[command(flatten)]
    pub run: RunOptions,
}

/// What the arguments ask for.
pub enum Parsed {
    /// A job to run.
    Run(Terminal, Box<Job>),
    /// Help or the version: printed already.
    Printed,
}

/// Parses the process's arguments into a validated job.
///
/// # Errors
/// Bad usage, as one sentence.
pub fn parse() -> Result<Parsed> {
    let matches = match Arguments::command().try_get_matches() {
        Ok(matches) => matches,
        Err(error)
            if matches!(
                error.kind(),
                ClapErrorKind::DisplayHelp | ClapErrorKind::DisplayVersion
            ) =>
        {
            terminal::print(error.render().to_string().trim_end())?;
            return Ok(Parsed::Printed);
        }
        Err(error) => return Err(in_one_sentence(&error)),
    };
    let arguments = Arguments::from_arg_matches(&matches).map_err(|error| in_one_sentence(&error))?;
    let run = arguments.run_options();
    env_logger::Builder::new().filter_level(run.log).init();
    if !run.no_cache {
        nephroid::files::cache::enable();
    }
    let terminal = Terminal {
        quiet: run.quiet,
        json: run.json,
    };
    Ok(Parsed::Run(terminal, Box::new(Job::from_arguments(arguments)?)))
}

impl Arguments {
    fn run_options(&self) -> &RunOptions {
        match &self.command {
            None => &self.view.run,
            Some(Command::View(view)) => &view.run,
            Some(Command::Bake(bake)) => &bake.run,
            Some(Command::Render(render)) => &render.run,
            Some(Command::Inspect(inspect)) => &inspect.run,
            Some(Command::Compare(compare)) => &compare.run,
            Some(Command::Export(export)) => &export.run,
            Some(Command::Merge(merge)) => &merge.run,
            Some(Command::Study(study)) => study.run_options(),
        }
    }
}

/// Clap's report without its usage block, tips joined.
fn in_one_sentence(error: &clap::Error) -> Error {
    let report = error.render().to_string();
    let what: Vec<&str> = report
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty())
        .collect();
    let what = what.join(" ");
    Error::usage(
        "command line",
        what.trim_start_matches("error: "),
        "see nephroid --help",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_hold_together() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn clap_speaks_in_one_sentence() {
        for line in [
            "nephroid bake",
            "nephroid bake a.glb -o b --kernel round",
            "nephroid bake a.glb -o b --densty 3",
            "nephroid compare a.exr",
            "nephroid render a.glb -o b.png --maps c --density 10",
        ] {
            let error = Arguments::try_parse_from(line.split(' ')).expect_err(line);
            let sentence = in_one_sentence(&error).to_string();
            assert!(
                !sentence.contains('\n') && !sentence.contains("Usage"),
                "{sentence}"
            );
            assert!(sentence.len() > 40, "{sentence}");
        }
    }
}
