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

/// Mean of an emission texture over an object, and its distribution over the triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Glow {
    /// Area-weighted mean over the surface.
    pub mean: LinearSrgb,
    /// Luminance of each triangle's mean relative to that of `mean`.
    pub by_triangle: Vec<f64>,
}

impl Glow {
    /// `None` if the image is black or the mesh lacks its texture coordinates.
    pub fn new(mesh: InScene, image: &TextureRef, texture: &Texture) -> Option<Self> {
        let most_steps = (LOOKS / mesh.triangle_count() as f64)
            .sqrt()
            .clamp(STEPS.0, STEPS.1);
        let triangles = (0..mesh.triangle_count()).into_par_iter();
        let means = triangles.map(|triangle| triangle_mean(mesh, (image, texture), triangle, most_steps));
        let means: Vec<LinearSrgb> = means.collect::<Option<_>>()?;
        let (mut sum, mut area_m2) = (LinearSrgb::BLACK, 0.0);
        for (triangle, mean) in means.iter().enumerate() {
            let triangle_m2 = mesh.triangle_area_m2(triangle);
            sum += *mean * triangle_m2;
            area_m2 += triangle_m2;
        }
        let mean = sum / area_m2;
        let luminance = mean.luminance();
        (luminance > 0.0).then(|| Self {
            mean,
            by_triangle: means.iter().map(|mean| mean.luminance() / luminance).collect(),
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
    let [a, b, c] = [at([1.0, 0.0, 0.0])?, at([0.0, 1.0, 0.0])?, at([0.0, 0.0, 1.0])?].map(|uv| uv * size);
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
