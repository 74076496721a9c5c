//! What sampling the spectrum costs and how right it is: split and stochastic rays, few wavelengths, many, and all
//! (Collins 1994, section 4.1 and colour plates 3 and 4).

use std::sync::Arc;

use serde::Serialize;

use super::convergence::name;
use super::repeats::{bake, light_pass_cpu_s, median};
use crate::error::{Error, Result};
use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::optics::spectrum::xyz::to_display_gamut;
use crate::progress::{Control, Progress};
use crate::scene::{LightKind, Scene};
use crate::session::BakeResult;
use crate::settings::{BakeSettings, Estimator, LayerKind, SpectralSampling, Wavelengths};

/// Numbers of wavelengths when none are asked for: those of the paper's plates.
pub const DEFAULT_WAVELENGTHS: [u32; 4] = [1, 4, 7, 13];

/// Wavelengths of the reference.
pub const REFERENCE_WAVELENGTHS: u32 = 300;

/// The reference's lattice is so many times as dense as the others.
const REFERENCE_DENSITY_FACTOR: f64 = 2.0;

/// A spot of less than this half-angle is a thin beam [rad].
const THIN_RAD: f64 = 0.05;

/// Luminance, over the reference's largest, from which on a texel is in the picture.
const SHOWN: f64 = 5e-3;

/// Dark texels around what is shown.
const MARGIN: usize = 4;

/// What is measured.
#[derive(Clone, Debug)]
pub struct SpectrumStudy {
    /// Of all bakes, but for the estimator and what it says of wavelengths.
    pub settings: BakeSettings,
    /// Each is measured split and stochastic.
    pub wavelengths: Vec<u32>,
    /// Bakes of each kind; their median CPU times count.
    pub repeats: usize,
}

/// One way to sample the spectrum.
#[derive(Clone, Debug, Serialize)]
pub struct SpectrumRow {
    /// Its name on the command line.
    pub estimator: String,
    /// `split`, `stochastic`, or `interpolated`.
    pub sampling: String,
    /// A number, or `continuous`.
    pub wavelengths: String,
    /// Light rays traced, each wavelength of a split counted.
    pub rays: u64,
    /// Kernels deposited.
    pub splats: u64,
    /// Item buffers, tracing and depositing: all of the light pass but the hierarchy [s of CPU].
    pub cpu_light_pass_s: f64,
    /// ‖I − R‖ / ‖R‖ over all texels and the channels of linear sRGB.
    pub colour_error: f64,
    /// The same of luminance.
    pub luminance_error: f64,
    /// Flux of I over that of R.
    pub flux_ratio: f64,
}

/// The lit part of one map, once for each way and first for the reference, one below the other.
#[derive(Clone, Debug)]
pub struct Strips {
    /// Whose map it is.
    pub surface: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// sRGB.
    pub rgba: Vec<u8>,
}

/// The result of the study.
#[derive(Clone, Debug)]
pub struct SpectrumTable {
    /// In the order of the strips after the first.
    pub rows: Vec<SpectrumRow>,
    /// `None` where nothing was lit.
    pub strips: Option<Strips>,
    /// What the errors are against.
    pub reference: String,
}

/// The scene with its thin beams alone; as it is where it has none.
pub fn thin_beams(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let is_thin = |light: &crate::scene::Light| match light.kind {
        LightKind::Spot { outer_cone_rad, .. } => outer_cone_rad < THIN_RAD,
        _ => false,
    };
    if scene.lights.iter().any(is_thin) {
        scene.lights.retain(is_thin);
    }
    scene
}

