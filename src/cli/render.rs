//! `render`: one picture.

use std::path::Path;

use nephroid::error::Result;
use nephroid::export::map_reader;
use nephroid::files;
use nephroid::illumination::IlluminationMap;
use nephroid::settings::BakeSettings;
use serde::Serialize;

use super::bake::{self, Clock, LoadedScene};
use super::interrupt::Interrupt;
use super::job::{MapSource, RenderJob};
use super::picture;
use super::terminal::Terminal;

/// The result, as `--json` prints it.
#[derive(Debug, Serialize)]
struct Report {
    picture: String,
    width: u32,
    height: u32,
    camera: String,
    exposure_stops: f64,
    made_by: String,
    maps: usize,
    seconds: f64,
}

/// Loads, bakes or reads maps, makes the picture and writes it.
///
/// # Errors
/// Input, output, a bake or a picture that failed.
pub fn run(job: &RenderJob, terminal: &Terminal, interrupt: &Interrupt) -> Result<()> {
    let clock = Clock::start();
    let loaded = bake::load(&job.scene, &clock, terminal)?;
    files::check_output_file(&job.output)?;
    let maps = maps(&job.maps, &loaded, &clock, terminal, interrupt)?;
    let made = picture::make(
        &loaded.scene,
        &maps,
        job.maps.settings(),
        &job.picture,
        terminal,
        interrupt,
    )?;
    let location = job.output.display().to_string();
    let bytes = made.encode(job.format, &location)?;
    files::write_atomically(&job.output, |writer| writer.write_all(&bytes))?;
    let report = Report {
        picture: location,
        width: made.view.width,
        height: made.view.height,
        camera: made.view.camera.name.clone(),
        exposure_stops: made.view.exposure_stops,
        made_by: made.made_by,
        maps: maps.len(),
        seconds: clock.wall_s(),
    };
    let text = format!(
        "picture   {} ({}x{}, camera {}, {} maps, exposure {:+.2} stops, by {})\nseconds   {:.2}",
        report.picture,
        report.width,
        report.height,
        report.camera,
        report.maps,
        report.exposure_stops,
        report.made_by,
        report.seconds
    );
    terminal.print_result(&text, &report)
}

/// Maps from where they are to come.
///
/// # Errors
/// Those of a bake, or of [`read_maps`].
pub fn maps(
    source: &MapSource,
    loaded: &LoadedScene,
    clock: &Clock,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<Vec<IlluminationMap>> {
    match source {
        MapSource::Bake(settings) => bake_maps(loaded, settings, clock, terminal, interrupt),
        MapSource::Folder(folder, _) => read_maps(folder, loaded, terminal),
    }
}

/// Maps of a bake that ran to its end: half-lit pictures are not made.
fn bake_maps(
    loaded: &LoadedScene,
    settings: &BakeSettings,
    clock: &Clock,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<Vec<IlluminationMap>> {
    let result = bake::bake(loaded, settings, clock, terminal, interrupt)?;
    interrupt.check(&loaded.scene.source)?;
    Ok(result.maps)
}

/// Maps that were baked before.
///
/// # Errors
/// Those of [`map_reader::read`].
pub fn read_maps(folder: &Path, loaded: &LoadedScene, terminal: &Terminal) -> Result<Vec<IlluminationMap>> {
    let (maps, warnings) = map_reader::read(folder, &loaded.scene)?;
    terminal.print_warnings(&warnings);
    Ok(maps)
}
