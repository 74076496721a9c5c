//! `export --format glb`: the scene with its maps as one file.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nephroid::error::{Error, Result};
use nephroid::export::glb::{self, Bits, Carrier, GlbOptions, GlbReport, SceneLights};
use nephroid::export::{Quantity, map_reader};
use nephroid::files;
use nephroid::illumination::IlluminationMap;
use nephroid::scene::{self, LoadOptions, Scene};
use nephroid::settings::LayerKind;
use serde::Serialize;

use super::args::ExportArguments;
use super::export::{
    BitsChoice, CarrierChoice, LightsChoice, MOST_STOPS, Source, UnitsChoice, cut_of, refuse,
};
use super::terminal::Terminal;

/// Share of texels that are white in an unlit picture where no exposure was asked for.
const WHITE_SHARE: f64 = 0.01;

/// A validated `export` of a scene.
#[derive(Debug)]
pub struct GlbJob {
    source: Source,
    output: Option<PathBuf>,
    carrier: Carrier,
    quantity: Quantity,
    lights: Option<SceneLights>,
    bits: Bits,
    cut: f64,
    exposure_stops: Option<f64>,
}

impl GlbJob {
    /// Checks what can be checked before anything is read.
    ///
    /// # Errors
    /// Options that do not go together.
    pub fn new(arguments: ExportArguments) -> Result<Self> {
        let carrier = arguments.carrier.unwrap_or(CarrierChoice::Lightmap);
        refuse(
            &[
                ("--layer", arguments.layer.is_some()),
                ("--transfer", arguments.transfer.is_some()),
                ("--packing", arguments.packing.is_some()),
                ("--mips", arguments.mips),
                ("--atlas", arguments.atlas.is_some()),
                ("--force", arguments.force),
                ("--bits 32", arguments.bits == Some(BitsChoice::ThirtyTwo)),
            ],
            "a .glb",
        )?;
        let is_unlit = carrier == CarrierChoice::Unlit;
        if !is_unlit {
            let kind = "light that materials multiply: it is for --as unlit only";
            refuse(&[("--exposure", arguments.exposure.is_some())], kind)?;
        }
        if is_unlit && arguments.lights == Some(LightsChoice::Keep) {
            return Err(Error::usage(
                "--lights keep",
                "cannot go with --as unlit, whose materials no light reaches",
                "leave it out",
            ));
        }
        Ok(Self {
            cut: cut_of(&arguments),
            source: Source {
                maps: arguments.maps,
                scene: arguments.scene,
            },
            output: arguments.output,
            carrier: match carrier {
                CarrierChoice::Lightmap => Carrier::LightMap,
                CarrierChoice::Emissive => Carrier::Emissive,
                CarrierChoice::Unlit => Carrier::Unlit,
            },
            quantity: arguments.units.unwrap_or(UnitsChoice::Lux).into(),
            lights: match arguments.lights {
                None if is_unlit => Some(SceneLights::Remove),
                None => None,
                Some(LightsChoice::Keep) => Some(SceneLights::Keep),
                Some(LightsChoice::Remove) => Some(SceneLights::Remove),
            },
            bits: match (arguments.bits, carrier) {
                (Some(BitsChoice::Sixteen), _) | (None, CarrierChoice::Emissive) => Bits::Sixteen,
                _ => Bits::Eight,
            },
            exposure_stops: arguments.exposure,
        })
    }

    /// Reads the maps and their scene, writes the file, says what it holds.
    ///
    /// # Errors
    /// Maps or a scene that cannot be read or do not belong together; a place that cannot be written.
    pub fn run(&self, terminal: &Terminal) -> Result<()> {
        let options = LoadOptions::default();
        let scene = self.source.load(&options)?;
        let output = match &self.output {
            Some(output) => output.clone(),
            None => self
                .source
                .maps
                .join(format!("{}.glb", files::slug(&scene.name, "scene"))),
        };
        check_target(&output, &scene)?;
        let (maps, warnings) = map_reader::read(&self.source.maps, &scene)?;
        let opened = scene::open_document(&scene, &options)?;
        let (bytes, report) = glb::encode(&scene, opened, &maps, self.options(&scene, &maps))?;
        files::write_atomically(&output, |writer| writer.write_all(&bytes))?;
        terminal.print_warnings(&warnings);
        terminal.print_warnings(&report.warnings);
        let exported = Exported {
            file: output.display().to_string(),
            bytes: bytes.len(),
            report: &report,
        };
        terminal.print_result(&text(&exported), &exported)
    }

    fn options(&self, scene: &Scene, maps: &[IlluminationMap]) -> GlbOptions {
        let has_direct = maps.iter().any(|map| map.layer(LayerKind::Direct).is_some());
        let otherwise = if has_direct {
            SceneLights::Remove
        } else {
            SceneLights::Keep
        };
        GlbOptions {
            carrier: self.carrier,
            quantity: self.quantity,
            lights: self.lights.unwrap_or(otherwise),
            bits: self.bits,
            cut: self.cut,
            exposure_stops: self.exposure_stops.unwrap_or_else(|| exposure_of(scene, maps)),
        }
    }
}

/// What was written, as `--json` prints it.
#[derive(Serialize)]
struct Exported<'a> {
    file: String,
    bytes: usize,
    #[serde(flatten)]
    report: &'a GlbReport,
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
    (-white.log2()).clamp(-MOST_STOPS, MOST_STOPS)
}

fn text(exported: &Exported<'_>) -> String {
    let report = exported.report;
    let mut text = format!("{}: {} bytes\n", exported.file, exported.bytes);
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
