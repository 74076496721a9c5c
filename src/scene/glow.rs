//! Where an object with an emission texture shines, and how bright.

use glam::DVec2;
use rayon::prelude::*;

use super::texture::{Texture, TextureRef};
use super::{InScene, Scene};
use crate::optics::LinearSrgb;

/// Fewest and most samples along an edge of a triangle.
const STEPS: (f64, f64) = (4.0, 64.0);

/// Approximate number of texture samples for a mesh of many triangles: enough to tell which triangles are bright.
const LOOKS: f64 = 1e6;

/// Texels that are searched for bright ones, over a whole mesh: an image of 4096 × 4096 on two triangles, whose bounding
/// boxes hold twice as many.
const SEARCHED_TEXELS: f64 = 6.4e7;

/// Parts that the triangles of a mesh are divided into at most, approximately.
const MAX_PARTS: f64 = (1 << 18) as f64;

/// A triangle is at most halved so often.
const MAX_HALVINGS: f64 = 12.0;

/// Luminance of a point relative to what its part's weight stands for, at most: a bright spot in a dark part makes no
/// photon that outshines all others.
const MAX_CONTRAST: f64 = 16.0;

/// The same for triangles and their surface as a whole that need no division: samples of them vary less than light does
/// otherwise.
const MAX_EVEN_CONTRAST: f64 = 4.0;

/// The same within a part that is not divided further.
const MAX_PART_CONTRAST: f64 = 1.5;

/// Mean of an emission texture over an object, and its distribution over the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Glow {
    /// Area-weighted mean over the surface.
    pub mean: LinearSrgb,
    /// Parts of the surface in the order of its triangles; together they are all of it.
    pub parts: Vec<GlowPart>,
}

/// A triangle, or a part of one of the same shape, with its sampling weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlowPart {
    /// Index into the mesh's triangles.
    pub triangle: u32,
    /// Weights of the triangle's second and third corner at the first corner of the part.
    corner: [f32; 2],
    /// Length of the part's edges relative to the triangle's; negative if the part is turned by half a turn.
    size: f32,
    /// Sampling weight relative to the part's area: its luminance relative to that of [`Glow::mean`], or more if that
    /// misses bright texels; 0 where it is black.
    pub weight: f64,
}

impl GlowPart {
    fn whole(triangle: usize, weight: f64) -> Self {
        Self {
            triangle: triangle as u32,
            corner: [0.0; 2],
            size: 1.0,
            weight,
        }
    }

    /// Area relative to the triangle's.
    pub fn share(&self) -> f64 {
        f64::from(self.size).powi(2)
    }

    /// Barycentric coordinates within the triangle of a point with these coordinates within the part.
    pub fn barycentric(&self, [_, second, third]: [f64; 3]) -> [f64; 3] {
        let [x, y] = self.corner.map(f64::from);
        let (x, y) = (
            x + f64::from(self.size) * second,
            y + f64::from(self.size) * third,
        );
        [1.0 - x - y, x, y]
    }

    /// The four parts with edges of half the length.
    fn quarters(&self) -> [Self; 4] {
        let (size, [x, y]) = (0.5 * self.size, self.corner);
        let at = |corner: [f32; 2], size: f32| Self {
            corner,
            size,
            ..*self
        };
        [
            at([x, y], size),
            at([x + size, y], size),
            at([x + size, y + size], -size),
            at([x, y + size], size),
        ]
    }
}

impl Glow {
    /// `None` if the image is black or the mesh lacks its texture coordinates.
    pub fn new(mesh: InScene, image: &TextureRef, texture: &Texture) -> Option<Self> {
        // Parts are sampled by their luminance, so that light starts where the image is bright.
        let corners = (0..mesh.triangle_count()).map(|triangle| image.corners(mesh, triangle));
        let corners: Vec<[DVec2; 3]> = corners.collect::<Option<_>>()?;
        let divider = Divider::new(texture, &corners);
        let triangles = corners.par_iter().enumerate();
        let triangles = triangles.map(|(triangle, corners)| divider.parts(triangle, *corners));
        let triangles: Vec<(LinearSrgb, Vec<GlowPart>)> = triangles.collect();

        // Weights by area make the mean stand for the power of the whole surface.
        let (mut sum, mut area_m2) = (LinearSrgb::BLACK, 0.0);
        for (triangle, (mean, _)) in triangles.iter().enumerate() {
            let triangle_m2 = mesh.triangle_area_m2(triangle);
            sum += *mean * triangle_m2;
            area_m2 += triangle_m2;
        }
        let mean = sum / area_m2;
        let luminance = mean.luminance();
        let relative = |part: GlowPart| GlowPart {
            weight: part.weight / luminance,
            ..part
        };
        let parts = triangles.into_iter().flat_map(|(_, parts)| parts);
        (luminance > 0.0).then(|| Self {
            mean,
            parts: parts.map(relative).collect(),
        })
    }

    /// Whether the surface shines about as bright everywhere, so that it may be sampled evenly.
    pub fn is_even(&self) -> bool {
        let is_usual = |part: &GlowPart| {
            part.size == 1.0 && (MAX_EVEN_CONTRAST.recip()..=MAX_EVEN_CONTRAST).contains(&part.weight)
        };
        self.parts.iter().all(is_usual)
    }

    /// Factor from a texture's colour to radiance relative to the mean.
    pub fn per_colour(&self) -> LinearSrgb {
        self.mean.map(|mean| if mean > 0.0 { mean.recip() } else { 0.0 })
    }
}

