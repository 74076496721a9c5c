//! Suns within an image of the sky: small bright spots, which the few rays that leave a rough surface would meet by
//! chance alone.

use std::f64::consts::PI;

use glam::DVec3;

use super::Environment;
use crate::optics::LinearSrgb;

/// Pixels this many times brighter than the mean belong to a sun.
const BRIGHT: f64 = 30.0;
/// Pixels count by at most this many times the mean of all when the mean of the sky without its suns is taken.
const MOST_OF_MEAN: f64 = 4.0;
/// Tangent of the angular radius of a sun, at most, and as which all of them count: 2.3°.
pub const TAN_RADIUS: f64 = 0.04;
/// Most suns of a sky: one with more bright spots has none.
const MOST: usize = 8;

/// The suns of an environment, and what is left of it.
#[derive(Clone, Debug, PartialEq)]
pub struct SkySuns {
    /// Luminance above which a pixel's light is that of a sun [W/(m² sr)]; infinite without suns.
    pub cut: f64,
    pub suns: Vec<SkySun>,
}

/// A small bright spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkySun {
    /// Unit.
    pub to_sun: DVec3,
    /// Normal irradiance by what is above the cut [W/m²].
    pub irradiance: LinearSrgb,
}

impl SkySun {
    fn add(&mut self, direction: DVec3, irradiance: LinearSrgb) {
        let [before, added] = [self.irradiance, irradiance].map(LinearSrgb::luminance);
        self.to_sun = (self.to_sun * before + direction * added).normalize();
        self.irradiance += irradiance;
    }
}

impl SkySuns {
    pub const NONE: Self = Self {
        cut: f64::INFINITY,
        suns: Vec::new(),
    };

    pub(super) fn of(sky: &Environment) -> Self {
        // The mean of the sky hardly depends on its suns.
        let mean = sky.total / (4.0 * PI);
        let mut sum = 0.0;
        for row in 0..sky.height {
            let luminances = (0..sky.width).map(|column| sky.pixel(column, row).luminance());
            let capped: f64 = luminances
                .map(|luminance| luminance.min(MOST_OF_MEAN * mean))
                .sum();
            sum += capped * sky.pixel_solid_angle_sr(row);
        }
        let cut = BRIGHT * sum / (4.0 * PI);

        // Each bright pixel adds to the sun that it lies in.
        let mut suns: Vec<SkySun> = Vec::new();
        for row in 0..sky.height {
            for column in 0..sky.width {
                let pixel = sky.pixel(column, row);
                let luminance = pixel.luminance();
                if luminance <= cut {
                    continue;
                }
                let direction = sky.direction(column, row);
                let irradiance = pixel * ((1.0 - cut / luminance) * sky.pixel_solid_angle_sr(row));
                let is_within = |sun: &SkySun| {
                    sun.to_sun.dot(direction) > 0.0 && sun.to_sun.cross(direction).length() < TAN_RADIUS
                };
                match suns.iter().position(is_within) {
                    Some(known) => suns[known].add(direction, irradiance),
                    None if suns.len() < MOST => suns.push(SkySun {
                        to_sun: direction,
                        irradiance,
                    }),
                    None => return Self::NONE,
                }
            }
        }
        if suns.is_empty() {
            Self::NONE
        } else {
            Self { cut, suns }
        }
    }
}
