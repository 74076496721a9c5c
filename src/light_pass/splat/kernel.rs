//! Shapes of a splat, and their integrals along a row of texels.
//!
//! In the frame in which the footprint is the unit disc, a point of a row has the coordinates (s, t): t is fixed along
//! the row, s runs along it. Each shape says how far it reaches in t, which chord |s| ≤ S(t) it covers, and the integral
//! of its weight along the chord from 0 to s.

use std::sync::LazyLock;

use super::numeric::{exp, round};
use crate::settings::Kernel;

/// A kernel with its spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    kernel: Kernel,
    /// √σ of a Gaussian [footprint radii].
    spread: f64,
}

/// √(π/2), the limit of the half normal integral.
pub(super) const SQRT_HALF_PI: f64 = 1.253_314_137_315_500_3;

/// Spreads at which the Gaussian is truncated.
const CUT_SPREADS: f64 = 4.0;

/// Half side of the box with the unit disc's area.
const BOX_HALF_SIDE: f64 = 0.886_226_925_452_758;

impl Profile {
    /// `sigma` > 0 is the Gaussian's σ of eq. 4.4, exp(−r²/2σ), r in footprint radii.
    pub fn new(kernel: Kernel, sigma: f64) -> Self {
        Self {
            kernel,
            spread: sigma.sqrt(),
        }
    }

    /// Largest |t| [footprint radii].
    pub fn reach(&self) -> f64 {
        match self.kernel {
            Kernel::Gaussian => CUT_SPREADS * self.spread,
            Kernel::Cone => 3.0_f64.sqrt(),
            Kernel::Disc => 1.0,
            Kernel::Box => BOX_HALF_SIDE,
        }
    }

    /// Half chord S at t [footprint radii].
    pub fn half_chord(&self, t: f64) -> f64 {
        match self.kernel {
            Kernel::Box => BOX_HALF_SIDE,
            Kernel::Gaussian | Kernel::Cone | Kernel::Disc => {
                let reach = self.reach();
                (reach * reach - t * t).max(0.0).sqrt()
            }
        }
    }

    /// ∫ w ds from 0 to `s` at `t`, unnormalised; odd in s. `s` must be within the chord.
    pub fn chord_integral(&self, s: f64, t: f64) -> f64 {
        self.line(t).integral(s)
    }

    /// What is constant along the line at `t`.
    pub(super) fn line(&self, t: f64) -> Line {
        match self.kernel {
            Kernel::Disc | Kernel::Box => Line::Constant,
            Kernel::Cone => Line::Cone { t },
            Kernel::Gaussian => {
                let scale = 1.0 / self.spread;
                let u = t * scale;
                Line::Gaussian {
                    scale,
                    factor: self.spread * exp(-0.5 * u * u),
                }
            }
        }
    }

    /// Weight at a point [footprint radii], unnormalised.
    pub fn weight(&self, s: f64, t: f64) -> f64 {
        let r2 = s * s + t * t;
        match self.kernel {
            Kernel::Gaussian => {
                let inside = r2 <= (CUT_SPREADS * self.spread).powi(2);
                if inside {
                    (-0.5 * r2 / (self.spread * self.spread)).exp()
                } else {
                    0.0
                }
            }
            Kernel::Cone => (1.0 - (r2 / 3.0).sqrt()).max(0.0),
            Kernel::Disc => f64::from(u8::from(r2 <= 1.0)),
            Kernel::Box => f64::from(u8::from(s.abs() <= BOX_HALF_SIDE && t.abs() <= BOX_HALF_SIDE)),
        }
    }

    /// Standard deviation of a Gaussian [footprint radii]; `None` for other kernels.
    pub fn deviation(&self) -> Option<f64> {
        (self.kernel == Kernel::Gaussian).then_some(self.spread)
    }

    /// Length scale over which the weight changes [footprint radii].
    pub fn scale(&self) -> f64 {
        match self.kernel {
            Kernel::Gaussian => self.spread,
            Kernel::Cone | Kernel::Disc | Kernel::Box => 0.5,
        }
    }
}

/// A kernel along a line.
#[derive(Clone, Copy, Debug)]
pub(super) enum Line {
    Constant,
    Cone { t: f64 },
    Gaussian { scale: f64, factor: f64 },
}

impl Line {
    /// ∫ w ds from 0 to `s`.
    pub(super) fn integral(&self, s: f64) -> f64 {
        match *self {
            Self::Constant => s,
            Self::Cone { t } => {
                let r = (s * s + t * t).sqrt();
                let square_part = if t == 0.0 {
                    0.0
                } else {
                    t * t * (s / t.abs()).asinh()
                };
                s - (s * r + square_part) / (2.0 * 3.0_f64.sqrt())
            }
            Self::Gaussian { scale, factor } => factor * half_normal_integral(s * scale),
        }
    }
}

