//! `study stability`: the catalogue of hard cases, put to the test.

use std::fmt::Write as _;

use nephroid::error::{Error, Result};
use nephroid::study::stability::table::{Row, markdown, number, rows};
use nephroid::study::stability::{Case, CaseReport, Effort, cases};
use serde::Serialize;

use super::interrupt::Interrupt;
use super::study::{csv_of, open_folder, write};
use super::study_jobs::StabilityJob;
use super::terminal::Terminal;

const CSV: &str = "stability.csv";
const MARKDOWN: &str = "stability.md";

/// The cases that were asked for: those of that name, or all of that effort.
///
/// # Errors
/// A name that no case has.
pub fn chosen(name: Option<&str>, effort: Effort) -> Result<Vec<Case>> {
    let all = cases();
    let Some(name) = name else {
        return Ok(all.into_iter().filter(|case| case.effort <= effort).collect());
    };
    let known: Vec<&str> = all.iter().map(|case| case.name).collect();
    let found: Vec<Case> = all.iter().filter(|case| case.name == name).copied().collect();
    if found.is_empty() {
        return Err(Error::usage(
            "--case",
            format!("there is no case `{name}`"),
            format!("choose one of {}", known.join(", ")),
        ));
    }
    Ok(found)
}

/// Tests every case, writes the tables and prints them.
///
/// # Errors
/// Output or a bake that failed; stopped before the end, which writes nothing; a law that does not hold, after
/// everything was written and printed.
pub fn run(job: &StabilityJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let folder = open_folder(&job.output, job.force, CSV)?;
    let mut reports = Vec::new();
    for (index, case) in job.cases.iter().enumerate() {
        if terminal.shows_progress() {
            terminal.print_note(&format!("{} of {}: {}", index + 1, job.cases.len(), case.name));
        }
        reports.push(case.check((job.effort, job.threads), &(), interrupt.control())?);
        interrupt.check("study stability")?;
    }
    let rows = rows(&reports);
    write(&folder, CSV, &csv_of(CSV, &rows)?)?;
    write(&folder, MARKDOWN, markdown(&reports).as_bytes())?;
    let broken: Vec<&str> = reports
        .iter()
        .filter(|report| !report.holds())
        .map(|report| report.case)
        .collect();
    let report = Report {
        folder: job.output.display().to_string(),
        cases: reports.len(),
        bakes: reports.iter().map(|report| report.bakes).sum(),
        broken: broken.clone(),
        rows,
    };
    terminal.print_result(&report.text(&reports), &report)?;
    if broken.is_empty() {
        return Ok(());
    }
    Err(Error::failure(
        "study stability",
        format!("a law does not hold in {}", broken.join(", ")),
        "report this with the table",
    ))
}

/// The result, as `--json` prints it.
#[derive(Serialize)]
struct Report {
    folder: String,
    cases: usize,
    bakes: usize,
    /// Cases of which a law does not hold.
    broken: Vec<&'static str>,
    rows: Vec<Row>,
}

impl Report {
    fn text(&self, reports: &[CaseReport]) -> String {
        let mut text = format!("folder {}: {CSV}, {MARKDOWN}\n\n", self.folder);
        for report in reports {
            let books = report.books_open.map_or("-".into(), number);
            let _ = writeln!(
                text,
                "{} ({}): {} bakes, {:.2} s, books open by {books}",
                report.case,
                report.group.name(),
                report.bakes,
                report.seconds
            );
            for finding in &report.findings {
                let _ = writeln!(
                    text,
                    "  {:>8} of {:>8}  {}{}",
                    number(finding.worst),
                    number(finding.bound),
                    finding.law,
                    if finding.holds() { "" } else { "  DOES NOT HOLD" }
                );
            }
        }
        let _ = write!(
            text,
            "\n{} cases, {} bakes, {} laws, {} cases with a law that does not hold",
            self.cases,
            self.bakes,
            self.rows.len(),
            self.broken.len()
        );
        text
    }
}
