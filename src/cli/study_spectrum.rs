//! `study spectrum`: what sampling the spectrum costs and how right it is.

use std::fmt::Write as _;
use std::sync::Arc;

use nephroid::error::Result;
use nephroid::export::png;
use nephroid::study::spectrum::{self, SpectrumRow, SpectrumTable};
use serde::Serialize;

use super::interrupt::Interrupt;
use super::progress_bar::StageBar;
use super::study::{csv_of, load, open_folder, write};
use super::study_jobs::SpectrumJob;
use super::terminal::Terminal;

const CSV: &str = "spectrum.csv";
const PNG: &str = "spectrum.png";

/// Measures, writes the table and the strips, and says what each way costs.
///
/// # Errors
/// Input, output or a bake that failed; stopped before the end, which writes nothing.
pub fn run(job: &SpectrumJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let scene = load(&job.scene, terminal)?;
    let scene = Arc::new(spectrum::thin_beams(&scene));
    let folder = open_folder(&job.output, job.force, CSV)?;
    let bar = StageBar::new(terminal);
    let table = spectrum::measure(&scene, &job.study, &bar, interrupt.control())?;
    drop(bar);
    write(&folder, CSV, &csv_of(CSV, &table.rows)?)?;
    if let Some(strips) = &table.strips {
        let bytes = png::encode(strips.width, strips.height, strips.rgba.clone(), PNG)?;
        write(&folder, PNG, &bytes)?;
    }
    let report = Report::new(job, &scene.source, table);
    terminal.print_result(&report.text(), &report)
}

/// The result, as `--json` prints it.
#[derive(Serialize)]
struct Report {
    folder: String,
    scene: String,
    reference: String,
    /// Whose map the strips show, the reference's first and then row by row.
    surface: Option<String>,
    rows: Vec<SpectrumRow>,
}

impl Report {
    fn new(job: &SpectrumJob, scene: &str, table: SpectrumTable) -> Self {
        Self {
            folder: job.output.display().to_string(),
            scene: scene.to_string(),
            reference: table.reference,
            surface: table.strips.map(|strips| strips.surface),
            rows: table.rows,
        }
    }

    fn text(&self) -> String {
        let mut text = format!("folder {}: {CSV}", self.folder);
        if let Some(surface) = &self.surface {
            let _ = write!(text, ", {PNG} of {surface}: the reference, then row by row");
        }
        let _ = writeln!(text, "\nreference {}\n", self.reference);
        let _ = writeln!(
            text,
            "{:<10} {:<12} {:>11} {:>10} {:>10} {:>9} {:>9} {:>8}",
            "estimator", "sampling", "wavelengths", "rays", "CPU s", "colour", "luminance", "flux"
        );
        for row in &self.rows {
            let _ = writeln!(
                text,
                "{:<10} {:<12} {:>11} {:>10} {:>10.4} {:>7.2} % {:>7.2} % {:>8.5}",
                row.estimator,
                row.sampling,
                row.wavelengths,
                row.rays,
                row.cpu_light_pass_s,
                100.0 * row.colour_error,
                100.0 * row.luminance_error,
                row.flux_ratio
            );
        }
        text + "colour, luminance: root of the squared differences over that of the reference's squares"
    }
}
