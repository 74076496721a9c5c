//! The emission of each triangle of an object with an emission texture.

use glam::DVec2;
use rayon::prelude::*;

use super::texture::{Texture, TextureRef};
use super::{InScene, Scene};
use crate::optics::LinearSrgb;

/// Fewest and most samples along an edge of a triangle.
const STEPS: (f64, f64) = (4.0, 64.0);

/// Approximate number of texture samples for a mesh of many triangles: enough to tell which triangles are bright.
const LOOKS: f64 = 1e6;

/// Texels that are searched for the brightest of each triangle, over a whole mesh.
const SEARCHED_TEXELS: f64 = 1.6e7;

/// Radiance of a point relative to what its triangle's weight stands for, at most: a bright spot in a dark triangle
/// makes no photon that outshines all others.
const MAX_CONTRAST: f64 = 16.0;

/// Minimum weight of a triangle.
const LEAST_WEIGHT: f64 = 0.05;

/// Mean of an emission texture over an object, and its distribution over the triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Glow {
    /// Area-weighted mean over the surface.
    pub mean: LinearSrgb,
    /// Sampling weight of each triangle relative to its area: the luminance of its mean relative to that of `mean`, or
    /// more if that misses bright texels.
    pub weights: Vec<f64>,
}

impl Glow {
    /// `None` if the image is black or the mesh lacks its texture coordinates.
    pub fn new(mesh: InScene, image: &TextureRef, texture: &Texture) -> Option<Self> {
        // The more triangles, the fewer samples each, so that a fine mesh takes no longer.
        let most_steps = (LOOKS / mesh.triangle_count() as f64)
            .sqrt()
            .clamp(STEPS.0, STEPS.1);
        let triangles = (0..mesh.triangle_count()).into_par_iter();
        let means = triangles.map(|triangle| triangle_mean(mesh, (image, texture), triangle, most_steps));
        let means: Vec<LinearSrgb> = means.collect::<Option<_>>()?;

        // Weights by area make the mean stand for the power of the whole surface.
        let (mut sum, mut area_m2) = (LinearSrgb::BLACK, 0.0);
        for (triangle, mean) in means.iter().enumerate() {
            let triangle_m2 = mesh.triangle_area_m2(triangle);
            sum += *mean * triangle_m2;
            area_m2 += triangle_m2;
        }
        let mean = sum / area_m2;

        // Triangles are sampled by their mean, or more often where that would make a rare, bright photon.
        let luminance = mean.luminance();
        let brightest = Brightest::new(mesh, image, texture);
        let weight = |(triangle, mean): (usize, &LinearSrgb)| {
            let mean = mean.luminance();

            // Where not even the brightest texel of the image would raise the weight, none is searched for.
            let is_bright = MAX_CONTRAST * mean >= brightest.overall;
            let peak = if is_bright {
                None
            } else {
                brightest.in_triangle(triangle)
            };
            let least = peak.unwrap_or(0.0) / MAX_CONTRAST;
            (mean.max(least) / luminance).max(LEAST_WEIGHT)
        };
        (luminance > 0.0).then(|| Self {
            mean,
            weights: means.par_iter().enumerate().map(weight).collect(),
        })
    }

    /// Factor from a texture's colour to radiance relative to the mean.
    pub fn per_colour(&self) -> LinearSrgb {
        self.mean.map(|mean| if mean > 0.0 { mean.recip() } else { 0.0 })
    }
}

/// Mean of an image over a triangle, sampled once per texel, within the limits of [`STEPS`] and `most_steps`.
fn triangle_mean(
    mesh: InScene,
    (image, texture): (&TextureRef, &Texture),
    triangle: usize,
    most_steps: f64,
) -> Option<LinearSrgb> {
    let at = |barycentric| image.place(mesh, triangle, barycentric);
    let size = DVec2::new(f64::from(texture.width), f64::from(texture.height));
    let [a, b, c] = image.corners(mesh, triangle)?.map(|uv| uv * size);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let steps = longest.clamp(STEPS.0, most_steps) as u32;
    let mut sum = LinearSrgb::BLACK;
    for row in 0..steps {
        for column in 0..steps {
            // Centroids of the sub-triangles; beyond the diagonal, mirroring yields those of the inverted ones.
            let [x, y] = [column, row].map(|step| (f64::from(step) + 1.0 / 3.0) / f64::from(steps));
            let (x, y) = if x + y > 1.0 { (1.0 - x, 1.0 - y) } else { (x, y) };
            sum += texture.sample(at([1.0 - x - y, x, y])?);
        }
    }
    Some(sum / f64::from(steps * steps))
}

/// Upper bounds of an emission texture over triangles.
struct Brightest<'a> {
    mesh: InScene<'a>,
    image: &'a TextureRef,
    texture: &'a Texture,
    /// Over the whole image.
    overall: f64,
    /// Texels that may be searched for a triangle.
    most_texels: f64,
}

impl<'a> Brightest<'a> {
    fn new(mesh: InScene<'a>, image: &'a TextureRef, texture: &'a Texture) -> Self {
        Self {
            mesh,
            image,
            texture,
            overall: texture.brightest_within(DVec2::ZERO, DVec2::ONE),
            most_texels: SEARCHED_TEXELS / mesh.triangle_count() as f64,
        }
    }

    /// Largest luminance in the bounding box of a triangle; `None` if the mesh lacks the texture coordinates.
    fn in_triangle(&self, triangle: usize) -> Option<f64> {
        let [a, b, c] = self.image.corners(self.mesh, triangle)?;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let sides = (high - low) * DVec2::new(f64::from(self.texture.width), f64::from(self.texture.height));
        Some(if sides.element_product() > self.most_texels {
            self.overall
        } else {
            self.texture.brightest_within(low, high)
        })
    }
}

impl Scene {
    /// Radiance of an emissive object at a point relative to its mean; white without an emission texture.
    pub fn glow_at(&self, object: usize, triangle: usize, barycentric: [f64; 3]) -> LinearSrgb {
        let Some(glow) = self.glows.get(&object) else {
            return LinearSrgb::WHITE;
        };
        let image = self.material_of(object).emission_texture.as_ref();
        let placed = image.and_then(|image| self.placed_texture(image, (object, triangle), barycentric));
        placed.map_or(LinearSrgb::WHITE, |(texture, uv)| {
            texture.sample(uv) * glow.per_colour()
        })
    }
}
