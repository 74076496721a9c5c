//! Textures: images with coordinates, wrapping and filtering.

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
    /// Whether a place has the colour of its nearest texel, and not one between four; slopes of normals are always between.
    pub is_nearest: bool,
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
    /// Look-up in linear light at a texture coordinate.
    pub fn sample(&self, uv: DVec2) -> LinearSrgb {
        let (low, share) = self.between(uv);
        let at = |dx: f64, dy: f64| self.texel(low.x + dx, low.y + dy);
        let row = |dy: f64| at(0.0, dy) * (1.0 - share.x) + at(1.0, dy) * share.x;
        row(0.0) * (1.0 - share.y) + row(1.0) * share.y
    }

    /// Look-up of alpha, [0, 1], at a texture coordinate.
    pub fn alpha(&self, uv: DVec2) -> f64 {
        let (low, share) = self.between(uv);
        let at = |dx: f64, dy: f64| f64::from(self.code(low.x + dx, low.y + dy)[3]) / 255.0;
        let row = |dy: f64| at(0.0, dy) * (1.0 - share.x) + at(1.0, dy) * share.x;
        row(0.0) * (1.0 - share.y) + row(1.0) * share.y
    }

    /// The texel below a place on both axes, and how far the place lies towards the next ones, [0, 1].
    fn between(&self, uv: DVec2) -> (DVec2, DVec2) {
        let place = uv * DVec2::new(f64::from(self.width), f64::from(self.height)) - 0.5;
        let low = place.floor();
        let share = place - low;
        (low, if self.is_nearest { share.round() } else { share })
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
        // As each of them has it, without a division.
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
    // NaN and the rounding of rem_euclid up to its divisor both end on a valid texel.
    (index as usize).min(size as usize - 1)
}
