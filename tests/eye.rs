//! Maps on surfaces, the direct layer and the CPU eye pass, on scenes whose answer is known.

#[path = "eye/chains.rs"]
mod chains;
#[path = "eye/charts.rs"]
mod charts;
#[path = "eye/direct.rs"]
mod direct;
#[path = "eye/dispersion.rs"]
mod dispersion;
#[path = "eye/meshes.rs"]
mod meshes;
#[path = "eye/pictures.rs"]
mod pictures;
#[path = "eye/scenes.rs"]
mod scenes;
#[path = "eye/soft_light.rs"]
mod soft_light;
#[path = "eye/texel_areas.rs"]
mod texel_areas;
#[path = "eye/white_balance.rs"]
mod white_balance;

/// How a law is tried: many cases, the same ones in every run, so that a failure can be looked at.
fn law() -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases: 2048,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        ..proptest::test_runner::Config::default()
    }
}
