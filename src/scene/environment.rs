//! Environment light: an equirectangular image of radiance.

mod clear_sky;
mod file;
pub mod suns;

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::optics::LinearSrgb;

pub use clear_sky::clear_sky;
pub use file::read;
pub use suns::SkySuns;

/// Radiance from infinity as an equirectangular image. Column 0 begins at −z and columns advance towards +x, so that
/// the image centre is +z; row 0 is at +y, up.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    width: usize,
    height: usize,
    /// [W/(m² sr)], row by row; finite and non-negative.
    radiance: Vec<[f32; 3]>,
    /// Normalised cumulative distribution over rows of luminance × solid angle.
    rows: Vec<f64>,
    /// Normalised cumulative distribution of luminance within each row.
    columns: Vec<f64>,
    /// ∫ L dω of the luminance [W/m²].
    total: f64,
    smooth: SmoothIrradiance,
    suns: SkySuns,
}

/// Irradiance of an unoccluded surface as a linear function of its normal: the first two bands of spherical harmonics
/// (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SmoothIrradiance {
    /// Mean over all normals [W/m²].
    pub mean: LinearSrgb,
    /// Change with each component of the normal [W/m²].
    pub by_normal: [LinearSrgb; 3],
}

impl SmoothIrradiance {
    /// E of a surface with a unit normal [W/m²].
    pub fn at(&self, normal: DVec3) -> LinearSrgb {
        let [x, y, z] = self.by_normal;
        (self.mean + x * normal.x + y * normal.y + z * normal.z).map(|channel| channel.max(0.0))
    }
}

/// A direction sampled from an environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit vector towards the light.
    pub to_light: DVec3,
    /// Radiance divided by the pdf [W/m²]: normal irradiance as if the whole environment shone from this direction.
    pub irradiance: LinearSrgb,
}

impl Environment {
    /// An image of `width` × `height` pixels of radiance [W/(m² sr)]; `None` if there are no pixels, their number does
    /// not match, or a value is negative or not finite.
    pub fn new(width: usize, height: usize, radiance: Vec<[f32; 3]>) -> Option<Self> {
        // Importance sampling needs a density, which negative or infinite radiance has not.
        let is_light = |pixel: &[f32; 3]| pixel.iter().all(|channel| channel.is_finite() && *channel >= 0.0);
        if width == 0 || height == 0 || radiance.len() != width * height || !radiance.iter().all(is_light) {
            return None;
        }
        let mut environment = Self {
            width,
            height,
            radiance,
            rows: Vec::with_capacity(height),
            columns: Vec::with_capacity(width * height),
            total: 0.0,
            smooth: SmoothIrradiance::default(),
            suns: SkySuns::NONE,
        };

        // Directions of columns are the same in all rows.
        let azimuth = |column: usize| ((column as f64 + 0.5) / width as f64 * TAU).sin_cos();
        let azimuths: Vec<(f64, f64)> = (0..width).map(azimuth).collect();

        // One pass gives the marginal distribution of rows, that of the columns in each, and the irradiance.
        for row in 0..height {
            let solid_angle_sr = environment.pixel_solid_angle_sr(row);
            let mut sum = 0.0;
            let start = environment.columns.len();
            let (sine, cosine) = ((row as f64 + 0.5) / height as f64 * PI).sin_cos();
            let mut along = [LinearSrgb::BLACK; 3];
            for (column, (across, ahead)) in azimuths.iter().enumerate() {
                let pixel = environment.pixel(column, row);
                sum += pixel.luminance();
                environment.columns.push(sum);
                along[0] += pixel * *across;
                along[1] += pixel;
                along[2] += pixel * -ahead;
            }

            // Of the first two bands of spherical harmonics, the clamped cosine leaves ∫L dω / 4, the mean over all
            // normals, and ∫Lω dω / 2, the change with the normal.
            let smooth = &mut environment.smooth;
            smooth.mean += along[1] * (0.25 * solid_angle_sr);
            for ((sum, along), share) in smooth.by_normal.iter_mut().zip(along).zip([sine, cosine, sine]) {
                *sum += along * (0.5 * solid_angle_sr * share);
            }

            // The solid angle is constant along a row, so that luminance alone distributes its columns.
            if sum > 0.0 {
                environment.columns[start..]
                    .iter_mut()
                    .for_each(|share| *share /= sum);
            }
            environment.total += sum * solid_angle_sr;
            environment.rows.push(environment.total);
        }

        // A black image has no distribution; its rows stay 0.
        let total = environment.total;
        if total > 0.0 {
            environment.rows.iter_mut().for_each(|share| *share /= total);
        }
        environment.suns = SkySuns::of(&environment);
        Some(environment)
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Radiance of all pixels [W/(m² sr)], row by row from the top.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.radiance
    }

