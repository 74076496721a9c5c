//! The eye pass on the CPU: a ray tracer that follows every chain of mirrors and glass, and the reference for the GPU.
//! A chain is one path in RGB until it meets dispersive glass, and several paths of single wavelengths from there.

mod radiance;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::sync::atomic::{AtomicU64, Ordering};

use super::facets::FacetPoints;
use super::highlights::{LobeLeft, RayCone};
use super::view::{Picture, View};
use crate::effect::EffectSwitch;
use crate::error::{Error, Result};
use crate::geometry::Ray;
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::progress::{Control, Progress, Stage};
use crate::scene::Camera;
use crate::transport::{MediumStack, Tracer, media_at};
use radiance::{EyeSample, LitScene, SpectralScene, visible_hit};

pub use radiance::{ChainLimits, EyeRays};

/// Quality of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSettings {
    /// Samples across and down a pixel, > 0. A single sample goes through the pixel centre, as in rasterisation.
    pub samples_per_side: u32,
    pub limits: ChainLimits,
    /// Wavelengths traced per sample, from the first dispersive surface on; 0 traces a single path by the refractive
    /// indices at 587.56 nm.
    pub wavelengths: u32,
}

impl ReferenceSettings {
    /// The default, without wavelengths if dispersion is switched off.
    pub fn switched(dispersion: EffectSwitch) -> Self {
        let settings = Self::default();
        match dispersion {
            EffectSwitch::Auto | EffectSwitch::On => settings,
            EffectSwitch::Off => Self {
                wavelengths: 0,
                ..settings
            },
        }
    }
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self {
            samples_per_side: 1,
            limits: ChainLimits::default(),
            wavelengths: 16,
        }
    }
}

/// Renders a view of a scene lit by its illumination maps. The result does not depend on the number of threads.
///
/// Surfaces without a map show only their emission. The camera may be inside glass or water.
///
/// # Errors
/// It was cancelled.
pub fn render(
    tracer: &Tracer,
    maps: &[IlluminationMap],
    view: &View,
    settings: &ReferenceSettings,
    progress: &dyn Progress,
    control: &Control,
) -> Result<Picture> {
    render_counted(tracer, maps, view, settings, progress, control).map(|(picture, _)| picture)
}

/// [`render`] with ray counts. No chain rays are traced if nothing specular is in view.
///
/// # Errors
/// It was cancelled.
pub fn render_counted(
    tracer: &Tracer,
    maps: &[IlluminationMap],
    view: &View,
    settings: &ReferenceSettings,
    progress: &dyn Progress,
    control: &Control,
) -> Result<(Picture, EyeRays)> {
    let tracer = &tracer.as_seen();
    let lit = LitScene::new(tracer, maps, view.background, settings.limits);
    let sides = settings.samples_per_side.max(1);
    let spectra = SpectralScene::of_samples(tracer, settings.wavelengths, sides * sides);
    let looks = Looks { view, sides, spectra };
    match settings.limits.switch {
        EffectSwitch::Auto | EffectSwitch::On => {
            let media = media_at(tracer, view.camera.position);
            trace::<true>(&lit, media, &looks, progress, control)
        }
        // Clear bodies are left out, so that the camera is inside none.
        EffectSwitch::Off => trace::<false>(&lit, MediumStack::default(), &looks, progress, control),
    }
}

/// Sampling of a picture.
struct Looks<'a> {
    view: &'a View,
    /// Samples across and down a pixel.
    sides: u32,
    /// One per sample of a pixel.
    spectra: Vec<SpectralScene>,
}

fn trace<const CHAINS: bool>(
    lit: &LitScene<'_>,
    media: MediumStack,
    looks: &Looks<'_>,
    progress: &dyn Progress,
    control: &Control,
) -> Result<(Picture, EyeRays)> {
    // Samples lie on a regular grid. Each has wavelengths and microfacets of its own: their mean covers spectrum and
    // lobes more densely.
    let (view, side) = (looks.view, looks.sides);
    let done = AtomicU64::new(0);
    let pixel = |column: u32, row: u32, rays: &mut EyeRays| {
        let mut sum = LinearSrgb::BLACK;
        for (sample, spectrum) in (0..).zip(&looks.spectra) {
            let within = [sample % side, sample / side].map(|s| (f64::from(s) + 0.5) / f64::from(side));
            let sample = EyeSample {
                cone: eye_cone(view, [column, row], within),
                media,
                spectrum,
                facets: FacetPoints::of_sample([column, row], sample, side * side),
            };
            sum += lit.radiance::<CHAINS>(&sample, rays);
        }
        let mean = sum / f64::from(side * side);
        mean.to_array().map(|channel| channel as f32)
    };

    // A row is one task: long enough to outweigh its overhead, short enough to cancel the picture quickly.
    let rows: Vec<(Vec<[f32; 3]>, EyeRays)> = (0..view.height)
        .into_par_iter()
        .map(|row| {
            let mut rays = EyeRays::default();
            if control.is_cancelled() {
                return (Vec::new(), rays);
            }
            let pixels = (0..view.width)
                .map(|column| pixel(column, row, &mut rays))
                .collect();
            let rows_done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.advance(Stage::Picture, rows_done, u64::from(view.height));
            (pixels, rays)
        })
        .collect();

    // A cancelled picture has empty rows.
    if control.is_cancelled() {
        return Err(Error::cancelled("picture"));
    }

    // Rows are put together in order, whichever thread finished them first.
    let rays = rows.iter().fold(EyeRays::default(), |sum, (_, rays)| sum + *rays);
    let picture = Picture {
        width: view.width,
        height: view.height,
        radiance: rows.into_iter().flat_map(|(pixels, _)| pixels).collect(),
    };
    Ok((picture, rays))
}

/// The object seen at each pixel centre, row 0 at the top; `None` for the background.
pub fn first_hits(tracer: &Tracer, view: &View) -> Vec<Option<usize>> {
    (0..view.height)
        .into_par_iter()
        .flat_map_iter(|row| {
            (0..view.width).map(move |column| {
                let ray = eye_ray(view, [column, row], [0.5, 0.5]);
                visible_hit(tracer, ray).map(|(hit, _)| hit.object)
            })
        })
        .collect()
}

/// The footprint of a pixel about a position within it, as wide as that of one at the centre of the picture.
fn eye_cone(view: &View, pixel: [u32; 2], within: [f64; 2]) -> RayCone {
    let ray = eye_ray(view, pixel, within);
    let half_height = (0.5 * view.camera.vertical_fov_rad).tan();
    let spread_rad = 2.0 * half_height / f64::from(view.height);
    RayCone {
        ray,
        width_m: spread_rad * view.camera.near_m,
        spread_rad,
        lobe: LobeLeft::None,
    }
}

/// The ray through a position within a pixel ([0, 1] from its left and top), starting at the near plane.
fn eye_ray(view: &View, [column, row]: [u32; 2], within: [f64; 2]) -> Ray {
    let x = (f64::from(column) + within[0]) / f64::from(view.width) * 2.0 - 1.0;
    let y = 1.0 - (f64::from(row) + within[1]) / f64::from(view.height) * 2.0;
    let Camera {
        position,
        forward,
        near_m,
        ..
    } = view.camera;
    let direction = view
        .camera
        .direction(x, y, f64::from(view.width) / f64::from(view.height));
    Ray {
        origin: position + direction * (near_m / direction.dot(forward)),
        direction,
    }
}
