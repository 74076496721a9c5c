//! The laws of `nephroid::optics`, of lights and of units, tested as laws.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

#[path = "support/bump_scenes.rs"]
#[allow(dead_code)]
mod bump_scenes;
#[path = "physics/colour.rs"]
mod colour;
#[path = "physics/colour_basis.rs"]
mod colour_basis;
#[path = "physics/differentials.rs"]
mod differentials;
#[path = "physics/false_colours.rs"]
mod false_colours;
#[path = "physics/fresnel.rs"]
mod fresnel;
#[path = "physics/glass.rs"]
mod glass;
#[path = "physics/interfaces.rs"]
mod interfaces;
#[path = "physics/lights.rs"]
mod lights;
#[path = "physics/metal_paths.rs"]
mod metal_paths;
#[path = "physics/metals.rs"]
mod metals;
#[path = "physics/microfacets.rs"]
mod microfacets;
#[path = "physics/polish.rs"]
mod polish;
#[path = "physics/refraction.rs"]
mod refraction;
#[path = "physics/spectrum.rs"]
mod spectrum;
#[path = "support/mod.rs"]
mod support;
#[path = "physics/tone_maps.rs"]
mod tone_maps;
#[path = "physics/upsampling.rs"]
mod upsampling;

/// How a law is tried: many cases, the same ones in every run, so that a failure can be looked at.
fn law() -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases: 4096,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        failure_persistence: None,
        ..proptest::test_runner::Config::default()
    }
}
#[path = "physics/waves.rs"]
mod waves;
