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
    /// Wavelength of the finest detail [texels]; infinite if the image is flat.
    pub detail_texels: f64,
}

/// Slope of the height field at a point of a normal texture [1], along +X and +Y, and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slope {
    /// −X/Z and −Y/Z of the normal.
    pub value: DVec2,
    /// Derivative with respect to u [1 per unit of u].
    pub by_u: DVec2,
    /// Derivative with respect to v [1 per unit of v].
    pub by_v: DVec2,
}

impl NormalMap {
    /// Measures the detail of the image.
    pub fn new(image: TextureRef, scale: f64, texture: &Texture) -> Self {
        Self {
            image,
            scale,
            detail_texels: detail_texels(texture, scale),
        }
    }

    /// Slope at a texture coordinate (after KHR_texture_transform), interpolated bilinearly between the slopes of
    /// texels.
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

/// Wavelength [texels] of the sine whose slope changes as much from texel to texel, root mean square, as that of the
/// image: a sine of λ texels changes by 2·sin(π/λ) of its own size.
fn detail_texels(texture: &Texture, scale: f64) -> f64 {
    let slope = |x: u32, y: u32| texel_slope(texture.code(f64::from(x), f64::from(y)), scale);
    let (mut mean, mut squares, mut changes) = (DVec2::ZERO, 0.0, 0.0_f64);
    let step = (texture.width as usize * texture.height as usize).div_ceil(MEASURED);
    let mut count = 0.0;
    for y in (0..texture.height).step_by(step) {
        count += f64::from(texture.width);
        for x in 0..texture.width {
            let here = slope(x, y);
            mean += here;
            squares += here.length_squared();
            changes += (slope(x + 1, y) - here)
                .length_squared()
                .max((slope(x, y + 1) - here).length_squared());
        }
    }
    let variance = squares / count - (mean / count).length_squared();
    if variance <= 0.0 || changes <= 0.0 {
        return f64::INFINITY;
    }
    let half = 0.5 * (changes / count / variance).sqrt();
    std::f64::consts::PI / half.min(1.0).asin()
}
