//! `export`: baked maps for other programs, with their scene or as textures.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use nephroid::error::{Error, Result};
use nephroid::export::Quantity;
use nephroid::export::glb::{self, Bits, Carrier, GlbOptions, GlbReport, SceneLights};
use nephroid::export::map_reader::{self, MapReader};
use nephroid::export::textures::{
    self, Content, Encoding, Exposure, Packing, TextureFolder, TextureOptions, TextureReport, Transfer,
};
use nephroid::files;
use nephroid::illumination::IlluminationMap;
use nephroid::scene::{self, LoadOptions, Scene};
use nephroid::settings::options::share;
use nephroid::settings::{LayerKind, MAX_MAP_SIDE};
use serde::Serialize;

use super::console::Console;
use super::options::RunOptions;
use super::values::{self, Named};

/// Exposures beyond that many stops are a slip.
const MAX_STOPS: f64 = 64.0;

/// Share of a map's light that may be cut where nothing was asked for.
const DEFAULT_CUT: f64 = 0.005;

/// Share of texels that are white in an unlit picture where no exposure was asked for.
const WHITE_SHARE: f64 = 0.01;

/// Below, gutters take most of an atlas [texels].
const MIN_ATLAS_SIDE: usize = 16;

const FORMATS: &[Named<&str>] = &[
    ("glb", "glb", "The scene with its maps, binary glTF"),
    ("exr", "exr", "Textures, OpenEXR: half floats or floats"),
    ("png", "png", "Textures, PNG of 16 bits a channel"),
    (
        "hdr",
        "hdr",
        "Textures, Radiance: 8 bits a channel with an exponent in common",
    ),
    (
        "ktx2",
        "ktx2",
        "Textures, KTX 2.0 with zstd: what graphics cards sample",
    ),
];

const CARRIERS: &[Named<Carrier>] = &[
    (
        "lightmap",
        Carrier::LightMap,
        "MOZ_lightmap, light-map coordinates in TEXCOORD_1",
    ),
    ("emissive", Carrier::Emissive, "Emission of the lit surfaces"),
    (
        "unlit",
        Carrier::Unlit,
        "A picture of the light on materials that are not lit",
    ),
];

const UNITS: &[Named<Quantity>] = &[
    ("E", Quantity::Irradiance, "Irradiance in W/m²"),
    ("E/pi", Quantity::IrradianceByPi, "Irradiance by π"),
    ("lux", Quantity::Illuminance, "Illuminance in lx"),
    ("lux/pi", Quantity::IlluminanceByPi, "Illuminance by π"),
];

const LIGHTS: &[Named<SceneLights>] = &[
    (
        "keep",
        SceneLights::Keep,
        "They stay, and maps hold the caustic layer",
    ),
    (
        "remove",
        SceneLights::Remove,
        "They go, and maps hold every layer",
    ),
];

const BITS: &[Named<u32>] = &[
    ("8", 8, "What browsers read; errors are diffused"),
    ("16", 16, "For programs that read all of them; half floats"),
    ("32", 32, "Floats"),
];

const CONTENTS: &[Named<Content>] = &[
    ("sum", Content::Sum, "All layers summed"),
    (
        "caustic",
        Content::Layer(LayerKind::Caustic),
        "Light through specular surfaces",
    ),
    (
        "direct",
        Content::Layer(LayerKind::Direct),
        "Light straight from the lights",
    ),
    (
        "indirect",
        Content::Layer(LayerKind::Indirect),
        "Light from other surfaces",
    ),
    ("each", Content::EachLayer, "Each layer in a texture of its own"),
    (
        "lights",
        Content::EachLight,
        "Each light in a texture of its own, of maps baked with --per-light",
    ),
];

const PACKINGS: &[Named<Packing>] = &[
    (
        "rgb9e5",
        Packing::Rgb9e5,
        "Nine bits a channel and an exponent in common, 32 bits a texel",
    ),
    ("bc6h", Packing::Bc6h, "Blocks of 4 by 4 texels, 8 bits a texel"),
];

const TRANSFERS: &[Named<Transfer>] = &[
    ("srgb", Transfer::Srgb, "Finer steps where it is dark"),
    ("linear", Transfer::Linear, "Proportional to light"),
];

