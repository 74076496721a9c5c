//! Numbers for tests that try many cases.

use glam::DVec3;

/// Evenly spread numbers that are the same in every run (SplitMix64).
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In [0, 1).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn index(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }

    pub fn direction(&mut self) -> DVec3 {
        let y = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (std::f64::consts::TAU * self.next()).sin_cos();
        DVec3::new(cosine, 0.0, sine) * (1.0 - y * y).sqrt() + DVec3::Y * y
    }

    /// Within a ball.
    pub fn place(&mut self, centre: DVec3, radius: f64) -> DVec3 {
        centre + self.direction() * (radius * self.next().cbrt())
    }
}
