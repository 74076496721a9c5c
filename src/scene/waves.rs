//! Superposed waves on a surface: a height h(P, t) = Σ A·cos(K·P + φ − 2πt/T) that bends the normal as a surface of
//! that height would. The surface itself stays where it is, unless the scene [displaces](super::Scene::swells) its
//! vertices too.
//!
//! Waves are a solid texture in the scene's coordinates: K is a vector in space, and each surface takes the part of
//! ∇h along itself. They are smooth over any mesh, need no texture coordinates, and go on across its triangles. An
//! object that is moved moves through them.

use std::f64::consts::TAU;

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Most waves of one material.
pub const MAX_WAVES: usize = 8;

/// Largest sum of the waves' slopes A·2π/λ [1]: steeper normals would send much of the light through the surface that
/// is not bent.
pub const STEEPEST_SLOPE: f64 = 1.0;

/// Acceleration of gravity [m/s²].
const GRAVITY_M_PER_S2: f64 = 9.80665;

/// One wave.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// A, half of the height between trough and crest [m]; ≥ 0.
    pub amplitude_m: f64,
    /// λ [m]; > 0.
    pub wavelength_m: f64,
    /// Where the phase grows, unit, in scene coordinates.
    pub direction: DVec3,
    /// φ [rad].
    pub phase_rad: f64,
    /// T [s]: crests move along the direction by one wavelength in this time; 0 where they stand still.
    #[serde(default)]
    pub period_s: f64,
}

impl Wave {
    /// A wave of height A·cos(kx·x + kz·z + φ) [m] that gravity moves over water of so many metres.
    pub fn on_water(amplitude_m: f64, [kx, kz]: [f64; 2], phase_rad: f64, depth_m: f64) -> Self {
        let vector = DVec3::new(kx, 0.0, kz);
        let wavelength_m = TAU / vector.length();
        Self {
            amplitude_m,
            wavelength_m,
            direction: vector.normalize(),
            phase_rad,
            period_s: gravity_period_s(wavelength_m, depth_m),
        }
    }

    /// K = 2π/λ along the direction [rad/m].
    pub fn wave_vector(&self) -> DVec3 {
        self.direction * self.wave_number()
    }

    /// 2π/λ [rad/m].
    pub fn wave_number(&self) -> f64 {
        TAU / self.wavelength_m
    }

    /// Steepest slope A·2π/λ [1].
    pub fn slope(&self) -> f64 {
        self.amplitude_m * self.wave_number()
    }

    fn is_valid(&self) -> bool {
        let is_unit = (self.direction.length_squared() - 1.0).abs() < 1e-9;
        self.amplitude_m >= 0.0
            && self.amplitude_m.is_finite()
            && self.wavelength_m > 0.0
            && self.wave_number().is_finite()
            && self.phase_rad.is_finite()
            && self.period_s >= 0.0
            && self.period_s.is_finite()
            && is_unit
    }
}

/// The waves of a material: one at least, all of them valid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Wave>", into = "Vec<Wave>")]
pub struct Waves {
    waves: Vec<Wave>,
}

impl TryFrom<Vec<Wave>> for Waves {
    type Error = String;

    fn try_from(waves: Vec<Wave>) -> Result<Self, String> {
        Self::new(waves)
    }
}

impl From<Waves> for Vec<Wave> {
    fn from(waves: Waves) -> Self {
        waves.waves
    }
}

impl Waves {
    /// These waves.
    ///
    /// # Errors
    /// What is wrong with them, to go after the name of what has them: none or too many, a number outside its range,
    /// slopes that add up to more than [`STEEPEST_SLOPE`].
    pub fn new(waves: Vec<Wave>) -> Result<Self, String> {
        if waves.is_empty() || waves.len() > MAX_WAVES {
            return Err(format!("{} waves are not 1 to {MAX_WAVES}", waves.len()));
        }
        if let Some(bad) = waves.iter().position(|wave| !wave.is_valid()) {
            return Err(format!(
                "wave {bad} has a number that is not finite or not in its range"
            ));
        }
        let slope: f64 = waves.iter().map(Wave::slope).sum();
        if slope > STEEPEST_SLOPE {
            return Err(format!(
                "waves of an overall slope of {slope:.3} are steeper than {STEEPEST_SLOPE}"
            ));
        }
        Ok(Self { waves })
    }

    /// Each of them.
    pub fn list(&self) -> &[Wave] {
        &self.waves
    }

    /// The shortest wavelength [m] among those that bend anything; infinite where none does.
    pub fn shortest_m(&self) -> f64 {
        let bending = self.waves.iter().filter(|wave| wave.amplitude_m > 0.0);
        bending
            .map(|wave| wave.wavelength_m)
            .fold(f64::INFINITY, f64::min)
    }

    /// h [m] at a point.
    pub fn height_m(&self, point: DVec3) -> f64 {
        let height = |wave: &Wave| wave.amplitude_m * wave_phase(wave, point).cos();
        self.waves.iter().map(height).sum()
    }

    /// ∇h [1] in space, at a point.
    pub fn gradient(&self, point: DVec3) -> DVec3 {
        let slope = |wave: &Wave| wave.wave_vector() * (-wave.amplitude_m * wave_phase(wave, point).sin());
        self.waves.iter().map(slope).sum()
    }

    /// The change of ∇h [1] for a small step [m] from a point: the Hessian of h, applied to the step.
    pub fn gradient_change(&self, point: DVec3, step: DVec3) -> DVec3 {
        let change = |wave: &Wave| {
            let vector = wave.wave_vector();
            vector * (-wave.amplitude_m * wave_phase(wave, point).cos() * vector.dot(step))
        };
        self.waves.iter().map(change).sum()
    }

    /// Whether any of them moves.
    pub fn is_moving(&self) -> bool {
        self.waves
            .iter()
            .any(|wave| wave.period_s > 0.0 && wave.amplitude_m > 0.0)
    }

    /// The waves after so much time [s], as if they had begun there.
    #[must_use]
    pub fn after(&self, time_s: f64) -> Self {
        let mut moved = self.clone();
        for wave in moved.waves.iter_mut().filter(|wave| wave.period_s > 0.0) {
            wave.phase_rad -= TAU * (time_s / wave.period_s).fract();
        }
        moved
    }

    /// The waves with periods that fit so much time [s] a whole number of times, at least once each.
    #[must_use]
    pub fn looped(&self, duration_s: f64) -> Self {
        let mut fitted = self.clone();
        for wave in fitted.waves.iter_mut().filter(|wave| wave.period_s > 0.0) {
            wave.period_s = duration_s / (duration_s / wave.period_s).round().max(1.0);
        }
        fitted
    }

    /// The same waves for coordinates whose origin was moved to `origin` [m].
    #[must_use]
    pub fn with_origin(&self, origin: DVec3) -> Self {
        let mut moved = self.clone();
        for wave in &mut moved.waves {
            wave.phase_rad = wave_phase(wave, origin).rem_euclid(TAU);
        }
        moved
    }
}

/// K·P + φ [rad].
fn wave_phase(wave: &Wave, point: DVec3) -> f64 {
    wave.wave_vector().dot(point) + wave.phase_rad
}

/// Period [s] of waves under gravity, ω² = g·k·tanh(k·h) (Lamb, *Hydrodynamics*, art. 228), over water of the depth h [m].
pub fn gravity_period_s(wavelength_m: f64, depth_m: f64) -> f64 {
    let wave_number = TAU / wavelength_m;
    TAU / (GRAVITY_M_PER_S2 * wave_number * (wave_number * depth_m).tanh()).sqrt()
}
