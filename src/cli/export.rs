//! `export`: baked maps for other programs, as a glTF scene or as textures.

#[cfg(feature = "gpu")]
use std::cell::Cell;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
#[cfg(feature = "gpu")]
use std::sync::Arc;

use clap::Args;
#[cfg(feature = "gpu")]
use nephroid::effect::EffectSwitches;
use nephroid::error::{Error, Result, Warning};
use nephroid::export::glb::{self, Bits, Carrier, GlbOptions, GlbReport, SceneLights};
use nephroid::export::map_set::MapSet;
use nephroid::export::textures::{
    self, Content, Encoding, Exposure, Packing, TextureFolder, TextureOptions, TextureReport, Transfer,
};
#[cfg(feature = "gpu")]
use nephroid::export::web::Site;
use nephroid::export::{DEFAULT_CUT, Quantity};
#[cfg(feature = "gpu")]
use nephroid::eye_pass::View;
use nephroid::files;
use nephroid::illumination::IlluminationMap;
use nephroid::scene::{LoadOptions, Scene};
use nephroid::settings::options::share;
use nephroid::settings::{LayerKind, MAX_MAP_SIDE};
use serde::Serialize;

use super::console::Console;
use super::options::RunOptions;
#[cfg(feature = "gpu")]
use super::picture::{self, Backend};
use super::values::{self, Named};

/// Share of lit texels that are white in an unlit picture, if no exposure is given.
const WHITE_SHARE: f64 = 0.01;

/// Smallest side of an atlas [texels]: in smaller ones, gutters take most of the space.
const MIN_ATLAS_SIDE: usize = 16;

const FORMATS: &[Named<&str>] = &[
    ("glb", "glb"),
    ("exr", "exr"),
    ("png", "png"),
    ("hdr", "hdr"),
    ("ktx2", "ktx2"),
    ("web", "web"),
];

const CARRIERS: &[Named<Carrier>] = &[
    ("lightmap", Carrier::LightMap),
    ("emissive", Carrier::Emissive),
    ("unlit", Carrier::Unlit),
];

const UNITS: &[Named<Quantity>] = &[
    ("E", Quantity::Irradiance),
    ("E/pi", Quantity::IrradianceByPi),
    ("lux", Quantity::Illuminance),
    ("lux/pi", Quantity::IlluminanceByPi),
];

const LIGHTS: &[Named<SceneLights>] = &[("keep", SceneLights::Keep), ("remove", SceneLights::Remove)];

const BITS: &[Named<u32>] = &[("8", 8), ("16", 16), ("32", 32)];

const CONTENTS: &[Named<Content>] = &[
    ("sum", Content::Sum),
    ("caustic", Content::Layer(LayerKind::Caustic)),
    ("direct", Content::Layer(LayerKind::Direct)),
    ("indirect", Content::Layer(LayerKind::Indirect)),
    ("each", Content::EachLayer),
    ("lights", Content::EachLight),
];

const PACKINGS: &[Named<Packing>] = &[("rgb9e5", Packing::Rgb9e5), ("bc6h", Packing::Bc6h)];

const TRANSFERS: &[Named<Transfer>] = &[("srgb", Transfer::Srgb), ("linear", Transfer::Linear)];

#[derive(Debug, Args)]
pub struct ExportArguments {
    /// Folder that `bake` wrote
    maps: PathBuf,
    /// glb (scene with maps), web (a page to walk through) or textures: exr, png, hdr, ktx2
    #[arg(long, value_parser = values::named(FORMATS), default_value = "glb")]
    format: &'static str,
    /// File, or folder for textures [default: in the folder of the maps]
    #[arg(short, long, value_name = "FILE|FOLDER")]
    output: Option<PathBuf>,
    /// web: one HTML file that opens from the disk
    #[arg(long)]
    single_file: bool,
    /// Textures, web: write into a folder that holds other files
    #[arg(long, hide_short_help = true)]
    force: bool,
    /// Scene of the maps, if it has moved
    #[arg(long, value_name = "SCENE")]
    scene: Option<String>,
    /// E, E/pi (W/m²), lux or lux/pi [default: lux; E for textures]
    #[arg(long, value_parser = values::named(UNITS))]
    units: Option<Quantity>,
    /// glb: light as lightmap, emissive or unlit [default: lightmap]
    #[arg(long = "as", value_parser = values::named(CARRIERS))]
    carrier: Option<Carrier>,
    /// glb: keep lights, write caustics; or remove, write all layers
    #[arg(long, value_parser = values::named(LIGHTS))]
    lights: Option<SceneLights>,
    /// Textures: sum, caustic, direct, indirect, each or lights
    #[arg(long, value_parser = values::named(CONTENTS))]
    layer: Option<Content>,
    /// Bits a channel: glb 8 or 16, exr 16 or 32
    #[arg(long, value_parser = values::named(BITS), hide_short_help = true)]
    bits: Option<u32>,
    /// png: srgb or linear [default: srgb]
    #[arg(long, value_parser = values::named(TRANSFERS), hide_short_help = true)]
    transfer: Option<Transfer>,
    /// Textures: pack many maps into files of up to N texels a side
    #[arg(long, value_name = "N", hide_short_help = true, num_args = 0..=1, default_missing_value = "4096", value_parser = values::within(MIN_ATLAS_SIDE..=MAX_MAP_SIDE, "texels"))]
    atlas: Option<usize>,
    /// ktx2: rgb9e5 or bc6h [default: rgb9e5]
    #[arg(long, value_parser = values::named(PACKINGS), hide_short_help = true)]
    packing: Option<Packing>,
    /// ktx2: add the mip levels
    #[arg(long, hide_short_help = true)]
    mips: bool,
    /// glb, png: light that may clip for finer steps [default: 0.5%]
    #[arg(long, value_name = "PERCENT", hide_short_help = true, value_parser = part_of_light, allow_hyphen_values = true)]
    cut: Option<f64>,
    /// Multiply light by 2^STOPS (textures, and --as unlit)
    #[arg(
        long,
        value_name = "STOPS",
        hide_short_help = true,
        value_parser = values::within(-values::MAX_STOPS..=values::MAX_STOPS, "stops"),
        allow_negative_numbers = true
    )]
    exposure: Option<f64>,
    #[command(flatten)]
    pub run: RunOptions,
}

