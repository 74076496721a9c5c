//! The light in the middle of a scene, whatever stands around it.

use glam::{DVec2, DVec3};

use super::Scene;
use super::emitter::{Emitter, EmitterKind};
use crate::optics::LinearSrgb;

/// Directions along a side of the square over which an environment is summed up.
const ENVIRONMENT_SIDE: u32 = 16;

impl Scene {
    /// What all lamps send to the middle of the scene from all around [W/m²], without shadows: for its colour. A lamp
    /// close to the middle counts as if it stood at the scene's border.
    pub fn light_at_middle(&self) -> LinearSrgb {
        let (low, high) = self.bounds().unwrap_or_default();
        let (middle, radius_m) = (0.5 * (low + high), 0.5 * (high - low).length());
        let of_lamp = |light: &super::Light| match Emitter::middle(light, self) {
            Some(emitter) => emitter.strength * received_per_m2(&emitter.kind, middle, radius_m),
            None => self.light_from_around(),
        };
        let lamps = self.lights.iter().map(of_lamp);
        lamps.fold(LinearSrgb::BLACK, |sum, light| sum + light)
    }

    /// The same of its environment.
    fn light_from_around(&self) -> LinearSrgb {
        let Some((environment, strength)) = self.sky() else {
            return LinearSrgb::BLACK;
        };
        let place = |index: u32| (f64::from(index) + 0.5) / f64::from(ENVIRONMENT_SIDE);
        let count = ENVIRONMENT_SIDE * ENVIRONMENT_SIDE;
        let squares = (0..count)
            .map(|index| DVec2::new(place(index % ENVIRONMENT_SIDE), place(index / ENVIRONMENT_SIDE)));
        let sum = squares.fold(LinearSrgb::BLACK, |sum, square| {
            sum + environment.smooth_radiance(direction_of(square))
        });
        strength * sum * (4.0 * std::f64::consts::PI / f64::from(count))
    }
}

/// The unit direction of a place of the unit square, of which equal areas are equal solid angles.
fn direction_of(square: DVec2) -> DVec3 {
    let (sine, cosine) = (std::f64::consts::TAU * square.x).sin_cos();
    let height = 1.0 - 2.0 * square.y;
    let around = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(around * cosine, height, around * sine)
}

/// What a lamp of unit strength sends to a place [1/m²], or 1 of parallel light; where it shines, whichever way that is.
fn received_per_m2(kind: &EmitterKind, middle: DVec3, radius_m: f64) -> f64 {
    match *kind {
        EmitterKind::Parallel { .. } => 1.0,
        EmitterKind::Point { position }
        | EmitterKind::Spot { position, .. }
        | EmitterKind::Facet { position, .. } => {
            let distance_m = position.distance(middle).max(radius_m);
            if distance_m > 0.0 {
                distance_m.powi(-2)
            } else {
                1.0
            }
        }
    }
}
