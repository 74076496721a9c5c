//! `compare`: a map against its reference.

use std::path::{Path, PathBuf};

use clap::Args;
use nephroid::error::{Error, Result};
use nephroid::export::{FloatImage, picture};
use nephroid::files;
use nephroid::illumination::compare::{Grid, agreement, at_common_size};
use serde_json::json;

use super::console::{Console, extend};
use super::options::RunOptions;
use super::picture::holds_radiance;
use super::values::{self, Named};

/// Layers of an EXR map that can be compared.
const LAYERS: &[Named<&str>] = &[
    ("caustic", "caustic"),
    ("direct", "direct"),
    ("indirect", "indirect"),
    ("sum", "sum"),
];

#[derive(Debug, Args)]
pub struct CompareArguments {
    /// Map to judge: .exr or .pfm
    map: PathBuf,
    /// What it should be: .exr or .pfm
    reference: PathBuf,
    /// caustic, direct, indirect or sum [default: caustic where there is one]
    #[arg(long, value_parser = values::named(LAYERS))]
    layer: Option<&'static str>,
    /// Picture: red where the map is brighter, blue where darker
    #[arg(long, value_name = "FILE.png")]
    difference: Option<PathBuf>,
    /// Exit with 1 if the relative RMSE is above this
    #[arg(long, value_name = "PERCENT", value_parser = values::within(0.0..=1e9, "%"), allow_negative_numbers = true)]
    max_rmse: Option<f64>,
    #[command(flatten)]
    pub run: RunOptions,
}

impl CompareArguments {
    /// Compares, prints the measures, and fails if the limit is exceeded.
    ///
    /// # Errors
    /// Bad usage; files that cannot be read or compared; a relative RMSE above the limit.
    pub fn run(&self, console: &Console) -> Result<()> {
        // A bad name for the picture of the difference is refused before any map is read.
        self.validate()?;
        let failed = |path: &Path, what: String, remedy: &str| {
            Err(Error::failure(path.display().to_string(), what, remedy))
        };

        // Luminances meet at the coarser of both sizes: means over whole blocks of texels conserve the flux.
        let (map, layer) = read_luminance(&self.map, self.layer)?;
        let (reference, reference_layer) = read_luminance(&self.reference, self.layer)?;
        let Some((map, reference)) = at_common_size(&map, &reference) else {
            let what = format!(
                "its size {}x{} and the reference's {}x{} are not whole multiples of each other",
                map.width, map.height, reference.width, reference.height
            );
            return failed(&self.map, what, "bake at a multiple of the reference's size");
        };

        // Errors are relative to the mean of the reference, so that a dark one defines none.
        let Some(measures) = agreement(&map.values, &reference.values) else {
            let what = "the reference is dark, so that nothing can be measured against it".into();
            return failed(&self.reference, what, "name a reference with light in it");
        };

        // Report the agreement as text and JSON.
        let percent = |share: f64| format!("{:.4} %", 100.0 * share);
        let pair = |map: f64, reference: f64| format!("{map:.6} (reference {reference:.6})");
        let mut lines = vec![
            ("size", format!("{} x {} texels", map.width, map.height)),
            ("relative RMSE", percent(measures.relative_rmse)),
            ("ARD", percent(measures.average_relative_difference)),
            ("peak", pair(measures.peak, measures.reference_peak)),
            ("mean", pair(measures.mean, measures.reference_mean)),
            ("flux ratio", percent(measures.flux_ratio)),
        ];
        let mut report = json!({
            "map": self.map.display().to_string(),
            "reference": self.reference.display().to_string(),
            "layer": layer,
            "reference_layer": reference_layer,
            "width": map.width,
            "height": map.height,
        });
        extend(&mut report, &measures);

        // Draw the difference if a file is named for it.
        if let Some(path) = &self.difference {
            let full_colour_at = write_difference(path, &map, &reference)?;
            let file = path.display().to_string();
            lines.push((
                "difference",
                format!("{file} (full red and blue at {full_colour_at:.6})"),
            ));
            report["difference"] = json!({"file": file, "full_colour_at": full_colour_at});
        }

        // The report is printed even where the limit is exceeded: its numbers explain the exit code.
        let line = |(name, value): &(&str, String)| format!("{name:<15} {value}\n");
        console.print_result(&lines.iter().map(line).collect::<String>(), &report)?;
        match self.max_rmse {
            Some(limit) if measures.relative_rmse > limit / 100.0 => {
                let rmse = percent(measures.relative_rmse);
                let what = format!("its relative RMSE of {rmse} is above the limit of {limit} %");
                failed(&self.map, what, "bake at a higher density or raise --max-rmse")
            }
            _ => Ok(()),
        }
    }

    fn validate(&self) -> Result<()> {
        let Some(path) = &self.difference else {
            return Ok(());
        };
        if holds_radiance(path)? {
            return Err(Error::usage(
                "--difference",
                format!("{} is not a .png file", path.display()),
                "name a file that ends in .png",
            ));
        }
        files::check_output_file(path)
    }
}

/// Luminance and name of the wanted layer: by default the caustic layer if there is one, else the sum.
pub fn read_luminance(path: &Path, wish: Option<&'static str>) -> Result<(Grid, &'static str)> {
    let image = FloatImage::read(path)?;

    // A dot in a channel name marks a map with layers; other images hold one layer as plain R, G, B or Y.
    let has_layers = image.channels.iter().any(|channel| channel.name.contains('.'));
    let layer = match wish {
        // A reference has one layer without a name, which stands for any.
        Some(wish) if has_layers => wish,
        None if image.channel("caustic.R").is_some() => "caustic",
        _ => "sum",
    };

    // The plain channels of a map are the sum of its layers.
    let prefix = if layer == "sum" { "" } else { layer };
    let grid = image.luminance(prefix).ok_or_else(|| {
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

    // A single NaN would turn every mean into NaN, so that its texel is named instead.
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

/// Difference of full colour in the picture, relative to the root mean square.
const FULL_COLOUR_DEVIATIONS: f64 = 3.0;

/// Writes a picture: red where the map is brighter than the reference, blue where it is darker, white where they agree.
/// Returns the difference of full colour, in the unit of the maps.
fn write_difference(path: &Path, map: &Grid, reference: &Grid) -> Result<f64> {
    // Full colour lies at a multiple of the root mean square, so that single outliers do not pale all other texels.
    let differences: Vec<f64> = map
        .values
        .iter()
        .zip(&reference.values)
        .map(|(m, r)| m - r)
        .collect();
    let mean_square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
    let full_colour_at = FULL_COLOUR_DEVIATIONS * mean_square.sqrt();

    // White fades into red or blue in proportion to the signed difference.
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
    // Cannot overflow: sides are at most 16384.
    let bytes = picture::encode(map.width as u32, map.height as u32, rgba, &location)?;
    files::write_atomically(path, |writer| writer.write_all(&bytes))?;
    Ok(full_colour_at)
}
