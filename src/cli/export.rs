//! `export`: baked maps for other programs.

use std::path::PathBuf;

use clap::ValueEnum;
use nephroid::error::{Error, Result};
use nephroid::export::{Quantity, map_reader};
use nephroid::scene::{self, LoadOptions, Scene};

use super::args::ExportArguments;
use super::export_glb::GlbJob;
use super::export_textures::TextureJob;
use super::terminal::Interrupt;
use super::terminal::Terminal;

/// Exposures beyond that many stops are a slip.
pub const MOST_STOPS: f64 = 64.0;

/// Share of a map's light that may be cut where nothing was asked for.
const DEFAULT_CUT: f64 = 0.005;

/// Which kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// The scene with its maps, binary glTF
    Glb,
    /// Textures, OpenEXR: half floats or floats
    Exr,
    /// Textures, PNG of 16 bits a channel
    Png,
    /// Textures, Radiance: 8 bits a channel with an exponent in common
    Hdr,
    /// Textures, KTX 2.0 with zstd: what graphics cards sample
    Ktx2,
}

/// How materials carry the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CarrierChoice {
    /// MOZ_lightmap, light-map coordinates in TEXCOORD_1
    Lightmap,
    /// Emission of the lit surfaces
    Emissive,
    /// A picture of the light on materials that are not lit
    Unlit,
}

/// What the maps hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UnitsChoice {
    /// Irradiance in W/m²
    #[value(name = "E")]
    Irradiance,
    /// Irradiance by π
    #[value(name = "E/pi")]
    IrradianceByPi,
    /// Illuminance in lx
    #[value(name = "lux")]
    Lux,
    /// Illuminance by π
    #[value(name = "lux/pi")]
    LuxByPi,
}

/// What becomes of the scene's lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LightsChoice {
    /// They stay, and maps hold the caustic layer
    Keep,
    /// They go, and maps hold every layer
    Remove,
}

/// How many bits a channel of an image has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BitsChoice {
    /// What browsers read; errors are diffused
    #[value(name = "8")]
    Eight,
    /// For programs that read all of them; half floats
    #[value(name = "16")]
    Sixteen,
    /// Floats
    #[value(name = "32")]
    ThirtyTwo,
}

/// Which light textures hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ContentChoice {
    /// All layers summed
    Sum,
    /// Light through specular surfaces
    Caustic,
    /// Light straight from the lights
    Direct,
    /// Light from other surfaces
    Indirect,
    /// Each layer in a texture of its own
    Each,
    /// Each light in a texture of its own, of maps baked with --per-light
    Lights,
}

/// How KTX 2.0 packs texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PackingChoice {
    /// Nine bits a channel and an exponent in common, 32 bits a texel
    Rgb9e5,
    /// Blocks of 4 by 4 texels, 8 bits a texel
    Bc6h,
}

/// How a PNG codes numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TransferChoice {
    /// Finer steps where it is dark
    Srgb,
    /// Proportional to light
    Linear,
}

impl From<UnitsChoice> for Quantity {
    fn from(choice: UnitsChoice) -> Self {
        match choice {
            UnitsChoice::Irradiance => Self::Irradiance,
            UnitsChoice::IrradianceByPi => Self::IrradianceByPi,
            UnitsChoice::Lux => Self::Illuminance,
            UnitsChoice::LuxByPi => Self::IlluminanceByPi,
        }
    }
}

/// A validated `export`.
#[derive(Debug)]
pub enum ExportJob {
    /// Of the scene with its maps.
    Glb(GlbJob),
    /// Of the maps alone.
    Textures(TextureJob),
}

/// What both kinds read.
#[derive(Debug)]
pub struct Source {
    /// Folder of the maps.
    pub maps: PathBuf,
    /// Scene of the maps where it is not the one that the folder names.
    pub scene: Option<String>,
}

impl Source {
    /// Loads the scene.
    ///
    /// # Errors
    /// No maps there; a scene that cannot be read.
    pub fn load(&self, options: &LoadOptions) -> Result<Scene> {
        match &self.scene {
            Some(scene) => scene::load(scene, options),
            None => scene::load(&map_reader::source_of(&self.maps)?, options),
        }
    }
}

impl ExportJob {
    /// Checks what can be checked before anything is read.
    ///
    /// # Errors
    /// A share that is none, an exposure beyond all use, options that do not go together.
    pub fn new(arguments: ExportArguments) -> Result<Self> {
        if let Some(stops) = arguments.exposure
            && !(-MOST_STOPS..=MOST_STOPS).contains(&stops)
        {
            return Err(Error::usage(
                "--exposure",
                format!("{stops} is outside of -{MOST_STOPS} to {MOST_STOPS} stops"),
                "give a number of stops such as 2",
            ));
        }
        if let Some(cut) = arguments.cut
            && !(0.0..1.0).contains(&cut)
        {
            return Err(Error::usage(
                "--cut",
                format!("{cut} is no share from 0 % to below 100 %"),
                "give a share such as 0.5%",
            ));
        }
        match arguments.format {
            ExportFormat::Glb => GlbJob::new(arguments).map(Self::Glb),
            _ => TextureJob::new(arguments).map(Self::Textures),
        }
    }
}

/// The share that may be cut.
pub fn cut_of(arguments: &ExportArguments) -> f64 {
    arguments.cut.unwrap_or(DEFAULT_CUT)
}

/// Refuses options that were given and do not apply; `kind` says to what.
///
/// # Errors
/// The first of them.
pub fn refuse(options: &[(&str, bool)], kind: &str) -> Result<()> {
    match options.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((option, _)) => Err(Error::usage(
            *option,
            format!("does not apply to {kind}"),
            "leave it out",
        )),
    }
}

/// Reads, writes, says what there is now.
///
/// # Errors
/// Maps or a scene that cannot be read or do not belong together; a place that cannot be written.
pub fn run(job: &ExportJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    match job {
        ExportJob::Glb(job) => job.run(terminal),
        ExportJob::Textures(job) => job.run(terminal, interrupt),
    }
}
