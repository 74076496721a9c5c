//! Normal textures as slopes of the height field that they represent.

use glam::DVec2;

use super::texture::{Texture, TextureRef};

/// Number of texels whose slopes tell the detail of a large image well enough.
const MEASURED: usize = 1 << 20;

/// Limit of the slope of a texel [1]: 83°. Normals in or below the tangent plane have no slope of their own.
const STEEPEST_TEXEL: f64 = 8.0;

/// Normal texture of a material (glTF's: +X along u, +Y against v, +Z away from the surface).
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Image of (n + 1)/2, linear, and its coordinates.
    pub image: TextureRef,
    /// Factor on X and Y of the normals.
    pub scale: f64,
}

impl NormalMap {
    /// `None` if the image is flat.
    pub fn new(image: TextureRef, scale: f64, texture: &Texture) -> Option<Self> {
        is_bent(texture, scale).then_some(Self { image, scale })
    }

    /// Slope of the height field at a texture coordinate (after KHR_texture_transform) [1], −X/Z and −Y/Z of the normal,
    /// interpolated bilinearly between the slopes of texels.
    pub fn slope(&self, texture: &Texture, uv: DVec2) -> DVec2 {
        let size = DVec2::new(f64::from(texture.width), f64::from(texture.height));
        let place = uv * size - 0.5;
        let low = place.floor();
        let share = place - low;
        let at = |dx: f64, dy: f64| texel_slope(texture.code(low.x + dx, low.y + dy), self.scale);
        let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)];
        a.lerp(b, share.x).lerp(c.lerp(d, share.x), share.y)
    }
}

/// −X/Z and −Y/Z of a texel's normal.
fn texel_slope([red, green, blue, _]: [u8; 4], scale: f64) -> DVec2 {
    let signed = |code: u8| f64::from(code) / 127.5 - 1.0;
    let along = DVec2::new(signed(red), signed(green)) * scale;
    let least = along.length() / STEEPEST_TEXEL;
    let up = signed(blue).max(least);
    if up > 0.0 { -along / up } else { DVec2::ZERO }
}

/// Whether slopes differ from texel to texel, in so many of them.
fn is_bent(texture: &Texture, scale: f64) -> bool {
    let slope = |x: u32, y: u32| texel_slope(texture.code(f64::from(x), f64::from(y)), scale);
    let first = slope(0, 0);
    let step = (texture.width as usize * texture.height as usize).div_ceil(MEASURED);
    let mut rows = (0..texture.height).step_by(step);
    rows.any(|y| (0..texture.width).any(|x| slope(x, y) != first))
}