/// Bakes the reference and every way to sample, and compares them.
///
/// # Errors
/// Those of a bake; a scene without dispersive light; stopped before the end.
pub fn measure(
    scene: &Arc<Scene>,
    study: &SpectrumStudy,
    progress: &dyn Progress,
    control: &Control,
) -> Result<SpectrumTable> {
    let reference = BakeSettings {
        density_per_sr: study.settings.density_per_sr * REFERENCE_DENSITY_FACTOR,
        ..with(
            study,
            Estimator::Wavefront,
            Wavelengths::Fixed(REFERENCE_WAVELENGTHS),
            Some(SpectralSampling::Split),
        )
    };
    let truth = bake(scene, &reference, progress, control)?.maps;
    if truth.is_empty() {
        return Err(Error::failure(
            &scene.source,
            "no light comes to a diffuse surface by way of glass",
            "name a scene with a lit prism, such as builtin:spectrum",
        ));
    }
    let (mut rows, mut pictures) = (Vec::new(), vec![truth.clone()]);
    for settings in ways(study) {
        let mut results = Vec::new();
        for _ in 0..study.repeats.max(1) {
            results.push(bake(scene, &settings, progress, control)?);
        }
        rows.push(row(&settings, &results, &truth));
        pictures.push(results.swap_remove(0).maps);
    }
    Ok(SpectrumTable {
        rows,
        strips: strips(scene, &pictures),
        reference: format!(
            "wavefront, split into {REFERENCE_WAVELENGTHS} wavelengths, {:e} rays/sr",
            reference.density_per_sr
        ),
    })
}

/// Every way to sample, the paper's first.
fn ways(study: &SpectrumStudy) -> Vec<BakeSettings> {
    let mut ways = Vec::new();
    for estimator in [Estimator::Splat, Estimator::Wavefront] {
        for sampling in [SpectralSampling::Split, SpectralSampling::Stochastic] {
            for &count in &study.wavelengths {
                let wavelengths = Wavelengths::Fixed(count);
                ways.push(with(study, estimator, wavelengths, Some(sampling)));
            }
        }
        ways.push(with(study, estimator, Wavelengths::Continuous, None));
    }
    ways
}

fn with(
    study: &SpectrumStudy,
    estimator: Estimator,
    wavelengths: Wavelengths,
    spectral_sampling: Option<SpectralSampling>,
) -> BakeSettings {
    BakeSettings {
        estimator,
        sigma: estimator.default_sigma(),
        wavelengths,
        spectral_sampling,
        layers: vec![LayerKind::Caustic],
        ..study.settings.clone()
    }
}

fn row(settings: &BakeSettings, results: &[BakeResult], truth: &[IlluminationMap]) -> SpectrumRow {
    let difference = Difference::of(&results[0].maps, truth);
    let sampling = match (settings.estimator, settings.wavelengths) {
        (Estimator::Wavefront, Wavelengths::Continuous) => "interpolated",
        _ => match settings.ray_sampling() {
            SpectralSampling::Split => "split",
            SpectralSampling::Stochastic => "stochastic",
        },
    };
    let counts = &results[0].counts;
    SpectrumRow {
        estimator: name(settings.estimator),
        sampling: sampling.into(),
        wavelengths: match settings.wavelengths {
            Wavelengths::Continuous => "continuous".into(),
            Wavelengths::Rainbow => "rainbow".into(),
            Wavelengths::Fixed(count) => count.to_string(),
        },
        rays: counts.rays,
        splats: counts.splats,
        cpu_light_pass_s: median(results.iter().map(light_pass_cpu_s).collect()),
        colour_error: (difference.colour / difference.colour_of_truth).sqrt(),
        luminance_error: (difference.luminance / difference.luminance_of_truth).sqrt(),
        flux_ratio: difference.flux / difference.flux_of_truth,
    }
}

/// Sums over all texels, weighted by area.
#[derive(Default)]
struct Difference {
    colour: f64,
    colour_of_truth: f64,
    luminance: f64,
    luminance_of_truth: f64,
    flux: f64,
    flux_of_truth: f64,
}

impl Difference {
    fn of(maps: &[IlluminationMap], truth: &[IlluminationMap]) -> Self {
        let mut sum = Self::default();
        for map in maps {
            let other = truth
                .iter()
                .find(|other| other.chart.receiver == map.chart.receiver);
            sum.add(map, Some(map), other);
        }
        let is_alone =
            |of: &&IlluminationMap| !maps.iter().any(|map| map.chart.receiver == of.chart.receiver);
        for alone in truth.iter().filter(is_alone) {
            sum.add(alone, None, Some(alone));
        }
        sum
    }