/// Steps of the table on each side of zero.
const TABLE_STEPS: usize = 512;

/// ∫₀ˣ exp(−x²/2) dx and exp(−x²/2) at equal steps of [−4, 4]; by Simpson's rule on 16 parts per step.
static HALF_NORMAL: LazyLock<Box<[[f64; 2]; 2 * TABLE_STEPS + 1]>> = LazyLock::new(|| {
    let density = |x: f64| (-0.5 * x * x).exp();
    let step = CUT_SPREADS / TABLE_STEPS as f64;
    let mut sum = 0.0;
    let mut table = Box::new([[0.0, 1.0]; 2 * TABLE_STEPS + 1]);
    for index in 0..TABLE_STEPS {
        let parts = 16;
        let h = step / parts as f64;
        for part in 0..parts {
            let x = index as f64 * step + part as f64 * h;
            sum += h / 6.0 * (density(x) + 4.0 * density(x + 0.5 * h) + density(x + h));
        }
        let here = density((index + 1) as f64 * step);
        table[TABLE_STEPS + index + 1] = [sum, here];
        table[TABLE_STEPS - index - 1] = [-sum, here];
    }
    table
});

/// ∫₀ˣ exp(−x²/2) dx for |x| ≤ 4, odd; beyond, the value at ±4. Taylor series to third order about the nearest step:
/// within 1e-10.
pub(super) fn half_normal_integral(x: f64) -> f64 {
    const STEPS_PER_SPREAD: f64 = TABLE_STEPS as f64 / CUT_SPREADS;
    let x = x.clamp(-CUT_SPREADS, CUT_SPREADS);
    let (nearest, index) = round(x * STEPS_PER_SPREAD);
    let place = nearest * (1.0 / STEPS_PER_SPREAD);
    let d = x - place;
    let [value, density] = HALF_NORMAL[((index + TABLE_STEPS as i64) as usize).min(2 * TABLE_STEPS)];
    let curve = 1.0 - 0.5 * d * place + d * d * (place * place - 1.0) * (1.0 / 6.0);
    value + density * d * curve
}

/// Standard normal distribution function, truncated to |x| ≤ 4 and normalised.
pub(super) fn normal_distribution(x: f64) -> f64 {
    /// Half normal integral at 4.
    const WHOLE: f64 = 1.253_234_749_285_228_5;
    0.5 + half_normal_integral(x) * (0.5 / WHOLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint sums of the weight over a fine grid.
    fn volume_by_grid(profile: &Profile) -> f64 {
        let reach = profile.reach() * 1.01;
        let n = 2000;
        let h = 2.0 * reach / n as f64;
        let at = |index: usize| -reach + (index as f64 + 0.5) * h;
        (0..n)
            .map(|j| (0..n).map(|i| profile.weight(at(i), at(j))).sum::<f64>())
            .sum::<f64>()
            * h
            * h
    }

    #[test]
    fn kernels_of_equal_footprint_have_their_stated_volumes() {
        let pi = std::f64::consts::PI;
        // A cone of base radius √3 and height 1 has the volume of the unit disc: πr²/3.
        for (kernel, volume) in [(Kernel::Disc, pi), (Kernel::Box, pi), (Kernel::Cone, pi)] {
            let found = volume_by_grid(&Profile::new(kernel, 1.0));
            assert!(
                (found / volume - 1.0).abs() < 2e-3,
                "{kernel:?}: {found} against {volume}"
            );
        }
        for sigma in [0.5, 1.0, 2.0] {
            let found = volume_by_grid(&Profile::new(Kernel::Gaussian, sigma));
            let volume = 2.0 * pi * sigma * (1.0 - (-8.0_f64).exp());
            assert!(
                (found / volume - 1.0).abs() < 1e-4,
                "sigma {sigma}: {found} against {volume}"
            );
        }
    }

    #[test]
    fn chord_integrals_are_the_integrals_of_the_weights() {
        for kernel in [Kernel::Gaussian, Kernel::Cone, Kernel::Disc, Kernel::Box] {
            let profile = Profile::new(kernel, 0.7);
            for t in [0.0, 0.3, -0.8] {
                let end = 0.9 * profile.half_chord(t);
                let n = 20_000;
                let h = end / f64::from(n);
                let sum: f64 = (0..n)
                    .map(|i| profile.weight((f64::from(i) + 0.5) * h, t) * h)
                    .sum();
                let integral = profile.chord_integral(end, t);
                assert!(
                    (sum - integral).abs() < 1e-7,
                    "{kernel:?} at t = {t}: {sum} against {integral}"
                );
                assert_eq!(
                    profile.chord_integral(-end, t),
                    -integral,
                    "{kernel:?} is not odd"
                );
            }
        }
    }
}