/// Mean of an image over a triangle of texture coordinates, by so many samples along an edge.
fn mean_within(texture: &Texture, [a, b, c]: [DVec2; 3], steps: u32) -> LinearSrgb {
    let mut sum = LinearSrgb::BLACK;
    for row in 0..steps {
        for column in 0..steps {
            // Centroids of the sub-triangles; beyond the diagonal, mirroring yields those of the inverted ones.
            let [x, y] = [column, row].map(|step| (f64::from(step) + 1.0 / 3.0) / f64::from(steps));
            let (x, y) = if x + y > 1.0 { (1.0 - x, 1.0 - y) } else { (x, y) };
            sum += texture.sample(a * (1.0 - x - y) + b * x + c * y);
        }
    }
    sum / f64::from(steps * steps)
}

/// Longest edge of a triangle of texture coordinates [texels].
fn longest_texels(texture: &Texture, corners: [DVec2; 3]) -> f64 {
    let [a, b, c] = corners.map(|uv| uv * texture.size());
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

/// Divides triangles into parts, each about as bright everywhere. Weights are luminances.
struct Divider<'a> {
    texture: &'a Texture,
    /// Largest luminance of the whole image.
    overall: f64,
    /// Most samples along an edge of a triangle that is not searched.
    most_steps: f64,
    /// Texels that may be searched for a triangle.
    most_texels: f64,
    /// Length of the edges of the smallest parts [texels].
    least_texels: f64,
}

impl<'a> Divider<'a> {
    /// For triangles of these texture coordinates.
    fn new(texture: &'a Texture, triangles: &[[DVec2; 3]]) -> Self {
        let area = |[a, b, c]: &[DVec2; 3]| 0.5 * (b - a).perp_dot(c - a).abs();
        let texels = triangles.iter().map(area).sum::<f64>() * texture.size().element_product();
        let count = triangles.len() as f64;
        let boxes_texels: f64 = triangles.iter().map(|uvs| box_texels(texture, *uvs)).sum();
        Self {
            texture,
            overall: texture.brightest_within(DVec2::ZERO, DVec2::ONE),
            // The more triangles, the fewer samples each, so that a fine mesh takes no longer.
            most_steps: (LOOKS / count).sqrt().clamp(STEPS.0, STEPS.1),
            most_texels: if boxes_texels <= SEARCHED_TEXELS {
                f64::INFINITY
            } else {
                SEARCHED_TEXELS / count
            },
            least_texels: (texels / MAX_PARTS).max(1.0).sqrt(),
        }
    }

    /// Mean of a triangle, and its parts.
    fn parts(&self, triangle: usize, corners: [DVec2; 3]) -> (LinearSrgb, Vec<GlowPart>) {
        // Where not even the brightest texel of the image would stand out, none is searched for.
        let longest = longest_texels(self.texture, corners);
        let steps = longest.clamp(STEPS.0, self.most_steps) as u32;
        let mean = mean_within(self.texture, corners, steps);
        let whole = |weight: f64| (mean, vec![GlowPart::whole(triangle, weight)]);
        if self.overall <= MAX_EVEN_CONTRAST * mean.luminance() {
            return whole(mean.luminance());
        }
        if box_texels(self.texture, corners) > self.most_texels {
            return whole(mean.luminance().max(self.overall / MAX_CONTRAST));
        }
        let halvings = (longest / self.least_texels).log2().ceil();
        let halvings = halvings.clamp(0.0, MAX_HALVINGS) as u32;
        let mut parts = Vec::new();
        let (mean, _) = self.divide(GlowPart::whole(triangle, 0.0), corners, halvings, &mut parts);
        (mean, parts)
    }

    /// Adds the parts of a part with these texture coordinates, which may be halved so often. Returns its mean and its
    /// largest luminance.
    fn divide(
        &self,
        part: GlowPart,
        [a, b, c]: [DVec2; 3],
        halvings: u32,
        parts: &mut Vec<GlowPart>,
    ) -> (LinearSrgb, f64) {
        let first = parts.len();
        let (mut mean, mut peak) = (LinearSrgb::BLACK, 0.0_f64);
        if halvings > 0 {
            let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
            let corners = [[a, ab, ca], [ab, b, bc], [bc, ca, ab], [ca, bc, c]];
            for (quarter, corners) in part.quarters().into_iter().zip(corners) {
                let (of_quarter, peak_of_quarter) = self.divide(quarter, corners, halvings - 1, parts);
                mean += of_quarter * 0.25;
                peak = peak.max(peak_of_quarter);
            }
            if peak > MAX_PART_CONTRAST * mean.luminance() {
                return (mean, peak);
            }
        } else {
            let steps = 2.0 * longest_texels(self.texture, [a, b, c]).ceil();
            mean = mean_within(self.texture, [a, b, c], steps.clamp(2.0, STEPS.1) as u32);
            peak = self.texture.brightest_within(a.min(b).min(c), a.max(b).max(c));
        }

        // What is about as bright everywhere is one part.
        parts.truncate(first);
        parts.push(GlowPart {
            weight: mean.luminance().max(peak / MAX_CONTRAST),
            ..part
        });
        (mean, peak)
    }
}

/// Texels in the bounding box of a triangle of texture coordinates.
fn box_texels(texture: &Texture, corners: [DVec2; 3]) -> f64 {
    let [a, b, c] = corners.map(|uv| uv * texture.size());
    (a.max(b).max(c) - a.min(b).min(c) + 1.0).element_product()
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