    fn add(&mut self, of: &IlluminationMap, map: Option<&IlluminationMap>, truth: Option<&IlluminationMap>) {
        let square = |colour: LinearSrgb| {
            let channels = colour.to_array();
            channels.iter().map(|channel| channel * channel).sum::<f64>()
        };
        for texel in 0..of.chart.texel_count() {
            let area_m2 = of.chart.texel_area_m2(texel);
            let [image, truth] =
                [map, truth].map(|map| map.map_or(LinearSrgb::BLACK, |map| caustic(map, texel)));
            let (image_y, truth_y) = (image.luminance(), truth.luminance());
            self.colour += area_m2 * square(image - truth);
            self.colour_of_truth += area_m2 * square(truth);
            self.luminance += area_m2 * (image_y - truth_y).powi(2);
            self.luminance_of_truth += area_m2 * truth_y.powi(2);
            self.flux += area_m2 * image_y;
            self.flux_of_truth += area_m2 * truth_y;
        }
    }
}

fn caustic(map: &IlluminationMap, texel: usize) -> LinearSrgb {
    map.layer(LayerKind::Caustic).map_or(LinearSrgb::BLACK, |layer| {
        LinearSrgb::from(layer.irradiance[texel].map(f64::from))
    })
}

/// Of the surface with the brightest texel of the reference, the first of the pictures.
fn strips(scene: &Scene, pictures: &[Vec<IlluminationMap>]) -> Option<Strips> {
    let truth = pictures.first()?;
    let peak = |map: &IlluminationMap| {
        let texels = 0..map.chart.texel_count();
        texels
            .map(|texel| caustic(map, texel).luminance())
            .fold(0.0, f64::max)
    };
    let brightest = truth.iter().max_by(|a, b| peak(a).total_cmp(&peak(b)))?;
    let (receiver, white) = (brightest.chart.receiver, peak(brightest));
    let (columns, rows) = lit_part(brightest, SHOWN * white)?;
    let mut rgba = Vec::new();
    let mut height = 0;
    for maps in pictures {
        let map = maps.iter().find(|map| map.chart.receiver == receiver);
        for row in rows.clone() {
            for column in columns.clone() {
                let colour = map.map_or(LinearSrgb::BLACK, |map| {
                    caustic(map, row * map.chart.width + column)
                });
                let shown = to_display_gamut(colour / white).map(LinearSrgb::encode_channel);
                let pixel = shown.to_array().map(|channel| (channel * 255.0).round() as u8);
                rgba.extend_from_slice(&[pixel[0], pixel[1], pixel[2], 255]);
            }
        }
        // A line between two strips.
        rgba.extend(columns.clone().flat_map(|_| [60, 60, 60, 255]));
        height += rows.len() as u32 + 1;
    }
    Some(Strips {
        surface: scene.objects[receiver.object()].name.clone(),
        width: columns.len() as u32,
        height,
        rgba,
    })
}

type Part = (std::ops::Range<usize>, std::ops::Range<usize>);

/// Columns and rows around all texels that are brighter than a luminance [W/m²].
fn lit_part(map: &IlluminationMap, least: f64) -> Option<Part> {
    let (width, height) = (map.chart.width, map.chart.height);
    let lit = (0..map.chart.texel_count()).filter(|texel| caustic(map, *texel).luminance() > least);
    let places: Vec<(usize, usize)> = lit.map(|texel| (texel % width, texel / width)).collect();
    let range = |of: fn(&(usize, usize)) -> usize, side: usize| {
        let first = places.iter().map(of).min()?;
        let last = places.iter().map(of).max()?;
        Some(first.saturating_sub(MARGIN)..(last + 1 + MARGIN).min(side))
    };
    Some((range(|place| place.0, width)?, range(|place| place.1, height)?))
}
