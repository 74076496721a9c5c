//! Maps on surfaces, the direct layer and the CPU eye pass, on scenes whose answer is known.

mod charts;
mod direct;
mod display;
mod pictures;
mod texel_areas;
mod white_balance;

use nephroid::light_pass::direct::bake_direct;
use nephroid::progress::Control;
use nephroid::scene::{Light, Material, Mesh};

use support::scenes::{chart, tracer};

/// Runs on so many threads.
fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.expect("a pool of threads").install(work)
}

/// Irradiance and shadow rays of the first two objects.
fn baked_on(threads: usize, parts: &[(Mesh, Material)], lamps: &[Light]) -> Vec<(Vec<[f32; 3]>, u64)> {
    let tracer = tracer(parts.to_vec(), lamps.to_vec());
    let charts = [chart(&tracer, 0, 50, 50), chart(&tracer, 1, 64, 64)];
    let charts: Vec<_> = charts.iter().collect();
    let bake = || bake_direct(&tracer, lamps, &charts, &(), &Control::default());
    let layers = on_threads(threads, bake).into_iter();
    layers
        .map(|layer| (layer.irradiance, layer.shadow_rays))
        .collect()
}
