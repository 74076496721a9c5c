//! Textures: images with coordinates, wrapping and filtering.

use glam::{DMat3, DVec2};

use super::{InScene, Scene};
use crate::optics::LinearSrgb;

/// Wrap mode for coordinates outside [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    Repeat,
    /// Tiles, every second one mirrored.
    MirroredRepeat,
    /// Extends the border texels.
    ClampToEdge,
}

/// 8-bit image with row 0 at v = 0: sRGB-encoded if it holds a colour, linear if it holds normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Name in the file; `imageN` without one.
    pub name: String,
    /// Width in texels, > 0.
    pub width: u32,
    /// Height in texels, > 0.
    pub height: u32,
    /// RGBA, row by row.
    pub rgba: Vec<[u8; 4]>,
    /// In u and v.
    pub wrap: [Wrap; 2],
    /// Whether look-ups take the nearest texel instead of interpolating; normal maps are always interpolated.
    pub is_nearest: bool,
}

/// A texture and the coordinates with which a material samples it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into `Scene::textures`.
    pub texture: usize,
    /// 0 or 1: TEXCOORD_0 or TEXCOORD_1.
    pub uv_set: usize,
    /// KHR_texture_transform; identity without it.
    pub uv_transform: DMat3,
}

impl Texture {
    /// [texels].
    pub fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// Linear-light colour at a texture coordinate.
    pub fn sample(&self, uv: DVec2) -> LinearSrgb {
        let (low, share) = self.between(uv);
        let at = |dx: f64, dy: f64| self.texel(low.x + dx, low.y + dy);
        let row = |dy: f64| at(0.0, dy) * (1.0 - share.x) + at(1.0, dy) * share.x;
        row(0.0) * (1.0 - share.y) + row(1.0) * share.y
    }

    /// Largest luminance of all texels that samples between two texture coordinates may touch.
    pub fn brightest_within(&self, low: DVec2, high: DVec2) -> f64 {
        let size = [self.width, self.height].map(f64::from);
        let (first, last) = (self.between(low).0, self.between(high).0 + 1.0);
        // Beyond the size of the image, texels repeat.
        let range = |axis: usize| {
            let count = last[axis] - first[axis] + 1.0;
            if count < size[axis] {
                (first[axis], count as u32)
            } else {
                (0.0, size[axis] as u32)
            }
        };
        let ((left, columns), (top, rows)) = (range(0), range(1));
        let mut brightest = 0.0_f64;
        for row in 0..rows {
            for column in 0..columns {
                let texel = self.texel(left + f64::from(column), top + f64::from(row));
                brightest = brightest.max(texel.luminance());
            }
        }
        brightest
    }

    /// Alpha at a texture coordinate, [0, 1].
    pub fn alpha(&self, uv: DVec2) -> f64 {
        let (low, share) = self.between(uv);
        let at = |dx: f64, dy: f64| f64::from(self.code(low.x + dx, low.y + dy)[3]) / 255.0;
        let row = |dy: f64| at(0.0, dy) * (1.0 - share.x) + at(1.0, dy) * share.x;
        row(0.0) * (1.0 - share.y) + row(1.0) * share.y
    }

    /// Lower texel of the interpolation on both axes, and the weights of the upper ones, [0, 1].
    fn between(&self, uv: DVec2) -> (DVec2, DVec2) {
        let place = uv * self.size() - 0.5;
        let low = place.floor();
        let share = place - low;
        (low, if self.is_nearest { share.round() } else { share })
    }

    /// Encoded texel at an integer column and row, which may lie outside the image.
    pub fn code(&self, column: f64, row: f64) -> [u8; 4] {
        let column = wrap_index(column, self.width, self.wrap[0]);
        let row = wrap_index(row, self.height, self.wrap[1]);
        self.rgba[row * self.width as usize + column]
    }

    fn texel(&self, x: f64, y: f64) -> LinearSrgb {
        let [r, g, b, _] = self.code(x, y);
        LinearSrgb::new(
            LinearSrgb::decode_channel(r),
            LinearSrgb::decode_channel(g),
            LinearSrgb::decode_channel(b),
        )
    }
}

impl TextureRef {
    /// Texture coordinate at a point of a triangle; `None` if the mesh lacks the TEXCOORD set.
    pub fn place(&self, mesh: InScene, triangle: usize, barycentric: [f64; 3]) -> Option<DVec2> {
        let uvs = mesh.uvs(self.uv_set)?;
        let corners = mesh.triangle(triangle).into_iter().zip(barycentric);
        let uv = corners.fold(DVec2::ZERO, |sum, (vertex, weight)| {
            sum + uvs[vertex as usize] * weight
        });
        Some(self.transform(uv))
    }

    /// Texture coordinates of a triangle's corners; `None` if the mesh lacks the TEXCOORD set.
    pub fn corners(&self, mesh: InScene, triangle: usize) -> Option<[DVec2; 3]> {
        let at = |barycentric| self.place(mesh, triangle, barycentric);
        Some([at([1.0, 0.0, 0.0])?, at([0.0, 1.0, 0.0])?, at([0.0, 0.0, 1.0])?])
    }

    /// Applies KHR_texture_transform to a texture coordinate.
    pub fn transform(&self, uv: DVec2) -> DVec2 {
        self.uv_transform.transform_point2(uv)
    }
}

impl Scene {
    /// A texture and its coordinate at a point of an object's triangle; `None` if the mesh lacks the TEXCOORD set.
    pub fn placed_texture(
        &self,
        reference: &TextureRef,
        (object, triangle): (usize, usize),
        barycentric: [f64; 3],
    ) -> Option<(&Texture, DVec2)> {
        let uv = reference.place(self.objects[object].in_scene(), triangle, barycentric)?;
        Some((&self.textures[reference.texture], uv))
    }
}

/// Wraps an integer-valued coordinate, which may exceed the integer types, to an index in 0..size.
fn wrap_index(coordinate: f64, size: u32, wrap: Wrap) -> usize {
    let size_f = f64::from(size);
    let index = match wrap {
        // Common case of all modes, without a division.
        _ if (0.0..size_f).contains(&coordinate) => coordinate,
        Wrap::ClampToEdge => coordinate.clamp(0.0, size_f - 1.0),
        Wrap::Repeat => coordinate.rem_euclid(size_f),
        Wrap::MirroredRepeat => {
            let folded = coordinate.rem_euclid(2.0 * size_f);
            if folded < size_f {
                folded
            } else {
                2.0 * size_f - 1.0 - folded
            }
        }
    };
    // NaN, and rem_euclid rounded up to its divisor, also end on a valid texel.
    (index as usize).min(size as usize - 1)
}
