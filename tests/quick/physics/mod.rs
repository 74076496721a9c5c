//! The laws of optics, of lights and of units, tested as laws.

mod colour;
mod fresnel;
mod glass;
mod metal_paths;
mod metals;
mod refraction;
mod spectrum;
mod surfaces;
mod tone_maps;
mod upsampling;
mod waves;

use crate::prelude::*;

fn visible() -> impl Iterator<Item = Nanometres> {
    (360..=830).map(|nm| Nanometres(f64::from(nm)))
}

fn primaries() -> [LinearSrgb; 3] {
    [rgb(1.0, 0.0, 0.0), rgb(0.0, 1.0, 0.0), rgb(0.0, 0.0, 1.0)]
}
