//! Maps as sRGB-encoded images.

use glam::DVec2;

use super::{Bits, Carrier, ExportedMap, GlbOptions};
use crate::error::{Error, Result};
use crate::export::quantity::{Quantity, white};
use crate::files;
use crate::illumination::{Chart, IlluminationMap};
use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::settings::LayerKind;
use crate::units::LUMENS_PER_WATT;

/// Distance from a triangle within which texels take its colours [texels].
const MARGIN_TEXELS: f64 = 2.0;

/// The light in a map's image, per texel of a dense map, in the unit of the export.
pub fn light_of(
    map: &IlluminationMap,
    layers: &[LayerKind],
    scene: &Scene,
    options: GlbOptions,
) -> Vec<LinearSrgb> {
    let mut light = vec![LinearSrgb::BLACK; map.chart.texel_count()];
    for layer in map.layers.iter().filter(|layer| layers.contains(&layer.kind)) {
        for (sum, part) in light.iter_mut().zip(&layer.irradiance) {
            *sum += LinearSrgb::from(part.map(f64::from));
        }
    }
    let factor = match options.carrier {
        Carrier::LightMap => options.quantity.factor(),
        Carrier::Emissive => match options.quantity {
            Quantity::Irradiance | Quantity::IrradianceByPi => std::f64::consts::FRAC_1_PI,
            Quantity::Illuminance | Quantity::IlluminanceByPi => {
                LUMENS_PER_WATT * std::f64::consts::FRAC_1_PI
            }
        },
        Carrier::Unlit => options.exposure_stops.exp2() * std::f64::consts::FRAC_1_PI,
    };
    if options.carrier == Carrier::LightMap {
        return light.into_iter().map(|light| light * factor).collect();
    }
    let albedo = albedo(scene, &map.chart);
    let sent = light.into_iter().zip(albedo);
    sent.map(|(light, albedo)| light * albedo * factor).collect()
}

/// Albedo of the surface at each texel, extended beyond its borders.
fn albedo(scene: &Scene, chart: &Chart) -> Vec<LinearSrgb> {
    let object = &scene.objects[chart.object()];
    let material = scene.material_of(chart.object());
    let (reference, mesh) = (&material.base_colour_texture, object.in_scene());
    if reference.is_none() && object.mesh().colours.is_none() {
        return vec![material.base_colour; chart.texel_count()];
    }
    let mut nearest = vec![Nearest::default(); chart.texel_count()];
    for (triangle, corners) in chart.corner_uvs.iter().enumerate() {
        spread(chart, *corners, triangle, &mut nearest);
    }
    let of_texel = |nearest: &Nearest| {
        let Some((triangle, shares)) = nearest.place else {
            return material.base_colour;
        };
        let placed = reference
            .as_ref()
            .and_then(|image| scene.placed_texture(image, (chart.object(), triangle), shares));
        let of_image = placed.map_or(LinearSrgb::WHITE, |(texture, uv)| texture.sample(uv));
        material.base_colour * of_image * mesh.colour(triangle, shares)
    };
    nearest.iter().map(of_texel).collect()
}

/// The triangle nearest to a texel's centre.
#[derive(Clone, Copy)]
struct Nearest {
    /// Distance of the centre from the triangle [texels]; 0 inside.
    outside: f64,
    /// The triangle, and barycentric coordinates of the centre.
    place: Option<(usize, [f64; 3])>,
}

impl Default for Nearest {
    fn default() -> Self {
        Self {
            outside: f64::INFINITY,
            place: None,
        }
    }
}

/// Assigns a triangle to the texels in and around it that have no nearer one.
fn spread(chart: &Chart, corners: [DVec2; 3], triangle: usize, nearest: &mut [Nearest]) {
    // A triangle without area in the chart covers no texel, and has no barycentric coordinates.
    let size = DVec2::new(chart.width as f64, chart.height as f64);
    let [a, b, c] = corners.map(|corner| corner * size);
    let doubled = (b - a).perp_dot(c - a);
    if doubled == 0.0 {
        return;
    }

    // Texels in a margin around the triangle take its colour as well: filters reach across its borders.
    let low = (a.min(b).min(c) - MARGIN_TEXELS).max(DVec2::ZERO);
    let high = (a.max(b).max(c) + MARGIN_TEXELS).min(size);
    for row in low.y as usize..high.y.ceil() as usize {
        for column in low.x as usize..high.x.ceil() as usize {
            let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let shares = [
                (c - b).perp_dot(centre - b) / doubled,
                (a - c).perp_dot(centre - c) / doubled,
                (b - a).perp_dot(centre - a) / doubled,
            ];
            // A barycentric coordinate times the height of its corner is the distance from the opposite side.
            let heights = [(b, c), (c, a), (a, b)].map(|(from, to)| doubled.abs() / from.distance(to));
            let depths = shares
                .into_iter()
                .zip(heights)
                .map(|(share, height)| -share * height);

            // The nearest triangle counts. Between those that contain the centre, the first does.
            let outside = depths.fold(0.0, f64::max);
            let known = &mut nearest[row * chart.width + column];
            if outside < known.outside && outside <= MARGIN_TEXELS {
                let place = Some((triangle, shares));
                *known = Nearest { outside, place };
            }
        }
    }
}

