//! Normal textures as slopes of the height field that they represent.

use glam::DVec2;

use super::texture::{Texture, TextureRef};

/// Steepest slope that a texel is read as [1]: 83°. Normals along the surface, or into it, have none.
const STEEPEST_TEXEL: f64 = 8.0;

/// A normal texture of a material (glTF's: +X along u, +Y against v, +Z away from the surface).
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Its image holds (n + 1)/2, linear, and how it is looked up.
    pub image: TextureRef,
    /// Multiplies X and Y of the normals.
    pub scale: f64,
    /// Length of its finest waves [texels]; infinite where it is flat.
    pub detail_texels: f64,
}

/// The slope of a height at a place of a normal texture [1], along +X and +Y, and its change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slope {
    /// −X/Z and −Y/Z of the normal.
    pub value: DVec2,
    /// Its derivative by u [1 per unit of u].
    pub by_u: DVec2,
    /// By v.
    pub by_v: DVec2,
}

impl NormalMap {
    /// With the detail that the image has.
    pub fn new(image: TextureRef, scale: f64, texture: &Texture) -> Self {
        Self {
            image,
            scale,
            detail_texels: detail_texels(texture, scale),
        }
    }

    /// The slope at a texture coordinate (KHR_texture_transform applied): bilinear between the slopes of texels.
    pub fn slope(&self, texture: &Texture, uv: DVec2) -> Slope {
        let size = DVec2::new(f64::from(texture.width), f64::from(texture.height));
        let place = uv * size - 0.5;
        let low = place.floor();
        let share = place - low;
        let at = |dx: f64, dy: f64| texel_slope(texture.code(low.x + dx, low.y + dy), self.scale);
        let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)];
        Slope {
            value: a.lerp(b, share.x).lerp(c.lerp(d, share.x), share.y),
            by_u: (b - a).lerp(d - c, share.y) * size.x,
            by_v: (c - a).lerp(d - b, share.x) * size.y,
        }
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

/// The length [texels] of the wave whose slope changes as much from texel to texel, in the mean, as that of the image:
/// a sine of λ texels changes by 2·sin(π/λ) of its own size.
fn detail_texels(texture: &Texture, scale: f64) -> f64 {
    let slope = |x: u32, y: u32| texel_slope(texture.code(f64::from(x), f64::from(y)), scale);
    let (mut mean, mut squares, mut changes) = (DVec2::ZERO, 0.0, 0.0_f64);
    for y in 0..texture.height {
        for x in 0..texture.width {
            let here = slope(x, y);
            mean += here;
            squares += here.length_squared();
            changes += (slope(x + 1, y) - here)
                .length_squared()
                .max((slope(x, y + 1) - here).length_squared());
        }
    }
    let count = f64::from(texture.width) * f64::from(texture.height);
    let variance = squares / count - (mean / count).length_squared();
    if variance <= 0.0 || changes <= 0.0 {
        return f64::INFINITY;
    }
    let half = 0.5 * (changes / count / variance).sqrt();
    std::f64::consts::PI / half.min(1.0).asin()
}
