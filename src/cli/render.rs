//! `render`: one picture.

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use super::args::Backend;
use super::bake::{self, Clock, LoadedScene};
use super::job::{MapSource, PictureFormat, PictureRequest, RenderJob};
use super::terminal::{Interrupt, StageBar, Terminal};
use super::values::Exposure;
use nephroid::effect::{Effect, EffectSwitches};
use nephroid::error::{Error, Result};
use nephroid::export::{map_reader, picture};
use nephroid::eye_pass::reference::{self, ChainLimits, ReferenceSettings};
use nephroid::eye_pass::{Picture, View, tone_mapping};
use nephroid::files;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::optics::spectrum::xyz::Matrix3;
use nephroid::scene::{Camera, Scene};
use nephroid::settings::BakeSettings;
use nephroid::transport::Tracer;

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
    let made = make(
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

/// Samples across and down each pixel.
const SAMPLES_PER_SIDE: u32 = 2;

/// A picture, and how it was made.
pub struct MadePicture {
    pub picture: Picture,
    /// With the exposure that was used.
    pub view: View,
    /// What radiance is multiplied by before tone mapping.
    pub white_balance: Matrix3,
    /// The graphics card's name, or `cpu`.
    pub made_by: String,
}

impl MadePicture {
    /// The bytes of a file; `location` is named in errors.
    ///
    /// # Errors
    /// A size that the format cannot hold.
    pub fn encode(&self, format: PictureFormat, location: &str) -> Result<Vec<u8>> {
        match format {
            PictureFormat::Png => {
                let view = &self.view;
                let white = &self.white_balance;
                picture::display_png(&self.picture, view.exposure_stops, view.tone_map, white, location)
            }
            PictureFormat::Exr => picture::radiance_exr(&self.picture, location),
        }
    }
}

/// Makes the picture, by the card where there is one and no other wish; `settings` switch what the eye sees in mirrors and glass.
///
/// # Errors
/// No such camera; a card that was asked for and is not there; a signal.
pub fn make(
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    settings: &BakeSettings,
    request: &PictureRequest,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<MadePicture> {
    let (width, height) = request.size;
    let mut view = View {
        camera: choose_camera(scene, request)?,
        width,
        height,
        exposure_stops: 0.0,
        tone_map: request.tone_map,
        background: LinearSrgb::BLACK,
    };
    let effects = &settings.effects;
    interrupt.check("picture")?;
    let (picture, made_by) = match request.backend {
        Some(Backend::Cpu) => by_cpu(scene, maps, &view, effects, terminal, interrupt)?,
        Some(Backend::Gpu) => by_gpu(scene, maps, &view, effects)?,
        None => match by_gpu(scene, maps, &view, effects) {
            Ok(made) => made,
            Err(error) => {
                terminal.print_note(&format!("{error}: the CPU makes the picture"));
                by_cpu(scene, maps, &view, effects, terminal, interrupt)?
            }
        },
    };
    interrupt.check("picture")?;
    view.exposure_stops = match request.exposure {
        Exposure::Stops(stops) => stops,
        Exposure::Auto => tone_mapping::auto_exposure_stops(&picture),
    };
    Ok(MadePicture {
        picture,
        view,
        white_balance: request.white_balance.matrix(scene),
        made_by,
    })
}

fn by_cpu(
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    view: &View,
    effects: &EffectSwitches,
    terminal: &Terminal,
    interrupt: &Interrupt,
) -> Result<(Picture, String)> {
    let tracer = Tracer::new(scene.clone());
    let settings = ReferenceSettings {
        samples_per_side: SAMPLES_PER_SIDE,
        limits: ChainLimits {
            switch: effects.get(Effect::Chains),
            ..ChainLimits::default()
        },
        ..ReferenceSettings::switched(effects.get(Effect::Dispersion))
    };
    let bar = StageBar::new(terminal);
    let picture = reference::render(&tracer, maps, view, &settings, &bar, interrupt.control())?;
    Ok((picture, "cpu".into()))
}

#[cfg(feature = "gpu")]
fn by_gpu(
    scene: &Scene,
    maps: &[IlluminationMap],
    view: &View,
    effects: &EffectSwitches,
) -> Result<(Picture, String)> {
    use nephroid::eye_pass::renderer::render_counted;

    let gpu = nephroid::gpu::Gpu::headless()?;
    let (picture, _) = render_counted(&gpu, scene, maps, view, SAMPLES_PER_SIDE, effects)?;
    Ok((picture, gpu.adapter_name()))
}

#[cfg(not(feature = "gpu"))]
fn by_gpu(_: &Scene, _: &[IlluminationMap], _: &View, _: &EffectSwitches) -> Result<(Picture, String)> {
    Err(Error::failure(
        "--backend gpu",
        "this program was built without the gpu feature",
        "use --backend cpu",
    ))
}

/// The camera of that name or index; without a wish the first, or one that frames the scene.
pub fn choose_camera(scene: &Scene, request: &PictureRequest) -> Result<Camera> {
    let Some(wish) = &request.camera else {
        return Ok(scene
            .cameras
            .first()
            .cloned()
            .unwrap_or_else(|| framing_camera(scene, request.size)));
    };
    let by_name = scene.cameras.iter().find(|camera| camera.name == *wish);
    let by_index = || {
        wish.parse()
            .ok()
            .and_then(|index: usize| scene.cameras.get(index))
    };
    by_name.or_else(by_index).cloned().ok_or_else(|| {
        let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let remedy = if names.is_empty() {
            "the scene has no camera: leave --camera out to see all of it".to_string()
        } else {
            format!("choose one of {} or an index from 0", names.join(", "))
        };
        Error::failure("--camera", format!("there is no camera {wish}"), remedy)
    })
}

fn framing_camera(scene: &Scene, (width, height): (u32, u32)) -> Camera {
    // An empty scene has nothing to frame: any box will do.
    let bounds = scene.bounds().unwrap_or((-glam::DVec3::ONE, glam::DVec3::ONE));
    Camera::framing("all", bounds, f64::from(width) / f64::from(height))
}
