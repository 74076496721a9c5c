//! Studies whose result is a page: a table, plots, pictures, and what they say.

use std::path::Path;

use nephroid::error::Result;
use nephroid::study::page::Page;
use nephroid::study::pages::{Bench, PageStudy};
use nephroid::study::plot::svg;
use serde::Serialize;

use super::interrupt::Interrupt;
use super::progress_bar::StageBar;
use super::study::{csv_of, open_folder, write};
use super::study_jobs::PageJob;
use super::terminal::Terminal;

/// Measures, writes pages with their tables, plots and pictures, and prints what they say.
///
/// # Errors
/// Output or a bake that failed; stopped before the end, which writes nothing of the page that it was at.
pub fn run(job: &PageJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let reports = job.studies.iter().map(|(study, output)| {
        let (report, text) = write_page(job, (study, output), terminal, interrupt)?;
        if !terminal.json {
            terminal.print_result(&text, &report)?;
        }
        Ok(report)
    });
    let reports: Vec<Report> = reports.collect::<Result<_>>()?;
    match &reports[..] {
        _ if !terminal.json => Ok(()),
        [report] => terminal.print_result("", report),
        all => terminal.print_result("", &all),
    }
}

fn write_page(
    job: &PageJob,
    (study, output): (&PageStudy, &Path),
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<(Report, String)> {
    let csv = format!("{}.csv", study.name);
    let folder = open_folder(output, job.force, &csv)?;
    let bar = StageBar::new(terminal);
    let page = study.page(&Bench {
        quick: job.quick,
        threads: job.threads,
        progress: &bar,
        control: interrupt.control(),
    })?;
    drop(bar);
    let mut files = vec![csv.clone()];
    write(&folder, &csv, &csv_of(&csv, page.table.exact())?)?;
    for plot in &page.plots {
        let file = format!("{}.svg", plot.name);
        write(&folder, &file, svg(plot)?.as_bytes())?;
        files.push(file);
    }
    for picture in &page.pictures {
        let file = format!("{}.png", picture.name);
        write(&folder, &file, &picture.png()?)?;
        files.push(file);
    }
    let markdown = format!("{}.md", study.name);
    write(&folder, &markdown, page.markdown(job.threads).as_bytes())?;
    files.push(markdown);
    let report = Report::new(study, &page, output.display().to_string(), files);
    let text = report.text(&page);
    Ok((report, text))
}

/// The result, as `--json` prints it.
#[derive(Serialize)]
struct Report {
    study: &'static str,
    folder: String,
    files: Vec<String>,
    columns: Vec<&'static str>,
    rows: Vec<Vec<String>>,
    findings: Vec<String>,
}

impl Report {
    fn new(study: &PageStudy, page: &Page, folder: String, files: Vec<String>) -> Self {
        Self {
            study: study.name,
            folder,
            files,
            columns: page.table.columns.iter().map(|(name, _)| *name).collect(),
            rows: page.table.exact().split_off(1),
            findings: page.findings.clone(),
        }
    }

    fn text(&self, page: &Page) -> String {
        let mut text = format!("folder {}: {}\n\n", self.folder, self.files.join(", "));
        text += &page.table.markdown();
        for finding in &self.findings {
            text += &format!("\n{finding}\n");
        }
        text
    }
}