    /// ∫ L dω over all directions, of the luminance [W/m²].
    pub fn total_w_per_m2(&self) -> f64 {
        self.total
    }

    /// Irradiance of unoccluded surfaces.
    pub fn smooth_irradiance(&self) -> &SmoothIrradiance {
        &self.smooth
    }

    /// Its small bright spots.
    pub fn suns(&self) -> &SkySuns {
        &self.suns
    }

    /// Unit, of the middle of a pixel.
    fn direction(&self, column: usize, row: usize) -> DVec3 {
        let (sine, cosine) = ((row as f64 + 0.5) / self.height as f64 * PI).sin_cos();
        let (across, ahead) = ((column as f64 + 0.5) / self.width as f64 * TAU).sin_cos();
        DVec3::new(sine * across, cosine, -sine * ahead)
    }

    fn pixel(&self, column: usize, row: usize) -> LinearSrgb {
        LinearSrgb::from(self.radiance[row * self.width + column].map(f64::from))
    }

    /// A pixel, darkened to a luminance of at most `cut`.
    fn pixel_below(&self, cut: f64, column: usize, row: usize) -> LinearSrgb {
        let pixel = self.pixel(column, row);
        pixel * (cut / pixel.luminance()).min(1.0)
    }

    fn pixel_solid_angle_sr(&self, row: usize) -> f64 {
        let polar = |row: usize| row as f64 / self.height as f64 * PI;
        TAU / self.width as f64 * (polar(row).cos() - polar(row + 1).cos())
    }

    /// Radiance from a unit direction [W/(m² sr)], of the pixel that contains it.
    pub fn radiance(&self, to_light: DVec3) -> LinearSrgb {
        let [u, v] = coordinates(to_light).to_array();
        let index = |share: f64, count: usize| ((share * count as f64).max(0.0) as usize).min(count - 1);
        self.pixel(index(u, self.width), index(v, self.height))
    }

    /// Radiance seen in a unit direction [W/(m² sr)], interpolated bilinearly between pixel centres: around the image,
    /// but not across the poles. Pixels count by a luminance of at most `cut`. `sky.wgsl` does the same.
    pub fn smooth_radiance(&self, direction: DVec3, cut: f64) -> LinearSrgb {
        let size = DVec2::new(self.width as f64, self.height as f64);
        let place = coordinates(direction) * size - 0.5;
        let low = place.floor();
        let share = place - low;
        let row = |row: f64| row.clamp(0.0, size.y - 1.0) as usize;
        let column = |column: f64| (column.rem_euclid(size.x) as usize).min(self.width - 1);
        let along = |row: usize| {
            let [left, right] = [low.x, low.x + 1.0].map(|x| self.pixel_below(cut, column(x), row));
            left * (1.0 - share.x) + right * share.x
        };
        along(row(low.y)) * (1.0 - share.y) + along(row(low.y + 1.0)) * share.y
    }

    /// pdf of [`sample`](Self::sample) for a direction [1/sr]; 0 if the environment is black.
    pub fn density_per_sr(&self, to_light: DVec3) -> f64 {
        if self.total > 0.0 {
            self.radiance(to_light).luminance() / self.total
        } else {
            0.0
        }
    }

    /// Samples a direction in proportion to luminance from a point of the unit square. `None` if the environment is
    /// black.
    pub fn sample(&self, square: DVec2) -> Option<EnvironmentSample> {
        if self.total <= 0.0 {
            return None;
        }
        let (row, v) = inverted(&self.rows, square.y);
        let (column, u) = inverted(&self.columns[row * self.width..][..self.width], square.x);
        // Uniform in solid angle within the pixel.
        let polar = |edge: usize| (edge as f64 / self.height as f64 * PI).cos();
        let cosine = polar(row) + (polar(row + 1) - polar(row)) * v;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let azimuth = (column as f64 + u) / self.width as f64 * TAU;
        let pixel = self.pixel(column, row);
        Some(EnvironmentSample {
            to_light: DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos()),
            irradiance: pixel * (self.total / pixel.luminance()),
        })
    }
}