#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Folder that `bake` wrote
    maps: PathBuf,
    /// Kind of file: the scene with its maps, or its maps as textures with an index
    #[arg(long, value_parser = values::named(FORMATS), default_value = "glb")]
    format: &'static str,
    /// File to write, or folder for the textures [default: the scene's or the format's name in the folder of the maps]
    #[arg(short, long, value_name = "FILE|FOLDER")]
    output: Option<PathBuf>,
    /// Of textures: write into the folder even if it holds other files
    #[arg(long)]
    force: bool,
    /// Scene of the maps [default: the one that the folder names]
    #[arg(long, value_name = "SCENE")]
    scene: Option<String>,
    /// What numbers mean: E and E/pi in W/m^2 (Blender), lux and lux/pi beside lights in candela (three.js)
    /// [default: lux for a .glb, E for textures]
    #[arg(long, value_parser = values::named(UNITS))]
    units: Option<Quantity>,
    /// Of a .glb: how materials carry the light: for programs that know light maps, that know none, or that shall not
    /// light at all [default: lightmap]
    #[arg(long = "as", value_parser = values::named(CARRIERS))]
    carrier: Option<Carrier>,
    /// Of a .glb: keep the scene's lights and write the caustic layer, or remove them and write every layer
    /// [default: remove where the direct layer was baked]
    #[arg(long, value_parser = values::named(LIGHTS))]
    lights: Option<SceneLights>,
    /// Of textures: which light they hold [default: sum]
    #[arg(long, value_parser = values::named(CONTENTS))]
    layer: Option<Content>,
    /// Bits a channel: 8 or 16 of the images of a .glb, 16 of .png, 16 or 32 of .exr [default: 16, but 8 for a .glb with
    /// light maps or unlit, which is what browsers read]
    #[arg(long, value_parser = values::named(BITS))]
    bits: Option<u32>,
    /// Of .png: how numbers between black and white are coded [default: srgb]
    #[arg(long, value_parser = values::named(TRANSFERS))]
    transfer: Option<Transfer>,
    /// Of textures: many maps in one file, with sides of up to so many texels [default: one file for each; N: 4096]
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "4096", value_parser = values::within(MIN_ATLAS_SIDE..=MAX_MAP_SIDE, "texels"))]
    atlas: Option<usize>,
    /// Of .ktx2: how texels are packed [default: rgb9e5]
    #[arg(long, value_parser = values::named(PACKINGS))]
    packing: Option<Packing>,
    /// Of .ktx2: all sizes down to one texel; else the image alone
    #[arg(long)]
    mips: bool,
    /// Of a .glb or .png: share of a map's light that its brightest texels may lose so that dim ones have finer steps
    /// [default: 0.5%]
    #[arg(long, value_name = "PERCENT", value_parser = share, allow_hyphen_values = true)]
    cut: Option<f64>,
    /// Stops by which light is multiplied: of a .glb with --as unlit [default: the brightest hundredth is white], of
    /// textures [default: 0; of .png as --cut allows]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    exposure: Option<f64>,
    #[command(flatten)]
    pub run: RunOptions,
}

/// What was written, as `--json` prints it.
#[derive(Serialize)]
struct WrittenFile<'a> {
    file: &'a str,
    bytes: usize,
    #[serde(flatten)]
    report: &'a GlbReport,
}

/// What was written, as `--json` prints it.
#[derive(Serialize)]
struct WrittenFolder<'a> {
    folder: &'a str,
    #[serde(flatten)]
    report: &'a TextureReport,
}

impl ExportArguments {
    /// Reads, writes, says what there is now.
    ///
    /// # Errors
    /// Bad usage; maps or a scene that cannot be read or do not belong together; a place that cannot be written.
    pub fn run(&self, console: &Console) -> Result<()> {
        self.validate()?;
        match self.format {
            "glb" => self.write_glb(console),
            _ => self.write_textures(console),
        }
    }

    fn validate(&self) -> Result<()> {
        if let Some(stops) = self.exposure
            && !(-MAX_STOPS..=MAX_STOPS).contains(&stops)
        {
            return Err(Error::usage(
                "--exposure",
                format!("{stops} is outside of -{MAX_STOPS} to {MAX_STOPS} stops"),
                "give a number of stops such as 2",
            ));
        }
        if let Some(cut) = self.cut
            && !(0.0..1.0).contains(&cut)
        {
            return Err(Error::usage(
                "--cut",
                format!("{cut} is no share from 0 % to below 100 %"),
                "give a share such as 0.5%",
            ));
        }
        self.refuse_what_does_not_apply()?;
        let bits: &[u32] = match self.format {
            "glb" => &[8, 16],
            "exr" => &[16, 32],
            "png" => &[16],
            _ => &[],
        };
        let (option, what, remedy) = if self.bits.is_some_and(|asked| !bits.contains(&asked)) {
            let what = "so many bits are none that the format has";
            ("--bits", what, "see nephroid export --help")
        } else if self.carrier == Some(Carrier::Unlit) && self.lights == Some(SceneLights::Keep) {
            let what = "cannot go with --as unlit, whose materials no light reaches";
            ("--lights keep", what, "leave it out")
        } else if self.format == "png" && self.cut.is_some() && self.exposure.is_some() {
            let what = "chooses the exposure that --exposure states";
            ("--cut", what, "leave one of them out")
        } else {
            return Ok(());
        };
        Err(Error::usage(option, what, remedy))
    }