/// Encodes the texels of [`light_of`] as a PNG of a size [texels], and reports what it holds.
///
/// # Errors
/// A size that the format cannot hold.
pub fn encode(
    light: &[LinearSrgb],
    (width, height): (usize, usize),
    options: GlbOptions,
    exported: &mut ExportedMap,
) -> Result<Vec<u8>> {
    // White is chosen to clip a small share of the map's light, for finer steps in the dark; an exposure fixes it.
    let white = match options.carrier {
        Carrier::Unlit => 1.0,
        Carrier::LightMap | Carrier::Emissive => {
            let values = light.iter().flat_map(|light| light.to_array());
            white(values, options.cut).unwrap_or(1.0)
        }
    };

    // Light above white and colours outside of sRGB are lost, and counted for the report.
    let channels = || light.iter().flat_map(|light| light.to_array());
    let all: f64 = channels().map(|value| value.max(0.0)).sum();
    let above: f64 = channels().map(|value| (value - white).max(0.0)).sum();
    let count = |fits: &dyn Fn(f64) -> bool| {
        let has = |light: &&LinearSrgb| light.to_array().into_iter().any(fits);
        light.iter().filter(has).count()
    };

    // Values are stored relative to white, by which the intensity of the material multiplies them again.
    let relative: Vec<[f64; 3]> = light
        .iter()
        .map(|light| light.to_array().map(|value| (value / white).clamp(0.0, 1.0)))
        .collect();

    exported.intensity = white;
    exported.cut_texels = count(&|value| value > white);
    exported.cut_share = if all > 0.0 { above / all } else { 0.0 };
    exported.negative_texels = count(&|value| value < 0.0);

    // Eight bits need diffusion, since their steps show in dim light; steps of 1/65535 do not.
    let name = &exported.surface;
    match options.bits {
        Bits::Eight => png::<image::Rgb<u8>>(diffused(&relative, width), (width, height), name),
        Bits::Sixteen => {
            let code =
                |value: &f64| (LinearSrgb::encode_channel(*value) * f64::from(u16::MAX)).round() as u16;
            let codes = relative.as_flattened().iter().map(code).collect();
            png::<image::Rgb<u16>>(codes, (width, height), name)
        }
    }
}

fn png<P>(codes: Vec<P::Subpixel>, (width, height): (usize, usize), name: &str) -> Result<Vec<u8>>
where
    P: image::PixelWithColorType,
    [P::Subpixel]: image::EncodableLayout,
{
    files::png::<P>(width as u32, height as u32, codes).map_err(|why| {
        let what = format!("its map cannot be written ({why})");
        Error::failure(format!("surface `{name}`"), what, "bake smaller maps")
    })
}

/// Encodes values in [0, 1] with eight bits, row by row. The error of each code is diffused to its neighbours (Floyd
/// and Steinberg 1976) in linear light, so that means over a few texels are right however dark they are.
fn diffused(values: &[[f64; 3]], width: usize) -> Vec<u8> {
    let mut codes = Vec::with_capacity(3 * values.len());
    // One entry more on each side takes what is diffused across the border.
    let mut below = vec![[0.0; 3]; width + 2];
    for row in values.chunks(width) {
        let here = std::mem::replace(&mut below, vec![[0.0; 3]; width + 2]);
        let mut ahead = [0.0; 3];
        for (column, value) in row.iter().enumerate() {
            for channel in 0..3 {
                let wanted = value[channel] + here[column + 1][channel] + ahead[channel];
                let code = (LinearSrgb::encode_channel(wanted) * 255.0).round() as u8;
                let off = wanted - LinearSrgb::decode_channel(code);
                ahead[channel] = off * 7.0 / 16.0;
                below[column][channel] += off * 3.0 / 16.0;
                below[column + 1][channel] += off * 5.0 / 16.0;
                below[column + 2][channel] += off / 16.0;
                codes.push(code);
            }
        }
    }
    codes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bits_hold_the_mean_of_what_is_far_below_their_steps() {
        let (width, height) = (64, 64);
        for level in [2e-5, 1e-4, 1e-3, 0.02, 0.3, 1.0] {
            let values = vec![[level, 0.5 * level, 0.0]; width * height];
            let codes = diffused(&values, width);
            for (channel, wanted) in [(0, level), (1, 0.5 * level), (2, 0.0)] {
                let of_channel = codes.iter().skip(channel).step_by(3);
                let mean = of_channel
                    .map(|code| LinearSrgb::decode_channel(*code))
                    .sum::<f64>()
                    / 4096.0;
                // Half a step at a border is lost: 1/64 of the rows and columns.
                assert!(
                    (mean - wanted).abs() < 0.02 * wanted + 2e-6,
                    "{level}: {mean} of {wanted}"
                );
            }
        }
    }

    #[test]
    fn a_triangle_reaches_its_texels_and_those_beside_it() {
        let mut nearest = vec![Nearest::default(); 64];
        let chart = Chart {
            receiver: crate::illumination::Receiver::front(0),
            uv_set: crate::illumination::UvSet::Generated,
            corner_uvs: Vec::new(),
            width: 8,
            height: 8,
            texel_areas_m2: vec![1.0],
            layout: None,
            beyond: Vec::new(),
            joints: Vec::new(),
            islands: std::sync::OnceLock::new(),
        };
        let corners = [DVec2::ZERO, DVec2::new(0.5, 0.0), DVec2::new(0.0, 0.5)];
        spread(&chart, corners, 5, &mut nearest);
        assert_eq!(nearest[0].outside, 0.0);
        assert_eq!(nearest[0].place, Some((5, [0.75, 0.125, 0.125])));
        assert!(
            nearest[4].outside > 0.0 && nearest[4].outside < 1.0,
            "{}",
            nearest[4].outside
        );
        assert!(nearest[63].place.is_none());
    }
}
