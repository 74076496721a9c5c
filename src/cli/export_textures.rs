//! `export --format exr|png|hdr|ktx2`: maps as textures.

use std::fmt::Write as _;
use std::path::PathBuf;

use nephroid::error::{Error, Result};
use nephroid::export::map_reader::MapReader;
use nephroid::export::textures::{
    self, Content, Encoding, Exposure, Packing, TextureFolder, TextureOptions, TextureReport, Transfer,
};
use nephroid::scene::LoadOptions;
use nephroid::settings::LayerKind;
use serde::Serialize;

use super::args::ExportArguments;
use super::export::{
    BitsChoice, ContentChoice, ExportFormat, PackingChoice, Source, TransferChoice, UnitsChoice, cut_of,
    refuse,
};
use super::terminal::Interrupt;
use super::terminal::Terminal;

/// A validated `export` of textures.
#[derive(Debug)]
pub struct TextureJob {
    source: Source,
    output: PathBuf,
    force: bool,
    options: TextureOptions,
}

/// What was written, as `--json` prints it.
#[derive(Serialize)]
struct Exported<'a> {
    folder: String,
    #[serde(flatten)]
    report: &'a TextureReport,
}

impl TextureJob {
    /// Checks what can be checked before anything is read.
    ///
    /// # Errors
    /// Options that do not apply to the format or do not go together.
    pub fn new(arguments: ExportArguments) -> Result<Self> {
        let (encoding, folder) = encoding_of(&arguments)?;
        let kind = format!("--format {folder}");
        refuse(
            &[
                ("--as", arguments.carrier.is_some()),
                ("--lights", arguments.lights.is_some()),
            ],
            &kind,
        )?;
        let is_png = matches!(encoding, Encoding::Png16 { .. });
        if !is_png {
            refuse(
                &[
                    ("--cut", arguments.cut.is_some()),
                    ("--transfer", arguments.transfer.is_some()),
                ],
                &kind,
            )?;
        }
        if !matches!(encoding, Encoding::Ktx2 { .. }) {
            refuse(
                &[
                    ("--packing", arguments.packing.is_some()),
                    ("--mips", arguments.mips),
                ],
                &kind,
            )?;
        }
        if arguments.atlas.is_some() {
            let kind = "--atlas, as smaller sizes mix the maps in it";
            refuse(&[("--mips", arguments.mips)], kind)?;
        }
        let exposure = match arguments.exposure {
            Some(_) if arguments.cut.is_some() => {
                return Err(Error::usage(
                    "--cut",
                    "chooses the exposure that --exposure states",
                    "leave one of them out",
                ));
            }
            Some(stops) => Exposure::Stops(stops),
            None if is_png => Exposure::Cut(cut_of(&arguments)),
            None => Exposure::Stops(0.0),
        };
        Ok(Self {
            output: arguments.output.unwrap_or_else(|| arguments.maps.join(folder)),
            source: Source {
                maps: arguments.maps,
                scene: arguments.scene,
            },
            force: arguments.force,
            options: TextureOptions {
                encoding,
                quantity: arguments.units.unwrap_or(UnitsChoice::Irradiance).into(),
                content: arguments.layer.unwrap_or(ContentChoice::Sum).into(),
                exposure,
                atlas_side: arguments.atlas,
            },
        })
    }

    /// Reads the maps, writes the textures and their index, says what they hold.
    ///
    /// # Errors
    /// Those of [`textures::write`]; a folder with other people's files.
    pub fn run(&self, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
        let scene = self.source.load(&LoadOptions::default())?;
        let reader = MapReader::open(&self.source.maps, &scene)?;
        let folder = TextureFolder::open(&self.output, self.force)?;
        let report = textures::write(&reader, self.options, folder, interrupt.control())?;
        terminal.print_warnings(&report.warnings);
        let exported = Exported {
            folder: self.output.display().to_string(),
            report: &report,
        };
        terminal.print_result(&text(&exported), &exported)
    }
}

/// How files are coded, and what a folder of them is called.
fn encoding_of(arguments: &ExportArguments) -> Result<(Encoding, &'static str)> {
    let bits_must_be = |allowed: &[BitsChoice]| match arguments.bits {
        Some(bits) if !allowed.contains(&bits) => Err(Error::usage(
            "--bits",
            "so many bits are none that the format has",
            "see nephroid export --help",
        )),
        _ => Ok(()),
    };
    match arguments.format {
        ExportFormat::Glb | ExportFormat::Exr => {
            bits_must_be(&[BitsChoice::Sixteen, BitsChoice::ThirtyTwo])?;
            let encoding = match arguments.bits {
                Some(BitsChoice::ThirtyTwo) => Encoding::Float,
                _ => Encoding::Half,
            };
            Ok((encoding, "exr"))
        }
        ExportFormat::Png => {
            bits_must_be(&[BitsChoice::Sixteen])?;
            let transfer = match arguments.transfer {
                Some(TransferChoice::Linear) => Transfer::Linear,
                Some(TransferChoice::Srgb) | None => Transfer::Srgb,
            };
            Ok((Encoding::Png16 { transfer }, "png"))
        }
        ExportFormat::Hdr => {
            bits_must_be(&[])?;
            Ok((Encoding::Radiance, "hdr"))
        }
        ExportFormat::Ktx2 => {
            bits_must_be(&[])?;
            let packing = match arguments.packing {
                Some(PackingChoice::Bc6h) => Packing::Bc6h,
                Some(PackingChoice::Rgb9e5) | None => Packing::Rgb9e5,
            };
            let mips = arguments.mips;
            Ok((Encoding::Ktx2 { packing, mips }, "ktx2"))
        }
    }
}

impl From<ContentChoice> for Content {
    fn from(choice: ContentChoice) -> Self {
        match choice {
            ContentChoice::Sum => Self::Sum,
            ContentChoice::Caustic => Self::Layer(LayerKind::Caustic),
            ContentChoice::Direct => Self::Layer(LayerKind::Direct),
            ContentChoice::Indirect => Self::Layer(LayerKind::Indirect),
            ContentChoice::Each => Self::EachLayer,
            ContentChoice::Lights => Self::EachLight,
        }
    }
}

fn text(exported: &Exported<'_>) -> String {
    let report = exported.report;
    let index = &report.index;
    let mut text = format!(
        "{}: {} textures and their index, {} bytes\n",
        exported.folder,
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