    fn refuse_what_does_not_apply(&self) -> Result<()> {
        let is = |formats: &str| formats.split(' ').any(|format| format == self.format);
        let kind = match self.format {
            "glb" => "a .glb".to_string(),
            format => format!("--format {format}"),
        };
        let takes_exposure = !is("glb") || self.carrier == Some(Carrier::Unlit);
        let multiplied = "light that materials multiply: it is for --as unlit only";
        let mixed = "--atlas, as smaller sizes mix the maps in it";
        // Option, whether it is given and applies, and what else it would be for.
        let options = [
            ("--as", self.carrier.is_some(), is("glb"), &*kind),
            ("--lights", self.lights.is_some(), is("glb"), &kind),
            ("--layer", self.layer.is_some(), !is("glb"), &kind),
            ("--transfer", self.transfer.is_some(), is("png"), &kind),
            ("--packing", self.packing.is_some(), is("ktx2"), &kind),
            ("--mips", self.mips, is("ktx2"), &kind),
            ("--mips", self.mips, self.atlas.is_none(), mixed),
            ("--atlas", self.atlas.is_some(), !is("glb"), &kind),
            ("--force", self.force, !is("glb"), &kind),
            ("--cut", self.cut.is_some(), is("glb png"), &kind),
            ("--exposure", self.exposure.is_some(), takes_exposure, multiplied),
        ];
        match options
            .iter()
            .find(|(_, is_given, applies, _)| *is_given && !applies)
        {
            None => Ok(()),
            Some((option, .., kind)) => Err(Error::usage(
                *option,
                format!("does not apply to {kind}"),
                "leave it out",
            )),
        }
    }

    /// The scene that the maps are of.
    fn load(&self) -> Result<Scene> {
        let options = LoadOptions::default();
        match &self.scene {
            Some(scene) => scene::load(scene, &options),
            None => scene::load(&map_reader::source_of(&self.maps)?, &options),
        }
    }

    fn write_glb(&self, console: &Console) -> Result<()> {
        let scene = self.load()?;
        let output = self.output.clone().unwrap_or_else(|| {
            let name = files::slug(&scene.name, "scene");
            self.maps.join(format!("{name}.glb"))
        });
        check_target(&output, &scene)?;
        let (maps, warnings) = map_reader::read(&self.maps, &scene)?;
        let opened = scene::open_document(&scene, &LoadOptions::default())?;
        let (bytes, report) = glb::encode(&scene, opened, &maps, self.glb_options(&scene, &maps))?;
        files::write_atomically(&output, |writer| writer.write_all(&bytes))?;
        console.warn(&warnings);
        console.warn(&report.warnings);
        let file = &output.display().to_string();
        let written = WrittenFile {
            file,
            bytes: bytes.len(),
            report: &report,
        };
        console.print_result(&glb_text(file, bytes.len(), &report), &written)
    }

    fn glb_options(&self, scene: &Scene, maps: &[IlluminationMap]) -> GlbOptions {
        let carrier = self.carrier.unwrap_or(Carrier::LightMap);
        let has_direct = || maps.iter().any(|map| map.layer(LayerKind::Direct).is_some());
        let lights = if carrier == Carrier::Unlit || has_direct() {
            SceneLights::Remove
        } else {
            SceneLights::Keep
        };
        GlbOptions {
            carrier,
            quantity: self.units.unwrap_or(Quantity::Illuminance),
            lights: self.lights.unwrap_or(lights),
            bits: match (self.bits, carrier) {
                (Some(16), _) | (None, Carrier::Emissive) => Bits::Sixteen,
                _ => Bits::Eight,
            },
            cut: self.cut.unwrap_or(DEFAULT_CUT),
            exposure_stops: self.exposure.unwrap_or_else(|| exposure_of(scene, maps)),
        }
    }

    fn write_textures(&self, console: &Console) -> Result<()> {
        let scene = self.load()?;
        let sequence = map_reader::sequence_of(&self.maps)?;
        let scenes = sequence
            .as_ref()
            .map_or(Vec::new(), |sequence| sequence.scenes(&scene));
        let frames = scenes.iter().enumerate();
        let mut readers = frames
            .map(|(frame, scene)| MapReader::open_frame(&self.maps, scene, frame))
            .collect::<Result<Vec<_>>>()?;
        if readers.is_empty() {
            readers.push(MapReader::open(&self.maps, &scene)?);
        }
        let output = self.output.clone().unwrap_or_else(|| self.maps.join(self.format));
        let folder = TextureFolder::open(&output, self.force)?;
        let report = textures::write(&readers, self.texture_options(), folder, console.control())?;
        console.warn(&report.warnings);
        let folder = &output.display().to_string();
        let written = WrittenFolder {
            folder,
            report: &report,
        };
        console.print_result(&textures_text(folder, &report), &written)
    }

