//! Curves of a table on logarithmic axes, as SVG.

use plotters::prelude::*;

use super::table::{Cell, Table};
use crate::error::{Error, Result};

/// Width and height [pixels].
const SIZE: (u32, u32) = (760, 520);

/// Distinguishable for colour-blind readers (Okabe and Ito 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// Plots two columns of a table against each other.
#[derive(Clone, Copy, Debug)]
pub struct Plot {
    /// File name without `.svg`.
    pub file: &'static str,
    /// Column on the horizontal axis.
    pub x: &'static str,
    /// Column on the vertical axis.
    pub y: &'static str,
    /// Columns that identify a curve.
    pub by: &'static [&'static str],
    /// Column and value that select rows; `None` selects all.
    pub only: Option<(&'static str, &'static str)>,
}

/// A named series of points above zero, from left to right.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// (x, y).
    pub points: Vec<(f64, f64)>,
}

impl Plot {
    /// Plots all rows, with one curve per combination of values in the columns `by`.
    pub const fn new(file: &'static str, [x, y]: [&'static str; 2], by: &'static [&'static str]) -> Self {
        Self {
            file,
            x,
            y,
            by,
            only: None,
        }
    }

    /// Selects the rows with this value in a column.
    pub const fn only(mut self, column: &'static str, value: &'static str) -> Self {
        self.only = Some((column, value));
        self
    }

    /// Whether the vertical axis is an error, which is shown in per cent.
    pub fn shows_error(&self) -> bool {
        self.y.ends_with("rmse")
    }

    /// The curves in a table; none if it lacks a column.
    pub fn curves(&self, table: &Table) -> Vec<Curve> {
        let mut curves: Vec<Curve> = Vec::new();
        let cell = |row: &[Cell], name| table.column(name).map(|column| row[column].clone());
        let is_taken = |row: &&Vec<Cell>| {
            self.only
                .is_none_or(|(name, value)| cell(row, name) == Some(value.into()))
        };
        for row in table.rows.iter().filter(is_taken) {
            let number = |name| cell(row, name)?.value().filter(|value| *value > 0.0);
            let Some(point) = number(self.x).zip(number(self.y)) else {
                continue;
            };
            let words = self.by.iter().filter_map(|name| Some(cell(row, name)?.rounded()));
            let name = words.collect::<Vec<_>>().join(", ");
            match curves.iter_mut().find(|curve| curve.name == name) {
                Some(curve) => curve.points.push(point),
                None => curves.push(Curve {
                    name,
                    points: vec![point],
                }),
            }
        }
        for curve in &mut curves {
            curve.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        curves
    }

    /// Draws curves as SVG.
    ///
    /// # Errors
    /// Errors of the drawing library.
    pub fn svg(&self, curves: &[Curve]) -> Result<String> {
        let mut svg = String::new();
        self.draw(&mut svg, curves).map_err(|reason| {
            Error::failure(
                self.file,
                format!("its plot cannot be drawn ({reason})"),
                "report this",
            )
        })?;
        Ok(svg)
    }

    fn draw(
        &self,
        svg: &mut String,
        curves: &[Curve],
    ) -> std::result::Result<(), DrawingAreaErrorKind<std::io::Error>> {
        // Logarithmic axes make power laws of error and cost straight lines.
        let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let (x, y) = (range(curves, |point| point.0), range(curves, |point| point.1));
        let mut chart = ChartBuilder::on(&root)
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(x.log_scale(), y.log_scale())?;
        let is_share = self.shows_error();
        chart
            .configure_mesh()
            .x_desc(self.x)
            .y_desc(self.y)
            .light_line_style(BLACK.mix(0.06))
            .bold_line_style(BLACK.mix(0.2))
            .x_label_formatter(&|value| tick(*value))
            .y_label_formatter(&|value| match is_share {
                true => format!("{} %", tick(100.0 * value)),
                false => tick(*value),
            })
            .draw()?;

        // Points mark what was measured; the lines between them only lead the eye.
        for (index, curve) in curves.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            // When colours repeat, lines become thinner.
            let width = if index < COLOURS.len() { 2 } else { 1 };
            let line = LineSeries::new(curve.points.iter().copied(), colour.stroke_width(width));
            chart
                .draw_series(line.point_size(width + 1))?
                .label(curve.name.as_str())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(width)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.4))
            .draw()?;
        root.present()
    }
}

/// Whole decades that enclose all values; a range around 1 if there are none.
fn range(curves: &[Curve], pick: fn(&(f64, f64)) -> f64) -> std::ops::Range<f64> {
    let values = curves.iter().flat_map(|curve| curve.points.iter().map(pick));
    let (low, high) = values.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return 0.1..10.0;
    }
    let decade = |value: f64, round: fn(f64) -> f64| 10_f64.powf(round(value.log10()));
    let (low, high) = (decade(low, f64::floor), decade(high, f64::ceil));
    low..if high > low { high } else { 10.0 * low }
}

/// Removes the rounding error that powers of ten leave in the last digits.
fn tick(value: f64) -> String {
    if !(1e-4..1e4).contains(&value) {
        return format!("1e{}", value.log10().round());
    }
    let unit = 10_f64.powf(value.log10().floor() - 3.0);
    format!("{}", ((value / unit).round() * unit * 1e9).round() / 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_whole_decades() {
        let curve = |points: &[(f64, f64)]| Curve {
            name: String::new(),
            points: points.to_vec(),
        };
        let curves = [curve(&[(15.0, 0.2)]), curve(&[(2500.0, 0.03)])];
        let x = range(&curves, |point| point.0);
        assert!(
            (x.start - 10.0).abs() < 1e-9 && (x.end - 1e4).abs() < 1e-6,
            "{x:?}"
        );
        assert_eq!(range(&[], |point| point.0), 0.1..10.0);
        let single = range(&[curve(&[(10.0, 1.0)])], |point| point.0);
        assert!(single.start < single.end, "{single:?}");
    }

    #[test]
    fn curves_are_rows_of_one_label_in_order() {
        let row = |name: &str, x: f64, y: Cell| vec![name.into(), x.into(), y];
        let table = Table {
            columns: vec!["name", "rays", "rmse"],
            rows: vec![
                row("b", 2.0, Cell::Share(0.1)),
                row("b", 1.0, Cell::Share(0.2)),
                row("a", 1.0, Cell::Share(0.3)),
                row("a", 2.0, Cell::Empty),
            ],
        };
        let plot = Plot::new("", ["rays", "rmse"], &["name"]);
        let curves = plot.curves(&table);
        assert_eq!(curves.len(), 2);
        assert_eq!(curves[0].points, [(1.0, 0.2), (2.0, 0.1)]);
        assert_eq!(curves[1].points, [(1.0, 0.3)]);
        assert_eq!(plot.only("name", "a").curves(&table).len(), 1);
    }
}
