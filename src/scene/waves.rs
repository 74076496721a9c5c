//! Superposed waves on a surface: a height h(P, t) = Σ A·cos(K·P + φ − 2πt/T) that bends the normal as a surface of
//! that height would. The surface itself stays where it is, unless the scene [displaces](super::Scene::swells) its
//! vertices too.
//!
//! Waves are a solid texture in the scene's coordinates: K is a vector in space, and each surface takes the component
//! of ∇h along itself. They are smooth on any mesh, need no texture coordinates, and continue across triangles. An
//! object that is moved moves through them.

use std::f64::consts::TAU;

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Largest number of waves of one material.
pub const MAX_WAVES: usize = 8;

/// Largest sum of the waves' slopes A·2π/λ [1]: steeper normals would deflect much of the light to the wrong side of
/// the unperturbed surface.
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
    /// Direction of increasing phase, unit, in scene coordinates.
    pub direction: DVec3,
    /// φ [rad].
    pub phase_rad: f64,
    /// T [s]: crests move along the direction by one wavelength in this time; 0 if they stand still.
    #[serde(default)]
    pub period_s: f64,
}

impl Wave {
    /// A gravity wave of height A·cos(kx·x + kz·z + φ) [m] on water of the given depth [m].
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

/// Waves of a material: at least one, all of them valid.
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
    /// Checks the waves.
    ///
    /// # Errors
    /// A message that continues the name of the owner: no waves or too many, a number out of range, slopes that add up
    /// to more than [`STEEPEST_SLOPE`].
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

    /// All waves.
    pub fn list(&self) -> &[Wave] {
        &self.waves
    }

    /// Height h [m] at a point.
    pub fn height_m(&self, point: DVec3) -> f64 {
        let height = |wave: &Wave| wave.amplitude_m * wave_phase(wave, point).cos();
        self.waves.iter().map(height).sum()
    }

    /// ∇h [1] in space at a point.
    pub fn gradient(&self, point: DVec3) -> DVec3 {
        let slope = |wave: &Wave| wave.wave_vector() * (-wave.amplitude_m * wave_phase(wave, point).sin());
        self.waves.iter().map(slope).sum()
    }

    /// Δh [1/m] within the tangent plane of a unit normal.
    pub fn laplacian(&self, point: DVec3, normal: DVec3) -> f64 {
        let bend = |wave: &Wave| {
            let along = wave.wave_vector().reject_from_normalized(normal);
            -along.length_squared() * wave.amplitude_m * wave_phase(wave, point).cos()
        };
        self.waves.iter().map(bend).sum()
    }

    /// Whether any wave moves.
    pub fn is_moving(&self) -> bool {
        self.waves
            .iter()
            .any(|wave| wave.period_s > 0.0 && wave.amplitude_m > 0.0)
    }

    /// The waves with their phases advanced by a time [s].
    #[must_use]
    pub fn after(&self, time_s: f64) -> Self {
        let mut moved = self.clone();
        for wave in moved.waves.iter_mut().filter(|wave| wave.period_s > 0.0) {
            wave.phase_rad -= TAU * (time_s / wave.period_s).fract();
        }
        moved
    }

    /// The waves with periods adjusted so that a whole number of each, at least one, fits a duration [s].
    #[must_use]
    pub fn looped(&self, duration_s: f64) -> Self {
        let mut fitted = self.clone();
        for wave in fitted.waves.iter_mut().filter(|wave| wave.period_s > 0.0) {
            wave.period_s = duration_s / (duration_s / wave.period_s).round().max(1.0);
        }
        fitted
    }

    /// The waves in coordinates whose origin is at `origin` [m].
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

/// Period [s] of gravity waves, ω² = g·k·tanh(k·h) (Lamb, *Hydrodynamics*, art. 228), on water of depth h [m].
pub fn gravity_period_s(wavelength_m: f64, depth_m: f64) -> f64 {
    let wave_number = TAU / wavelength_m;
    TAU / (GRAVITY_M_PER_S2 * wave_number * (wave_number * depth_m).tanh()).sqrt()
}