    fn texture_options(&self) -> TextureOptions {
        let encoding = match self.format {
            "png" => Encoding::Png16 {
                transfer: self.transfer.unwrap_or(Transfer::Srgb),
            },
            "hdr" => Encoding::Radiance,
            "ktx2" => Encoding::Ktx2 {
                packing: self.packing.unwrap_or(Packing::Rgb9e5),
                mips: self.mips,
            },
            _ if self.bits == Some(32) => Encoding::Float,
            _ => Encoding::Half,
        };
        TextureOptions {
            encoding,
            quantity: self.units.unwrap_or(Quantity::Irradiance),
            content: self.layer.unwrap_or(Content::Sum),
            exposure: match self.exposure {
                Some(stops) => Exposure::Stops(stops),
                None if self.format == "png" => Exposure::Cut(self.cut.unwrap_or(DEFAULT_CUT)),
                None => Exposure::Stops(0.0),
            },
            atlas_side: self.atlas,
        }
    }
}

/// A file must not be written over the scene that it is made from.
fn check_target(output: &Path, scene: &Scene) -> Result<()> {
    files::check_output_file(output)?;
    let same = |a: &Path, b: &Path| {
        let (a, b) = (a.canonicalize(), b.canonicalize());
        a.is_ok_and(|a| b.is_ok_and(|b| a == b))
    };
    if same(output, Path::new(&scene.source)) {
        return Err(Error::usage(
            output.display().to_string(),
            "is the scene itself, which an export must not replace",
            "name another file with -o",
        ));
    }
    Ok(())
}

/// The exposure at which the brightest hundredth of all lit texels is white.
fn exposure_of(scene: &Scene, maps: &[IlluminationMap]) -> f64 {
    let mut sent: Vec<f64> = Vec::new();
    for map in maps {
        let albedo = scene.material_of(map.chart.object()).base_colour.max_channel();
        let radiance = |texel: &[f32; 3]| f64::from(texel[0].max(texel[1]).max(texel[2])) * albedo;
        sent.extend(
            map.total()
                .iter()
                .map(radiance)
                .filter(|radiance| *radiance > 0.0),
        );
    }
    if sent.is_empty() {
        return 0.0;
    }
    sent.sort_unstable_by(|a, b| b.total_cmp(a));
    let white = sent[(WHITE_SHARE * sent.len() as f64) as usize] * std::f64::consts::FRAC_1_PI;
    (-white.log2()).clamp(-MAX_STOPS, MAX_STOPS)
}

fn glb_text(file: &str, bytes: usize, report: &GlbReport) -> String {
    let mut text = format!("{file}: {bytes} bytes\n");
    let layers: Vec<&str> = report.layers.iter().map(|layer| layer.name()).collect();
    let lights = match report.options.lights {
        SceneLights::Keep => "kept",
        SceneLights::Remove => "removed",
    };
    let _ = writeln!(
        text,
        "layers {}; the scene's lights are {lights}",
        layers.join(", ")
    );
    if report.options.carrier == Carrier::Unlit {
        let _ = writeln!(text, "exposure {:.2} stops", report.options.exposure_stops);
    }
    for map in &report.maps {
        let _ = writeln!(
            text,
            "{:<20} TEXCOORD_{}, white = {:.4} {}; {:.3} % of its light cut in {} texels, {} texels below 0",
            map.surface,
            map.tex_coord,
            map.intensity,
            match report.options.carrier {
                Carrier::LightMap => report.unit,
                Carrier::Emissive | Carrier::Unlit => "of what is shown",
            },
            100.0 * map.cut_share,
            map.cut_texels,
            map.negative_texels
        );
    }
    text
}

fn textures_text(folder: &str, report: &TextureReport) -> String {
    let index = &report.index;
    let mut text = format!(
        "{folder}: {} textures and their index, {} bytes\n",
        index.textures.len(),
        report.bytes
    );
    let _ = writeln!(text, "values are in {} x 2^{}", index.unit, index.exposure_stops);
    for texture in &index.textures {
        let lost = &texture.lost;
        let _ = write!(text, "{:<28} {}x{}", texture.file, texture.width, texture.height);
        if texture.levels > 1 {
            let _ = write!(text, ", {} sizes", texture.levels);
        }
        let _ = write!(text, ", off by {:.2e} of the mean", lost.relative_rmse);
        if lost.above_texels > 0 {
            let percent = 100.0 * lost.above_share;
            let _ = write!(
                text,
                ", {} texels above white ({percent:.3} % of its light)",
                lost.above_texels
            );
        }
        for (count, what) in [
            (lost.negative_texels, "below 0"),
            (lost.vanished_texels, "too dim for a step"),
        ] {
            if count > 0 {
                let _ = write!(text, ", {count} texels {what}");
            }
        }
        text.push('\n');
    }
    text
}
