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
    /// Samples across and down that are added to a pixel whose first ones differ visibly; 0 for none.
    pub added_per_side: u32,
    pub limits: ChainLimits,
    /// Wavelengths traced per sample, from the first dispersive surface on; 0 traces a single path by the refractive
    /// indices at 587.56 nm. Added samples share as many as the first ones had.
    pub wavelengths: u32,
}

impl ReferenceSettings {
    /// For pictures that are kept, without wavelengths if dispersion is switched off.
    pub fn still(dispersion: EffectSwitch) -> Self {
        let settings = Self {
            samples_per_side: 2,
            added_per_side: 4,
            ..Self::default()
        };
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
            added_per_side: 0,
            limits: ChainLimits::default(),
            wavelengths: 16,
        }
    }
}

/// Samples of a pixel differ visibly if they are further apart on a display, whose white is 1. Rims of glass then look as
/// smooth as in a picture of nine times the pixels.
const VISIBLE: f64 = 1.0 / 16.0;

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
    // Clear bodies are left out without chains, so that the camera is inside none.
    let media = match settings.limits.switch {
        EffectSwitch::Auto | EffectSwitch::On => media_at(tracer, view.camera.position),
        EffectSwitch::Off => MediumStack::default(),
    };
    let side = settings.samples_per_side.max(1);
    let canvas = Canvas {
        lit: &lit,
        media,
        view,
        passes: if settings.added_per_side > 0 { 2 } else { 1 },
        progress,
        control,
    };

    // Samples lie on a regular grid.
    let (mut pixels, mut rays) =
        canvas.sampled(&Grid::new(tracer, side, settings.wavelengths), 0, |_| true)?;
    if settings.added_per_side > 0 {
        // An exposure that suits the picture tells which of its pixels have samples that differ visibly.
        let exposure = canvas.picture(&pixels).auto_exposure_stops().exp2();
        let added = settings.added_per_side;
        let wavelengths = (settings.wavelengths * side * side).div_ceil(added * added);
        let grid = Grid::new(tracer, added, wavelengths);
        let (more, more_rays) = canvas.sampled(&grid, 1, |pixel| pixels[pixel].is_uneven(exposure))?;
        pixels
            .iter_mut()
            .zip(&more)
            .for_each(|(pixel, more)| pixel.add(more));
        rays = rays + more_rays;
    }
    Ok((canvas.picture(&pixels), rays))
}

/// Places of the samples within a pixel. Each has wavelengths and microfacets of its own: their mean covers spectrum and
/// lobes more densely.
struct Grid {
    side: u32,
    /// One per sample.
    spectra: Vec<SpectralScene>,
}

impl Grid {
    fn new(tracer: &Tracer, side: u32, wavelengths: u32) -> Self {
        let spectra = SpectralScene::of_samples(tracer, wavelengths, side * side);
        Self { side, spectra }
    }
}

/// What the samples of a pixel have seen [W/(m² sr)].
#[derive(Clone, Copy, Default)]
struct SeenPixel {
    sum: LinearSrgb,
    count: u32,
    /// Smallest and largest value of each channel.
    range: [[f64; 3]; 2],
}

impl SeenPixel {
    fn add_sample(&mut self, radiance: LinearSrgb) {
        let channels = radiance.to_array();
        let [low, high] = if self.count == 0 {
            [channels; 2]
        } else {
            self.range
        };
        let of_each = |bound: [f64; 3], choice: fn(f64, f64) -> f64| {
            std::array::from_fn(|channel| choice(bound[channel], channels[channel]))
        };
        self.range = [of_each(low, f64::min), of_each(high, f64::max)];
        self.sum += radiance;
        self.count += 1;
    }

    fn add(&mut self, other: &Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// Whether samples differ visibly at an exposure.
    fn is_uneven(&self, exposure: f64) -> bool {
        let display = |value: f64| value * exposure / (1.0 + value * exposure);
        let [low, high] = self.range.map(|channels| channels.map(display));
        (0..3).any(|channel| high[channel] - low[channel] > VISIBLE)
    }
}

/// A view that is being sampled.
struct Canvas<'a> {
    lit: &'a LitScene<'a>,
    /// Around the eye.
    media: MediumStack,
    view: &'a View,
    /// Over all of its rows.
    passes: u64,
    progress: &'a dyn Progress,
    control: &'a Control,
}

impl Canvas<'_> {
    /// One pass over all pixels, of which it samples those that are `chosen`.
    ///
    /// # Errors
    /// It was cancelled.
    fn sampled(
        &self,
        grid: &Grid,
        pass: u64,
        chosen: impl Fn(usize) -> bool + Sync,
    ) -> Result<(Vec<SeenPixel>, EyeRays)> {
        // A row is one task: long enough to outweigh its overhead, short enough to cancel the picture quickly.
        let (width, height) = (self.view.width, self.view.height);
        let done = AtomicU64::new(pass * u64::from(height));
        let rows: Vec<(Vec<SeenPixel>, EyeRays)> = (0..height)
            .into_par_iter()
            .map(|row| {
                let mut rays = EyeRays::default();
                if self.control.is_cancelled() {
                    return (Vec::new(), rays);
                }
                let pixel = |column: u32| {
                    let is_chosen = chosen(row as usize * width as usize + column as usize);
                    if is_chosen {
                        self.pixel(grid, [column, row], &mut rays)
                    } else {
                        SeenPixel::default()
                    }
                };
                let pixels = (0..width).map(pixel).collect();
                let rows_done = done.fetch_add(1, Ordering::Relaxed) + 1;
                self.progress
                    .advance(Stage::Picture, rows_done, self.passes * u64::from(height));
                (pixels, rays)
            })
            .collect();

        // A cancelled picture has empty rows.
        if self.control.is_cancelled() {
            return Err(Error::cancelled("picture"));
        }

        // Rows are put together in order, whichever thread finished them first.
        let rays = rows.iter().fold(EyeRays::default(), |sum, (_, rays)| sum + *rays);
        Ok((rows.into_iter().flat_map(|(pixels, _)| pixels).collect(), rays))
    }

    fn pixel(&self, grid: &Grid, place: [u32; 2], rays: &mut EyeRays) -> SeenPixel {
        let mut seen = SeenPixel::default();
        for (index, spectrum) in (0..).zip(&grid.spectra) {
            let within = [index % grid.side, index / grid.side];
            let within = within.map(|step| (f64::from(step) + 0.5) / f64::from(grid.side));
            let sample = EyeSample {
                cone: eye_cone(self.view, place, within),
                media: self.media,
                spectrum,
                facets: FacetPoints::of_sample(place, index, grid.side * grid.side),
            };
            seen.add_sample(self.lit.radiance(&sample, rays));
        }
        seen
    }

    fn picture(&self, pixels: &[SeenPixel]) -> Picture {
        let mean = |pixel: &SeenPixel| pixel.sum / f64::from(pixel.count.max(1));
        Picture {
            width: self.view.width,
            height: self.view.height,
            radiance: pixels
                .iter()
                .map(|pixel| mean(pixel).to_array().map(|channel| channel as f32))
                .collect(),
        }
    }
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
