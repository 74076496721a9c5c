//! Images on surfaces.

use glam::{DMat3, DVec2};

use super::{InScene, Scene};
use crate::optics::LinearSrgb;

/// How a coordinate outside [0, 1] is brought back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    Repeat,
    /// Tiles, every second one mirrored.
    MirroredRepeat,
    /// The border goes on.
    ClampToEdge,
}

/// An 8-bit image, row 0 at v = 0: sRGB-encoded where it is a colour, linear where it holds normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The file's name for it; `imageN` when it has none.
    pub name: String,
    /// Texels across, > 0.
    pub width: u32,
    /// Texels down, > 0.
    pub height: u32,
    /// RGBA, row by row.
    pub rgba: Vec<[u8; 4]>,
    /// Across and down.
    pub wrap: [Wrap; 2],
}

/// A texture and how a material looks it up.
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
    /// Bilinear look-up in linear light at a texture coordinate.
    pub fn sample(&self, uv: DVec2) -> LinearSrgb {
        let x = uv.x * f64::from(self.width) - 0.5;
        let y = uv.y * f64::from(self.height) - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let row = |dy: f64| self.texel(x0, y0 + dy) * (1.0 - fx) + self.texel(x0 + 1.0, y0 + dy) * fx;
        row(0.0) * (1.0 - fy) + row(1.0) * fy
    }

    /// Bilinear look-up of alpha, [0, 1], at a texture coordinate.
    pub fn alpha(&self, uv: DVec2) -> f64 {
        let x = uv.x * f64::from(self.width) - 0.5;
        let y = uv.y * f64::from(self.height) - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at = |dx: f64, dy: f64| f64::from(self.code(x0 + dx, y0 + dy)[3]) / 255.0;
        let row = |dy: f64| at(0.0, dy) * (1.0 - fx) + at(1.0, dy) * fx;
        row(0.0) * (1.0 - fy) + row(1.0) * fy
    }

    /// The texel of a column and a row, whole numbers that may lie anywhere.
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
    /// Where it is looked up at a place of a triangle; `None` where the mesh lacks its coordinates.
    pub fn place(&self, mesh: InScene, triangle: usize, barycentric: [f64; 3]) -> Option<DVec2> {
        let uvs = mesh.uvs(self.uv_set)?;
        let corners = mesh.triangle(triangle).into_iter().zip(barycentric);
        let uv = corners.fold(DVec2::ZERO, |sum, (vertex, weight)| {
            sum + uvs[vertex as usize] * weight
        });
        Some(self.transform(uv))
    }

    /// The texture coordinate after KHR_texture_transform.
    pub fn transform(&self, uv: DVec2) -> DVec2 {
        self.uv_transform.transform_point2(uv)
    }
}

impl Scene {
    /// A texture, and where it is looked up at a place of a triangle of an object; `None` where its mesh lacks the
    /// coordinates.
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

/// Index in 0..size of a whole-numbered coordinate that may lie anywhere, also beyond the integers.
fn wrap_index(coordinate: f64, size: u32, wrap: Wrap) -> usize {
    let size_f = f64::from(size);
    let index = match wrap {
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
    // NaN and the rounding of rem_euclid up to its divisor both end on a valid texel.
    (index as usize).min(size as usize - 1)
}
