//! `study effects`: what each effect costs and what it is worth.

use std::fmt::Write as _;

use nephroid::effect::Effect;
use nephroid::error::Result;
use nephroid::export::png;
use nephroid::files;
use nephroid::study::effects::{self, DifferencePicture, EffectRow, EffectTable};
use serde::Serialize;

use super::interrupt::Interrupt;
use super::progress_bar::StageBar;
use super::study::{csv_of, load, open_folder, write};
use super::study_jobs::EffectsJob;
use super::terminal::Terminal;

const CSV: &str = "effects.csv";

/// Bakes with and without each effect, writes the table and a picture per effect, and prints the table.
///
/// # Errors
/// Input, output or a bake that failed; stopped before the end, which writes nothing.
pub fn run(job: &EffectsJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let scene = load(&job.scene, terminal)?;
    let is_ours = job.output.join(CSV).is_file();
    let folder = open_folder(&job.output, job.force, CSV)?;
    interrupt.check(&scene.source)?;
    let bar = StageBar::new(terminal);
    let table = effects::measure(&scene, &job.study, &bar, interrupt.control())?;
    drop(bar);
    terminal.print_warnings(&table.warnings);
    for worth in &table.effects {
        if let Some(picture) = &worth.picture {
            write(&folder, &picture_name(worth.effect), &encode(picture)?)?;
        }
    }
    let rows = table.effects.iter().map(|worth| &worth.row);
    write(&folder, CSV, &csv_of(CSV, rows.chain([&table.forced]))?)?;
    if is_ours {
        let outdated = Effect::ALL
            .into_iter()
            .filter(|effect| !has_picture(&table, *effect));
        for effect in outdated {
            files::remove_file(&folder.path().join(picture_name(effect)))?;
        }
    }
    let report = Report::new(job, &scene.source, &table);
    terminal.print_result(&report.text(), &report)
}

fn picture_name(effect: Effect) -> String {
    format!("difference_{}.png", effect.name())
}

fn has_picture(table: &EffectTable, effect: Effect) -> bool {
    let mut worths = table.effects.iter();
    worths.any(|worth| worth.effect == effect && worth.picture.is_some())
}

fn encode(picture: &DifferencePicture) -> Result<Vec<u8>> {
    png::encode(
        picture.width,
        picture.height,
        picture.rgba.clone(),
        &picture.surface,
    )
}

/// The result, as `--json` prints it.
#[derive(Serialize)]
struct Report {
    folder: String,
    scene: String,
    /// Bakes as planned, and as many with everything forced on.
    repeats: usize,
    effects: Vec<EffectEntry>,
    everything_forced_on: EffectRow,
}

/// One effect.
#[derive(Serialize)]
struct EffectEntry {
    #[serde(flatten)]
    row: EffectRow,
    picture: Option<PictureEntry>,
}

/// A picture of a difference.
#[derive(Serialize)]
struct PictureEntry {
    file: String,
    surface: String,
}

impl Report {
    fn new(job: &EffectsJob, scene: &str, table: &EffectTable) -> Self {
        let entries = table.effects.iter().map(|worth| EffectEntry {
            row: worth.row.clone(),
            picture: worth.picture.as_ref().map(|picture| PictureEntry {
                file: picture_name(worth.effect),
                surface: picture.surface.clone(),
            }),
        });
        Self {
            folder: job.output.display().to_string(),
            scene: scene.to_string(),
            repeats: job.study.repeats,
            effects: entries.collect(),
            everything_forced_on: table.forced.clone(),
        }
    }

    fn rows(&self) -> impl Iterator<Item = &EffectRow> {
        let effects = self.effects.iter().map(|entry| &entry.row);
        effects.chain([&self.everything_forced_on])
    }

    fn text(&self) -> String {
        let mut text = format!("folder {}: {CSV}", self.folder);
        for picture in self.effects.iter().filter_map(|entry| entry.picture.as_ref()) {
            let _ = write!(text, ", {} of {}", picture.file, picture.surface);
        }
        let _ = writeln!(
            text,
            "\n\n{:<20} {:>9} {:>9} {:>11} {:>10} {:>10} {:>10} {:>10} {:>11} {:>10} {:>10} {:>6} {:>6}",
            "effect",
            "rays",
            "deposits",
            "bytes",
            "CPU ms",
            "with W",
            "without W",
            "worth W",
            "RMSE",
            "with CPU s",
            "without",
            "CPU x",
            "rays x"
        );
        for row in self.rows() {
            let _ = writeln!(text, "{}", line(row));
        }
        text.push('\n');
        for row in self.rows() {
            let _ = writeln!(text, "{}: {}", row.effect, row.reason);
        }
        text + "x: with over without; pictures: warm where an effect adds light, cool where it takes light away, 1 to \
                1000 % of the map's mean"
    }
}

fn line(row: &EffectRow) -> String {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let ratio = |ratio: Option<f64>| or_dash(ratio.map(|ratio| format!("{ratio:.3}")));
    let cpu_ms = or_dash(row.cpu_ms.map(|cpu_ms| format!("{cpu_ms:.2}")));
    let rmse = or_dash(row.relative_rmse.map(|rmse| format!("{:.3} %", 100.0 * rmse)));
    format!(
        "{:<20} {:>9} {:>9} {:>11} {:>10} {:>10.5} {:>10.5} {:>10.5} {:>11} {:>10.4} {:>10.4} {:>6} {:>6}",
        row.effect,
        row.rays,
        row.deposits,
        row.bytes,
        cpu_ms,
        row.with_w,
        row.without_w,
        row.difference_w,
        rmse,
        row.cpu_with_s,
        row.cpu_without_s,
        ratio(row.cpu_ratio),
        ratio(row.rays_ratio)
    )
}