/// Parses a share below the whole.
fn part_of_light(text: &str) -> std::result::Result<f64, String> {
    let part = share(text)?;
    (0.0..1.0)
        .contains(&part)
        .then_some(part)
        .ok_or_else(|| "give a share from 0 % to below 100 %".into())
}

/// Result of a .glb or a page for `--json`.
#[derive(Serialize)]
struct WrittenFile<'a, Report> {
    file: &'a str,
    #[serde(flatten)]
    report: &'a Report,
}

/// Result of textures for `--json`.
#[derive(Serialize)]
struct WrittenFolder<'a> {
    folder: &'a str,
    #[serde(flatten)]
    report: &'a TextureReport,
}

impl ExportArguments {
    /// Reads maps and scene, writes, and prints a report.
    ///
    /// # Errors
    /// Bad usage; maps or a scene that cannot be read or do not belong together; output that cannot be written.
    pub fn run(&self, console: &Console) -> Result<()> {
        self.validate()?;
        match self.format {
            "glb" => self.write_glb(console),
            "web" => self.write_web(console),
            _ => self.write_textures(console),
        }
    }

    fn validate(&self) -> Result<()> {
        self.refuse_what_does_not_apply()?;
        let bits: &[u32] = match self.format {
            "glb" => &[8, 16],
            "exr" => &[16, 32],
            "png" => &[16],
            _ => &[],
        };
        let (option, what, remedy) = if self.bits.is_some_and(|asked| !bits.contains(&asked)) {
            let what = "the format does not have this number of bits";
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
        // An option that has no effect on the format is refused, since whoever gives it expects one.
        let is = |formats: &str| formats.split(' ').any(|format| format == self.format);
        let kind = match self.format {
            "glb" => "a .glb".to_string(),
            format => format!("--format {format}"),
        };
        let takes_exposure = !is("glb web") || self.carrier == Some(Carrier::Unlit);
        let multiplied = match is("web") {
            true => &*kind,
            false => "light that materials multiply: it is for --as unlit only",
        };
        let mixed = "--atlas, as smaller sizes mix the maps in it";

        // Option, whether it is given, whether it applies, and what it does not apply to.
        let options = [
            ("--as", self.carrier.is_some(), is("glb"), &*kind),
            ("--lights", self.lights.is_some(), is("glb"), &kind),
            ("--units", self.units.is_some(), !is("web"), &kind),
            ("--single-file", self.single_file, is("web"), &kind),
            ("--layer", self.layer.is_some(), !is("glb web"), &kind),
            ("--transfer", self.transfer.is_some(), is("png"), &kind),
            ("--packing", self.packing.is_some(), is("ktx2"), &kind),
            ("--mips", self.mips, is("ktx2"), &kind),
            ("--mips", self.mips, self.atlas.is_none(), mixed),
            ("--atlas", self.atlas.is_some(), !is("glb web"), &kind),
            ("--force", self.force, !is("glb"), &kind),
            ("--force", self.force, !self.single_file, "one file"),
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

    /// The scene of the maps.
    fn load(&self) -> Result<Scene> {
        let options = LoadOptions::default();
        match &self.scene {
            Some(scene) => Scene::load(scene, &options),
            None => {
                let source = MapSet::source_of(&self.maps)?;
                let is_gone = !source.starts_with("builtin:") && !Path::new(&source).exists();
                Scene::load(&source, &options).map_err(|error| Error {
                    remedy: match is_gone {
                        true => "name the file with --scene, or run in the folder of the bake".into(),
                        false => error.remedy,
                    },
                    ..error
                })
            }
        }
    }

    /// The scene at each moment of a sequence; none for maps of one moment.
    fn frames(&self, scene: &Scene) -> Result<Vec<Scene>> {
        let sequence = MapSet::sequence_of(&self.maps)?;
        Ok(sequence.map_or(Vec::new(), |sequence| sequence.scenes(scene)))
    }

    /// The maps of each moment.
    fn moments<'a>(&self, scene: &'a Scene, frames: &'a [Scene]) -> Result<Vec<MapSet<'a>>> {
        if frames.is_empty() {
            return Ok(vec![MapSet::open(&self.maps, scene)?]);
        }
        let frames = frames.iter().enumerate();
        frames
            .map(|(frame, scene)| MapSet::open_frame(&self.maps, scene, frame))
            .collect()
    }

    fn write_glb(&self, console: &Console) -> Result<()> {
        let loaded = self.load()?;
        let output = self.output.clone().unwrap_or_else(|| {
            let name = files::slug(&loaded.name, "scene");
            self.maps.join(format!("{name}.glb"))
        });
        check_target(&output, &loaded)?;

        // A .glb shows one moment.
        let frames = self.frames(&loaded)?;
        let (scene, set) = match frames.first() {
            None => (&loaded, MapSet::open(&self.maps, &loaded)?),
            Some(first) => (first, MapSet::open_frame(&self.maps, first, 0)?),
        };
        if frames.len() > 1 {
            console.warn(&[Warning::new(
                self.maps.display().to_string(),
                format!(
                    "holds {} moments, and a .glb shows the first one only",
                    frames.len()
                ),
                "export textures (--format) or a page (--format web) for all of them",
            )]);
        }
        let maps = set.read_all()?;
        let report = glb::write(scene, &maps, self.glb_options(scene, &maps), &output)?;
        console.warn(&set.warnings());
        console.warn(&report.warnings);
        let file = &output.display().to_string();
        let written = WrittenFile {
            file,
            report: &report,
        };
        console.print_result(&glb_text(file, &report), &written)
    }

    #[cfg(feature = "gpu")]
    fn write_web(&self, console: &Console) -> Result<()> {
        let scene = Arc::new(self.load()?);

        // Refuse a bad target before any work.
        let default = if self.single_file { "site.html" } else { "site" };
        let output = self.output.clone().unwrap_or_else(|| self.maps.join(default));
        if self.single_file {
            check_target(&output, &scene)?;
        }

        // Read the maps of each moment; the first is drawn.
        let frames = self.frames(&scene)?;
        let moments = self.moments(&scene, &frames)?;
        let shown = frames
            .first()
            .map_or(Arc::clone(&scene), |first| Arc::new(first.clone()));
        let maps = moments[0].read_all()?;

        // The first picture decides who draws the others, so that a missing graphics card is reported once.
        let backend = Cell::new(None);
        let eye = |view: &View| {
            let effects = EffectSwitches::default();
            let (picture, made_by) = picture::drawn(&shown, &maps, view, &effects, backend.get(), console)?;
            backend.set((made_by == picture::CPU).then_some(Backend::Cpu));
            Ok(picture)
        };

        // Write the page with its pictures and report it.
        let site = Site::new(&scene, &moments, &eye, console.control())?;
        let report = if self.single_file {
            site.write_file(&output)?
        } else {
            site.write_folder(&output, self.force)?
        };

        console.warn(&report.warnings);
        let file = &output.display().to_string();
        let what = match self.single_file {
            true => "open it in a browser",
            false => "let any server serve it, such as python3 -m http.server -d",
        };
        let text = format!(
            "{file}: {} files, {} bytes\n{what} {file}",
            report.files, report.bytes
        );
        console.print_result(
            &text,
            &WrittenFile {
                file,
                report: &report,
            },
        )
    }

    #[cfg(not(feature = "gpu"))]
    fn write_web(&self, _: &Console) -> Result<()> {
        Err(Error::usage(
            "--format web",
            "this program was built without the gpu feature, whose shaders the page runs",
            "choose another format",
        ))
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
        let frames = self.frames(&scene)?;
        let readers = self.moments(&scene, &frames)?;
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

/// Refuses to overwrite the scene that is exported.
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

/// The exposure at which the brightest 1 % of the lit texels are white.
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
    (-white.log2()).clamp(-values::MAX_STOPS, values::MAX_STOPS)
}

fn glb_text(file: &str, report: &GlbReport) -> String {
    let mut text = format!("{file}: {} bytes\n", report.bytes);

    // Which light the maps hold, and what became of the lamps: with both, a surface would be lit twice.
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

    // A PNG has a largest code and no negative ones: what lies above white or below 0 is light that the file lost.
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

    // Stored values are the quantity times 2^stops, a factor that programs have to divide by.
    let _ = writeln!(text, "values are in {} x 2^{}", index.unit, index.exposure_stops);

    // Texels that lost light are counted only where there are any, so that they stand out among many files.
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
