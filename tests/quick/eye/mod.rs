//! Maps on surfaces, the direct layer and the CPU eye pass, on scenes whose answer is known.

mod charts;
mod direct;
mod display;
mod highlights;
mod pictures;

fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.expect("a pool of threads").install(work)
}
