//! Plots of studies, as SVG.

use plotters::prelude::*;

use super::convergence::{Axis, Measurement, curve, estimators};
use super::page::Plot;
use crate::error::{Error, Result};

/// Width and height [pixels].
const SIZE: (u32, u32) = (1080, 480);

/// Told apart by people who do not see all colours (Okabe and Ito 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];
/// Width and height of a single plot [pixels].
const SINGLE: (u32, u32) = (760, 520);

/// Relative RMSE against light rays and against CPU seconds, one line per estimator, all axes logarithmic.
///
/// # Errors
/// Nothing that can be plotted: no error above zero.
pub fn convergence_svg(measurements: &[Measurement], title: &str) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, measurements, title).map_err(|reason| {
        Error::failure(
            title,
            format!("its plot cannot be drawn ({reason})"),
            "measure at more than one density",
        )
    })?;
    Ok(svg)
}

/// One plot of a study's page.
///
/// # Errors
/// Nothing that can be plotted.
pub fn svg(plot: &Plot) -> Result<String> {
    let mut svg = String::new();
    draw_single(&mut svg, plot).map_err(|reason| {
        Error::failure(
            &plot.title,
            format!("its plot cannot be drawn ({reason})"),
            "report this",
        )
    })?;
    Ok(svg)
}

fn draw_single(svg: &mut String, plot: &Plot) -> std::result::Result<(), String> {
    let failed = |error: DrawingAreaErrorKind<std::io::Error>| error.to_string();
    let root = SVGBackend::with_string(svg, SINGLE).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let root = root.titled(&plot.title, ("sans-serif", 18)).map_err(failed)?;
    let curves: Vec<(&str, Vec<(f64, f64)>)> = plot
        .curves
        .iter()
        .map(|curve| (curve.name.as_str(), curve.points.clone()))
        .collect();
    panel(&root, &curves, (plot.x, plot.y, plot.is_share)).map_err(failed)?;
    root.present().map_err(failed)
}

/// Reasons are the drawing library's.
fn draw(svg: &mut String, measurements: &[Measurement], title: &str) -> std::result::Result<(), String> {
    let failed = |error: DrawingAreaErrorKind<std::io::Error>| error.to_string();
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let root = root.titled(title, ("sans-serif", 20)).map_err(failed)?;
    let (left, right) = root.split_horizontally(SIZE.0 / 2);
    for (area, axis, label) in [
        (left, Axis::Rays, "light rays"),
        (right, Axis::CpuSeconds, "CPU time of the light pass [s]"),
    ] {
        let curves: Vec<(&str, Vec<(f64, f64)>)> = estimators(measurements)
            .into_iter()
            .map(|estimator| (estimator, curve(measurements, estimator, axis)))
            .collect();
        panel(&area, &curves, (label, "relative RMSE", true)).map_err(failed)?;
    }
    root.present().map_err(failed)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn panel(
    area: &Area,
    curves: &[(&str, Vec<(f64, f64)>)],
    (x_label, y_label, is_share): (&str, &str, bool),
) -> std::result::Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let (x, y) = (range(curves, |point| point.0), range(curves, |point| point.1));
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(x_label)
        .y_desc(y_label)
        .light_line_style(BLACK.mix(0.06))
        .bold_line_style(BLACK.mix(0.2))
        .x_label_formatter(&|value| power_of_ten(*value))
        .y_label_formatter(&|value| {
            if is_share {
                format!("{} %", rounded(100.0 * value))
            } else {
                power_of_ten(*value)
            }
        })
        .draw()?;
    for (index, (estimator, points)) in curves.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        // A second round of colours is told by its thin lines.
        let width = if index < COLOURS.len() { 2 } else { 1 };
        let points = points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0);
        let line = LineSeries::new(points, colour.stroke_width(width)).point_size(width + 1);
        chart
            .draw_series(line)?
            .label(*estimator)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(width)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.4))
        .draw()
}

/// Whole decades around all values; one around 1 where there are none.
fn range(curves: &[(&str, Vec<(f64, f64)>)], pick: fn(&(f64, f64)) -> f64) -> std::ops::Range<f64> {
    let (low, high) = curves
        .iter()
        .flat_map(|(_, points)| points.iter().map(pick))
        .filter(|value| *value > 0.0)
        .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| {
            (low.min(value), high.max(value))
        });
    if low > high {
        return 0.1..10.0;
    }
    let decade = |value: f64, round: fn(f64) -> f64| 10_f64.powf(round(value.log10()));
    let (low, high) = (decade(low, f64::floor), decade(high, f64::ceil));
    low..if high > low { high } else { 10.0 * low }
}

/// Without what powers of ten leave in the last digits.
fn rounded(value: f64) -> f64 {
    let unit = 10_f64.powf(value.abs().max(1e-12).log10().floor() - 3.0);
    (value / unit).round() * unit
}

fn power_of_ten(value: f64) -> String {
    if (1e-2..1e4).contains(&value) {
        format!("{value}")
    } else {
        format!("1e{}", value.log10().round())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_whole_decades() {
        let curves = [("a", vec![(15.0, 0.2)]), ("b", vec![(2500.0, 0.03)])];
        let x = range(&curves, |point| point.0);
        assert!(
            (x.start - 10.0).abs() < 1e-9 && (x.end - 1e4).abs() < 1e-6,
            "{x:?}"
        );
        assert_eq!(range(&[], |point| point.0), 0.1..10.0);
        let single = range(&[("a", vec![(10.0, 1.0)])], |point| point.0);
        assert!(single.start < single.end, "{single:?}");
    }
}
