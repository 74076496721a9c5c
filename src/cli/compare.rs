//! `compare`: a map against its reference.

use std::fmt::Write as _;
use std::path::Path;

use clap::ValueEnum;
use nephroid::error::{Error, Result};
use nephroid::export::{FloatImage, picture};
use nephroid::files;
use nephroid::illumination::compare::{Comparison, Grid, at_common_size, compare};
use serde::Serialize;

use super::args::CompareArguments;
use super::terminal::Terminal;

/// Which channels of an EXR map are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LayerChoice {
    /// Light through specular surfaces
    Caustic,
    /// Light straight from the lights
    Direct,
    /// All layers together
    Sum,
}

impl LayerChoice {
    /// What its channels' names start with.
    fn prefix(self) -> &'static str {
        match self {
            Self::Caustic => "caustic",
            Self::Direct => "direct",
            Self::Sum => "",
        }
    }
}

/// The result, as `--json` prints it.
#[derive(Debug, Serialize)]
struct Report {
    map: String,
    reference: String,
    layer: LayerChoice,
    reference_layer: LayerChoice,
    width: usize,
    height: usize,
    relative_rmse: f64,
    average_relative_difference: Option<f64>,
    peak: f64,
    reference_peak: f64,
    mean: f64,
    reference_mean: f64,
    flux_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    difference: Option<Difference>,
}

/// The picture of the difference.
#[derive(Debug, Serialize)]
struct Difference {
    file: String,
    /// Difference at which its colours are full, in units of the maps.
    full_colour_at: f64,
}

/// Measures, prints, and fails where the limit is passed.
///
/// # Errors
/// Files that cannot be read or compared; a relative RMSE above the limit.
pub fn run(job: &CompareArguments, terminal: &Terminal) -> Result<()> {
    if let Some(path) = &job.difference {
        files::check_output_file(path)?;
    }
    let (map, layer) = read_luminance(&job.map, job.layer)?;
    let (reference, reference_layer) = read_luminance(&job.reference, job.layer)?;
    let (map, reference) = at_common_size(&map, &reference).ok_or_else(|| {
        Error::failure(
            job.map.display().to_string(),
            format!(
                "its size {}x{} and the reference's {}x{} are no whole multiples of one another",
                map.width, map.height, reference.width, reference.height
            ),
            "bake at a multiple of the reference's size",
        )
    })?;
    let measures = compare(&map, &reference);
    let relative_rmse = measures.relative_rmse.ok_or_else(|| {
        Error::failure(
            job.reference.display().to_string(),
            "the reference is dark, so that nothing can be measured against it",
            "name a reference with light in it",
        )
    })?;
    let difference = match &job.difference {
        Some(path) => Some(write_difference(path, &map, &reference)?),
        None => None,
    };
    let report = Report {
        map: job.map.display().to_string(),
        reference: job.reference.display().to_string(),
        layer,
        reference_layer,
        width: map.width,
        height: map.height,
        relative_rmse,
        average_relative_difference: measures.average_relative_difference,
        peak: measures.peak,
        reference_peak: measures.reference_peak,
        mean: measures.mean,
        reference_mean: measures.reference_mean,
        flux_ratio: measures.flux_ratio,
        difference,
    };
    terminal.print_result(&text(&report, &measures), &report)?;
    hold_to_limit(job, relative_rmse)
}

fn hold_to_limit(job: &CompareArguments, relative_rmse: f64) -> Result<()> {
    match job.max_rmse {
        Some(limit) if relative_rmse > limit / 100.0 => Err(Error::failure(
            job.map.display().to_string(),
            format!(
                "its relative RMSE of {:.4} % is above the limit of {} %",
                100.0 * relative_rmse,
                limit
            ),
            "bake at a higher density or raise --max-rmse",
        )),
        _ => Ok(()),
    }
}

fn text(report: &Report, measures: &Comparison) -> String {
    let mut text = String::new();
    let percent =
        |share: Option<f64>| share.map_or("undefined".to_string(), |share| format!("{:.4} %", 100.0 * share));
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<15} {value}");
    };
    line("size", format!("{} x {} texels", report.width, report.height));
    line("relative RMSE", percent(measures.relative_rmse));
    line("ARD", percent(measures.average_relative_difference));
    line(
        "peak",
        format!("{:.6} (reference {:.6})", measures.peak, measures.reference_peak),
    );
    line(
        "mean",
        format!("{:.6} (reference {:.6})", measures.mean, measures.reference_mean),
    );
    line("flux ratio", percent(measures.flux_ratio));
    if let Some(difference) = &report.difference {
        line(
            "difference",
            format!(
                "{} (full red and blue at {:.6})",
                difference.file, difference.full_colour_at
            ),
        );
    }
    text
}

/// The luminance of the wanted layer; without a wish the caustic layer where there is one, else the sum.
pub fn read_luminance(path: &Path, wish: Option<LayerChoice>) -> Result<(Grid, LayerChoice)> {
    let image = FloatImage::read(path)?;
    let has_layers = image.channels.iter().any(|channel| channel.name.contains('.'));
    let layer = match wish {
        // References hold one layer without a name: the one that is asked for.
        Some(wish) if has_layers => wish,
        None if image.channel("caustic.R").is_some() => LayerChoice::Caustic,
        _ => LayerChoice::Sum,
    };
    let grid = image.luminance(layer.prefix()).ok_or_else(|| {
        let names: Vec<&str> = image
            .channels
            .iter()
            .map(|channel| channel.name.as_str())
            .collect();
        Error::failure(
            path.display().to_string(),
            format!("it has no such layer, only the channels {}", names.join(", ")),
            "choose another --layer",
        )
    })?;
    if let Some(texel) = grid.values.iter().position(|value| !value.is_finite()) {
        return Err(Error::failure(
            path.display().to_string(),
            format!(
                "the texel in column {}, row {} is not a finite number",
                texel % grid.width,
                texel / grid.width
            ),
            "write the map again",
        ));
    }
    Ok((grid, layer))
}

/// Standard deviations of the difference at which the picture's colours are full.
const FULL_COLOUR_DEVIATIONS: f64 = 3.0;

/// Red where the map is brighter than the reference, blue where it is darker, white where they agree.
fn write_difference(path: &Path, map: &Grid, reference: &Grid) -> Result<Difference> {
    let differences: Vec<f64> = map
        .values
        .iter()
        .zip(&reference.values)
        .map(|(m, r)| m - r)
        .collect();
    let mean_square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
    let full_colour_at = FULL_COLOUR_DEVIATIONS * mean_square.sqrt();
    let rgba = differences
        .iter()
        .flat_map(|difference| {
            let share = if full_colour_at > 0.0 {
                (difference / full_colour_at).clamp(-1.0, 1.0)
            } else {
                0.0
            };
            let fade = (255.0 * (1.0 - share.abs())).round() as u8;
            if share >= 0.0 {
                [255, fade, fade, 255]
            } else {
                [fade, fade, 255, 255]
            }
        })
        .collect();
    let location = path.display().to_string();
    // Sides are at most 16384.
    let bytes = picture::encode(map.width as u32, map.height as u32, rgba, &location)?;
    files::write_atomically(path, |writer| writer.write_all(&bytes))?;
    Ok(Difference {
        file: location,
        full_colour_at,
    })
}
