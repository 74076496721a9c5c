//! Options of pictures: camera, backend, tone map; and how a picture is made.

use std::path::Path;
use std::sync::Arc;

use clap::Args;
use nephroid::effect::{Effect, EffectSwitches};
use nephroid::error::{Error, Result};
use nephroid::export::map_set::MapSet;
pub use nephroid::export::picture::holds_radiance;
use nephroid::eye_pass::reference::{self, ChainLimits, ReferenceSettings};
use nephroid::eye_pass::{Picture, ToneMap, View, WhiteBalance};
use nephroid::illumination::IlluminationMap;
use nephroid::scene::{Camera, Scene};
use nephroid::settings::BakeSettings;
use nephroid::transport::Tracer;

use super::console::Console;
use super::loaded::LoadedScene;
use super::options::PictureOptions;
use super::values::{self, Exposure};

/// Renderer of pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Backend {
    /// Rasteriser on the graphics card.
    Gpu,
    /// The reference ray tracer.
    Cpu,
}

const BACKENDS: &[values::Named<Backend>] = &[("gpu", Backend::Gpu), ("cpu", Backend::Cpu)];

/// How it is made and shown.
#[derive(Clone, Debug, Default, Args)]
pub struct EyeOptions {
    /// none, neutral, agx, aces or soft [default: soft]
    #[arg(long, value_parser = values::one_of::<ToneMap>(), hide_short_help = true)]
    pub tone_map: Option<ToneMap>,
    /// What appears white: none, lamps, KELVIN or X,Y [default: none]
    #[arg(long, value_name = "LIGHT", value_parser = str::parse::<WhiteBalance>, hide_short_help = true)]
    pub white_balance: Option<WhiteBalance>,
    /// gpu or cpu [default: gpu where there is one]
    #[arg(long, value_parser = values::named(BACKENDS))]
    pub backend: Option<Backend>,
}

/// Maps from a folder, or from a bake that ran to its end: incomplete light makes no picture.
///
/// # Errors
/// Those of a bake, or of [`MapSet::read_all`].
pub fn maps(
    folder: Option<&Path>,
    settings: &BakeSettings,
    loaded: &LoadedScene,
    console: &Console,
) -> Result<Vec<IlluminationMap>> {
    let Some(folder) = folder else {
        let result = loaded.bake(settings, console)?;
        console.check(&loaded.scene.source)?;
        return Ok(result.maps);
    };
    let set = MapSet::open(folder, &loaded.scene)?;
    let maps = set.read_all()?;
    console.warn(&set.warnings());
    Ok(maps)
}

/// Samples across and down per pixel of a graphics card.
const SAMPLES_PER_SIDE: u32 = 2;

/// What makes pictures without a graphics card.
pub const CPU: &str = "cpu";

/// A picture that was written, and how it was made.
pub struct MadePicture {
    /// With the exposure that was used.
    pub view: View,
    /// The graphics card's name, or [`CPU`].
    pub made_by: String,
}

/// The view of the requested camera.
///
/// # Errors
/// No such camera.
pub fn view(scene: &Scene, options: &PictureOptions, eye: &EyeOptions) -> Result<View> {
    Ok(view_of(choose_camera(scene, options)?, options, eye))
}

/// The view of a camera, without an exposure.
pub fn view_of(camera: Camera, options: &PictureOptions, eye: &EyeOptions) -> View {
    View {
        tone_map: eye.tone_map.unwrap_or_default(),
        ..View::new(camera, options.size.into())
    }
}

/// Renders and writes a picture: on the graphics card, unless there is none or the CPU is requested. `effects` switch
/// what the eye sees in mirrors and glass.
///
/// # Errors
/// No such camera; no graphics card although one is requested; output that cannot be written; a signal.
pub fn make(
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    effects: &EffectSwitches,
    (options, eye): (&PictureOptions, &EyeOptions),
    path: &Path,
    console: &Console,
) -> Result<MadePicture> {
    let mut view = view(scene, options, eye)?;
    let (picture, made_by) = drawn(scene, maps, &view, effects, eye.backend, console)?;
    view.exposure_stops = match options.exposure {
        Some(Exposure::Stops(stops)) => stops,
        _ => picture.auto_exposure_stops(),
    };
    let white = eye.white_balance.unwrap_or_default().matrix(scene);
    picture.white_balanced(&white).save(path, &view)?;
    Ok(MadePicture { view, made_by })
}

/// Radiance of a view, and the graphics card's name or `cpu`.
///
/// # Errors
/// No graphics card although one is requested; a signal.
pub fn drawn(
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    view: &View,
    effects: &EffectSwitches,
    backend: Option<Backend>,
    console: &Console,
) -> Result<(Picture, String)> {
    console.check("picture")?;
    let made = match backend {
        Some(Backend::Cpu) => by_cpu(scene, maps, view, effects, console)?,
        Some(Backend::Gpu) => by_gpu(scene, maps, view, effects, true)?,
        None => match by_gpu(scene, maps, view, effects, false) {
            Ok(made) => made,
            Err(error) => {
                console.note(&format!("{error}: the CPU makes the picture"));
                by_cpu(scene, maps, view, effects, console)?
            }
        },
    };
    console.check("picture")?;
    Ok(made)
}

fn by_cpu(
    scene: &Arc<Scene>,
    maps: &[IlluminationMap],
    view: &View,
    effects: &EffectSwitches,
    console: &Console,
) -> Result<(Picture, String)> {
    let tracer = Tracer::new(scene.clone());
    let settings = ReferenceSettings {
        limits: ChainLimits {
            switch: effects.get(Effect::Chains),
            ..ChainLimits::default()
        },
        ..ReferenceSettings::still(effects.get(Effect::Dispersion))
    };
    let picture = reference::render(&tracer, maps, view, &settings, &console.bar(), console.control())?;
    Ok((picture, CPU.into()))
}

/// `takes_software`: an adapter that is software, slower than `by_cpu`, also counts.
#[cfg(feature = "gpu")]
fn by_gpu(
    scene: &Scene,
    maps: &[IlluminationMap],
    view: &View,
    effects: &EffectSwitches,
    takes_software: bool,
) -> Result<(Picture, String)> {
    use nephroid::eye_pass::renderer::render_counted;

    let gpu = nephroid::gpu::Gpu::headless()?;
    if gpu.is_software() && !takes_software {
        let what = format!("{} is software, not a graphics card", gpu.adapter_name());
        return Err(Error::failure(
            "adapter",
            what,
            "choose --backend gpu to draw by it",
        ));
    }
    let (picture, _) = render_counted(&gpu, scene, maps, view, SAMPLES_PER_SIDE, effects)?;
    Ok((picture, gpu.adapter_name()))
}

#[cfg(not(feature = "gpu"))]
fn by_gpu(
    _: &Scene,
    _: &[IlluminationMap],
    _: &View,
    _: &EffectSwitches,
    _: bool,
) -> Result<(Picture, String)> {
    Err(Error::failure(
        "--backend gpu",
        "this program was built without the gpu feature",
        "use --backend cpu",
    ))
}

/// The camera of a name or index; by default the first one, or one that frames the scene.
pub fn choose_camera(scene: &Scene, options: &PictureOptions) -> Result<Camera> {
    let Some(wish) = &options.camera else {
        return Ok(scene
            .cameras
            .first()
            .cloned()
            .unwrap_or_else(|| framing_camera(scene, options.size)));
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
    let bounds = scene
        .inner_bounds()
        .unwrap_or((-glam::DVec3::ONE, glam::DVec3::ONE));
    Camera::framing("all", bounds, f64::from(width) / f64::from(height))
}