/// Image coordinates of a unit direction, [0, 1]² from the top left.
pub fn coordinates(direction: DVec3) -> DVec2 {
    let azimuth = direction.x.atan2(-direction.z).rem_euclid(TAU);
    DVec2::new(azimuth / TAU, direction.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Inverts a cumulative distribution: the step that contains a share and the relative position in it, [0, 1).
fn inverted(shares: &[f64], share: f64) -> (usize, f64) {
    // Steps of zero weight are never chosen, trailing ones included.
    let last = shares.len() - 1;
    let end = shares.partition_point(|&upto| upto < shares[last]);
    let step = shares.partition_point(|&upto| upto <= share).min(end);
    let before = if step == 0 { 0.0 } else { shares[step - 1] };
    let width = shares[step] - before;
    let within = if width > 0.0 {
        (share - before) / width
    } else {
        0.5
    };
    (step, within.clamp(0.0, 1.0 - f64::EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sampling::even_point;

    #[test]
    fn samples_add_up_to_the_whole() {
        let (width, height) = (16, 8);
        let pixels: Vec<[f32; 3]> = (0..width * height)
            .map(|pixel| {
                let bright = if pixel == 37 { 900.0 } else { (pixel % 5) as f32 };
                [bright, 0.5 * bright, 0.1 * bright]
            })
            .collect();
        let Some(sky) = Environment::new(width, height, pixels) else {
            panic!("a sound image");
        };
        // ∫ L cos⁺ dω about a slanted axis, from samples and from pixels.
        let axis = DVec3::new(0.3, 0.8, -0.5).normalize();
        let count = 1 << 16;
        let mut sum = LinearSrgb::BLACK;
        for index in 0..count {
            let Some(sample) = sky.sample(even_point(index, 0, 3)) else {
                panic!("it shines");
            };
            sum += sample.irradiance * sample.to_light.dot(axis).max(0.0);
            let seen = sky.radiance(sample.to_light);
            let density = seen.luminance() / sky.total_w_per_m2();
            assert!((sample.irradiance.r * density - seen.r).abs() < 1e-9 * seen.r);
        }
        let mean = sum * (1.0 / f64::from(count));
        let mut expected = LinearSrgb::BLACK;
        let fine = 400;
        for row in 0..fine {
            for column in 0..2 * fine {
                let polar = (f64::from(row) + 0.5) / f64::from(fine) * PI;
                let azimuth = (f64::from(column) + 0.5) / f64::from(2 * fine) * TAU;
                let to_light = DVec3::new(
                    polar.sin() * azimuth.sin(),
                    polar.cos(),
                    -polar.sin() * azimuth.cos(),
                );
                let solid_angle_sr = polar.sin() * (PI / f64::from(fine)) * (PI / f64::from(fine));
                expected += sky.radiance(to_light) * (solid_angle_sr * to_light.dot(axis).max(0.0));
            }
        }
        for (mean, expected) in mean.to_array().into_iter().zip(expected.to_array()) {
            assert!((mean / expected - 1.0).abs() < 2e-3, "{mean} for {expected}");
        }
    }

    #[test]
    fn a_clear_sky_sends_what_it_is_asked_to() {
        let to_sun = DVec3::new(0.3, 0.8, -0.5).normalize();
        let Some(sky) = clear_sky(to_sun, 6.0, 1.0) else {
            panic!("it shines");
        };
        let count = 1 << 16;
        let samples = (0..count).filter_map(|index| sky.sample(even_point(index, 0, 3)));
        let received = samples.map(|sample| sample.irradiance.luminance() * sample.to_light.y.max(0.0));
        let mean = received.sum::<f64>() / f64::from(count);
        assert!((mean - 1.0).abs() < 2e-3, "{mean}");
        let [sun, away] =
            [to_sun, to_sun * DVec3::new(-1.0, 1.0, -1.0)].map(|at| sky.radiance(at).luminance());
        assert!(sun > 4.0 * away, "{sun} {away}");
        let ground = sky.radiance(DVec3::NEG_Y).luminance();
        let expected = 0.2 / PI * (6.0 * to_sun.y + 1.0);
        assert!((ground / expected - 1.0).abs() < 1e-6, "{ground} {expected}");
    }

    #[test]
    fn half_a_sky_lights_surfaces_by_their_tilt() {
        let pixels = (0..64 * 32).map(|index| [f32::from(u8::from(index < 64 * 16)); 3]);
        let sky = Environment::new(64, 32, pixels.collect()).expect("a sound image");
        for normal in [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::new(0.6, 0.8, 0.0)] {
            let found = sky.smooth_irradiance().at(normal).luminance();
            let expected = 0.5 * PI * (1.0 + normal.y);
            assert!(
                (found - expected).abs() < 2e-3 * PI,
                "{normal}: {found} for {expected}"
            );
        }
    }

    #[test]
    fn a_black_sky_sends_nothing_and_a_broken_one_is_refused() {
        assert!(
            Environment::new(2, 1, vec![[0.0; 3]; 2]).is_some_and(|sky| sky.sample(DVec2::ZERO).is_none())
        );
        assert!(Environment::new(2, 1, vec![[f32::NAN; 3]; 2]).is_none());
        assert!(Environment::new(2, 2, vec![[1.0; 3]; 2]).is_none());
    }
}
