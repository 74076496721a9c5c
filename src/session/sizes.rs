//! How large each surface's map is.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::error::{Error, Result};
use crate::illumination::Chart;
use crate::illumination::parametrisation::{DEFAULT_NOMINAL_SIDE, Parametrisation, parametrise};
use crate::light_pass::caustic::statistics::FootprintStatistics;
use crate::scene::Scene;
use crate::settings::{BakeSettings, MapResolution};

/// Side of a map before the first doubling [texels].
pub const FIRST_SIDE: usize = 64;

/// Largest side that doubling leads to by itself [texels]; larger maps have to be asked for.
const LARGEST_AUTOMATIC_SIDE: usize = 2048;

/// Memory per texel while flux is summed and finished [bytes]: three 64-bit sums, three floats per layer, an area.
pub const BYTES_PER_TEXEL: u64 = 24 + 2 * 12 + 8;

/// Parametrisations of a scene's surfaces, made on first use.
#[derive(Debug)]
pub struct MapSizes {
    scene: Arc<Scene>,
    parametrisations: Vec<OnceLock<Option<Parametrisation>>>,
    /// Charts made so far, by object and size.
    charts: Mutex<BTreeMap<ChartKey, Arc<Chart>>>,
}

/// Object, texels across and down.
type ChartKey = (usize, (usize, usize));

/// Charts that are kept; beyond it, all are made anew.
const MOST_CHARTS: usize = 256;

impl MapSizes {
    /// Nothing made yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        let parametrisations = scene.objects.iter().map(|_| OnceLock::new()).collect();
        Self {
            scene,
            parametrisations,
            charts: Mutex::default(),
        }
    }

    /// For an edited copy of the scene: what belongs to shapes that stay is kept.
    pub fn edited(self, scene: Arc<Scene>, changed: &[usize]) -> Self {
        let mut sizes = Self { scene, ..self };
        for &object in changed {
            sizes.parametrisations[object] = OnceLock::new();
        }
        let charts = sizes.charts.get_mut().unwrap_or_else(PoisonError::into_inner);
        charts.retain(|(object, _), _| !changed.contains(object));
        sizes
    }

    /// The parametrisation of an object; `None` where it has no area.
    pub fn parametrisation(&self, object: usize) -> Option<&Parametrisation> {
        self.parametrisations[object]
            .get_or_init(|| {
                let mesh = &self.scene.objects[object].mesh;
                parametrise(object, mesh, DEFAULT_NOMINAL_SIDE)
            })
            .as_ref()
    }

    /// A chart of the given size.
    pub fn chart(&self, object: usize, (width, height): (usize, usize)) -> Option<Arc<Chart>> {
        let key = (object, (width, height));
        // Whatever panicked under the lock, the charts in the map are whole.
        let charts = || self.charts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(chart) = charts().get(&key) {
            return Some(Arc::clone(chart));
        }
        let chart = Arc::new(self.parametrisation(object)?.chart(width, height));
        let mut charts = charts();
        if charts.len() >= MOST_CHARTS {
            charts.clear();
        }
        charts.insert(key, Arc::clone(&chart));
        Some(chart)
    }

    /// How often the map of an object doubles from its first size until texels are no larger than the mean footprint
    /// (section 3.1.1 of the paper). `None` where no footprint was seen.
    pub fn doublings(&self, object: usize, statistics: &FootprintStatistics) -> Option<u32> {
        let share = statistics.mean(object)?.map_share;
        let (width, height) = first_size(self.parametrisation(object)?.suggested_aspect);
        let coarse = |times: u32| ((width * height) << (2 * times)) as f64 * share < 1.0;
        let small = |times: u32| width.max(height) << times < LARGEST_AUTOMATIC_SIDE;
        (0..).find(|&times| !(coarse(times) && small(times)))
    }

    /// The size of an object's map after so many doublings.
    pub fn doubled_size(&self, object: usize, times: u32) -> Option<(usize, usize)> {
        let (width, height) = first_size(self.parametrisation(object)?.suggested_aspect);
        Some((width << times, height << times))
    }

    /// The size of a map that holds direct light only: texels of a 400th of the scene's diagonal, or what is asked.
    pub fn direct_size(&self, object: usize, settings: &BakeSettings) -> Option<(usize, usize)> {
        if let MapResolution::Fixed { width, height } = settings.map_resolution {
            return Some((width, height));
        }
        let parametrisation = self.parametrisation(object)?;
        let (low, high) = self.scene.bounds()?;
        let texel_m = (high - low).length() / 400.0;
        let texels = parametrisation.area_m2() / (texel_m * texel_m);
        let side = |wanted: f64| (wanted.max(8.0).log2().round().exp2() as usize).min(1024);
        let aspect = parametrisation.suggested_aspect;
        Some((side((texels * aspect).sqrt()), side((texels / aspect).sqrt())))
    }
}

/// A map of about FIRST_SIDE² texels whose sides have a power of two between them, at most 8:1.
pub fn first_size(aspect: f64) -> (usize, usize) {
    let steps = aspect.log2().round().clamp(-3.0, 3.0) as i32;
    let stretch = |steps: i32| FIRST_SIDE << steps.max(0);
    (stretch(steps), stretch(-steps))
}

/// Refuses maps that do not fit.
///
/// # Errors
/// Names the need and the limit.
pub fn check_memory(texels: u64, settings: &BakeSettings) -> Result<()> {
    let need = texels.saturating_mul(BYTES_PER_TEXEL);
    if need <= settings.memory_bytes {
        return Ok(());
    }
    let mebibytes = |bytes: u64| bytes.div_ceil(1 << 20);
    Err(Error::failure(
        "--memory",
        format!(
            "the maps need {} MiB, the limit is {} MiB",
            mebibytes(need),
            mebibytes(settings.memory_bytes)
        ),
        "ask for a smaller --map-resolution or allow more --memory",
    ))
}
