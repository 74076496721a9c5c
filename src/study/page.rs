//! A study's result as a page: a table, plots and pictures, and what they say, in Markdown.

use std::fmt::Write as _;

use super::cost::three_digits;
use crate::error::Result;
use crate::export::png;

/// One value of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A word.
    Text(String),
    /// A number of things.
    Count(u64),
    /// Anything measured, in the unit of its column.
    Number(f64),
    /// A share [1]; shown to people in per cent.
    Share(f64),
    /// Nothing was measured.
    Empty,
}

impl Cell {
    /// As a table for programs holds it: every digit, shares as they are.
    pub fn exact(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(value) | Self::Share(value) => format!("{value}"),
            Self::Empty => String::new(),
        }
    }

    /// As people read it: three digits.
    pub fn told(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(value) => three_digits(*value),
            Self::Share(value) => format!("{} %", three_digits(100.0 * value)),
            Self::Empty => String::new(),
        }
    }

    /// Its number; `None` of words and of nothing.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Number(value) | Self::Share(value) => Some(*value),
            Self::Text(_) | Self::Empty => None,
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

/// Rows under named columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Name for programs, with its unit, and heading for people.
    pub columns: Vec<(&'static str, &'static str)>,
    /// Each as long as `columns`.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table.
    pub fn new(columns: &[(&'static str, &'static str)]) -> Self {
        Self {
            columns: columns.to_vec(),
            rows: Vec::new(),
        }
    }

    /// The rows for programs, the header first.
    pub fn exact(&self) -> Vec<Vec<String>> {
        let header = self.columns.iter().map(|(name, _)| (*name).to_string());
        let mut lines: Vec<Vec<String>> = vec![header.collect()];
        lines.extend(self.rows.iter().map(|row| row.iter().map(Cell::exact).collect()));
        lines
    }

    /// As a table of Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let headings = self.columns.iter().map(|(_, heading)| (*heading).to_string());
        let mut text = line(headings.collect());
        text += &format!("|{}\n", "---|".repeat(self.columns.len()));
        for row in &self.rows {
            text += &line(row.iter().map(Cell::told).collect());
        }
        text
    }
}

/// Named points, from left to right; all above zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// For the legend.
    pub name: String,
    /// Both axes are logarithmic.
    pub points: Vec<(f64, f64)>,
}

/// Curves on logarithmic axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// File name without `.svg`.
    pub name: &'static str,
    /// Above it.
    pub title: String,
    /// Below, with its unit.
    pub x: &'static str,
    /// At the left, with its unit.
    pub y: &'static str,
    /// Whether y is a share that is shown in per cent.
    pub is_share: bool,
    /// At least one.
    pub curves: Vec<Curve>,
}

/// 8-bit sRGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// File name without `.png`.
    pub name: &'static str,
    /// What is seen, row by row.
    pub caption: String,
    /// Across and down [pixels].
    pub size: (u32, u32),
    /// Row 0 at the top.
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// A size that does not agree with the pixels.
    pub fn png(&self) -> Result<Vec<u8>> {
        png::encode(self.size.0, self.size.1, self.rgba.clone(), self.name)
    }
}

/// All that a study says.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Heading.
    pub title: String,
    /// What was measured, on which scenes, with which settings.
    pub settings: String,
    /// Figures.
    pub table: Table,
    /// Each a file.
    pub plots: Vec<Plot>,
    /// Each a file.
    pub pictures: Vec<Picture>,
    /// What the figures say, each one sentence or a few.
    pub findings: Vec<String>,
}

impl Page {
    /// As Markdown, with links to the files beside it; `threads` is what was asked for, 0 for one per core.
    pub fn markdown(&self, threads: usize) -> String {
        let mut text = format!(
            "# {}\n\n{}\n\n{}\n\n",
            self.title,
            self.settings,
            machine(threads)
        );
        if !self.findings.is_empty() {
            text += "## What it says\n\n";
            for finding in &self.findings {
                let _ = writeln!(text, "- {finding}");
            }
            text += "\n";
        }
        text += "## Figures\n\n";
        text += &self.table.markdown();
        for plot in &self.plots {
            let _ = write!(text, "\n![{}]({}.svg)\n", plot.title, plot.name);
        }
        for picture in &self.pictures {
            let _ = write!(text, "\n![{0}]({1}.png)\n\n{0}\n", picture.caption, picture.name);
        }
        text
    }
}

/// What it ran on, and by which program.
fn machine(threads: usize) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if threads == 0 { cores } else { threads };
    let build = if cfg!(debug_assertions) {
        "a build with checks, slower than a release"
    } else {
        "a release build"
    };
    format!(
        "Nephroid {}, {build}, on {} {} with {cores} cores and {threads} threads. CPU seconds are of the light pass over all \
         threads: item buffers, tracing, depositing, and the estimate of the error. Wall-clock seconds depend on what else the \
         machine does; CPU seconds do less.",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_get_every_digit_and_people_three() {
        let mut table = Table::new(&[("rays", "light rays"), ("error", "error")]);
        table.rows.push(vec![1234_u64.into(), Cell::Share(0.012_345)]);
        assert_eq!(table.exact()[1], ["1234", "0.012345"]);
        let text = table.markdown();
        assert!(text.contains("| 1234 | 1.23 % |"), "{text}");
        assert_eq!(text.lines().count(), 3);
    }
}
