//! A clear sky and the ground below it, for scenes without light. Their sun is a light of its own.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::Environment;
use crate::optics::LinearSrgb;

/// Width and height in pixels.
const SIZE: [usize; 2] = [128, 64];

/// Colours at the zenith and at the horizon.
const ABOVE: LinearSrgb = LinearSrgb::new(0.35, 0.6, 1.0);
const HORIZON: LinearSrgb = LinearSrgb::new(0.85, 0.95, 1.0);

/// Albedo of the ground.
const ALBEDO: f64 = 0.2;

/// A clear sky that gives level ground an irradiance of `sky_w_per_m2`, above ground that is also lit by a sun of
/// normal irradiance `sun_w_per_m2`. The sun itself is not included.
pub fn clear_sky(to_sun: DVec3, sun_w_per_m2: f64, sky_w_per_m2: f64) -> Option<Environment> {
    let [width, height] = SIZE;
    let place = |pixel: usize| {
        let polar = ((pixel / width) as f64 + 0.5) / height as f64 * PI;
        let azimuth = ((pixel % width) as f64 + 0.5) / width as f64 * TAU;
        let sine = polar.sin();
        DVec3::new(sine * azimuth.sin(), polar.cos(), -sine * azimuth.cos())
    };
    let above: Vec<LinearSrgb> = (0..width * height / 2)
        .map(|pixel| radiance(place(pixel), to_sun))
        .collect();
    let pixel_sr = TAU / width as f64 * PI / height as f64;
    let received = above.iter().enumerate().map(|(pixel, radiance)| {
        let cosine = place(pixel).y;
        radiance.luminance() * cosine * (1.0 - cosine * cosine).sqrt() * pixel_sr
    });
    let scale = sky_w_per_m2 / received.sum::<f64>();
    let ground = ALBEDO * FRAC_1_PI * (sun_w_per_m2 * to_sun.y.max(0.0) + sky_w_per_m2);
    let pixels = above.into_iter().map(|radiance| radiance * scale);
    let below = std::iter::repeat_n(LinearSrgb::grey(ground), width * height / 2);
    let radiance = pixels
        .chain(below)
        .map(|radiance| radiance.to_array().map(|channel| channel as f32));
    Environment::new(width, height, radiance.collect())
}

/// Relative radiance of a direction above the horizon: standard clear sky of low turbidity (CIE S 011, type 12).
fn radiance(direction: DVec3, to_sun: DVec3) -> LinearSrgb {
    let gradation = |height: f64| 1.0 - (-0.32 / height).exp();
    let angle = direction.angle_between(to_sun);
    let indicatrix =
        1.0 + 10.0 * ((-3.0 * angle).exp() - (-3.0 * FRAC_PI_2).exp()) + 0.45 * angle.cos().powi(2);
    let (lowest, here) = (gradation(1.0), gradation(direction.y));
    let haze = (here - lowest) / (1.0 - lowest);
    let colour = ABOVE * (1.0 - haze) + HORIZON * haze;
    colour * (here * indicatrix / colour.luminance())
}
