//! The brightest texel of the maps, and where it lies in the scene.

use glam::{DVec2, DVec3};

use crate::illumination::{Chart, IlluminationMap};
use crate::optics::luminance;
use crate::scene::Scene;

/// A point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrightSpot {
    /// [m].
    pub point: DVec3,
    /// Unit, on the side that the map belongs to.
    pub normal: DVec3,
    /// Luminance of the irradiance in all layers [W/m²].
    pub irradiance_w_m2: f64,
}

/// The centre of the brightest texel; `None` if the maps are dark.
pub fn find(scene: &Scene, maps: &[IlluminationMap]) -> Option<BrightSpot> {
    let brightest = maps.iter().filter_map(|map| {
        let total = map.total();
        let lit = (0..total.len()).filter(|texel| map.chart.texel_area_m2(*texel) > 0.0);
        let values = lit.map(|texel| (texel, luminance(&total[texel])));
        let (texel, value) = values
            .filter(|(_, value)| value.is_finite())
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((map, texel, value))
    });
    let (map, texel, irradiance_w_m2) = brightest.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let (point, normal) = surface_point(scene, &map.chart, texel)?;
    (irradiance_w_m2 > 0.0).then_some(BrightSpot {
        point,
        normal,
        irradiance_w_m2,
    })
}

/// The surface point at a texel's centre, or the nearest one if the centre is not covered.
fn surface_point(scene: &Scene, chart: &Chart, texel: usize) -> Option<(DVec3, DVec3)> {
    let uv = middle(chart, texel)?;
    let mesh = scene.objects.get(chart.object())?.mesh_in_scene();
    let within = |(triangle, corners): (usize, &[DVec2; 3])| {
        let shares = barycentric(corners, uv)?;
        let least = shares.into_iter().fold(f64::INFINITY, f64::min);
        Some((triangle, shares, least))
    };
    let triangles = chart.corner_uvs.iter().enumerate().filter_map(within);
    let (triangle, shares, _) = triangles.max_by(|a, b| a.2.total_cmp(&b.2))?;
    let shares = shares.map(|share| share.max(0.0));
    let sum: f64 = shares.iter().sum();
    let [a, b, c] = mesh.corners(triangle);
    let point = (a * shares[0] + b * shares[1] + c * shares[2]) / sum;
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some((point, normal * chart.receiver.side().sign()))
}

/// The centre of a texel in map coordinates.
fn middle(chart: &Chart, texel: usize) -> Option<DVec2> {
    let all = (0..chart.height).flat_map(|row| (0..chart.width).map(move |column| (column, row)));
    let mut of_texel = all.filter(|(column, row)| chart.texel_at(*column, *row) == texel);
    let (column, row) = of_texel.next()?;
    let level = chart
        .layout
        .as_ref()
        .map_or(0, |layout| layout.level_at(column, row));
    let half = 0.5 * f64::from(1_u32 << level);
    let size = DVec2::new(chart.width as f64, chart.height as f64);
    Some((DVec2::new(column as f64, row as f64) + half) / size)
}

/// Barycentric coordinates of a point; `None` if the triangle has no area.
fn barycentric([a, b, c]: &[DVec2; 3], point: DVec2) -> Option<[f64; 3]> {
    let (ab, ac, ap) = (*b - *a, *c - *a, point - *a);
    let area = ab.perp_dot(ac);
    if area == 0.0 {
        return None;
    }
    let (of_b, of_c) = (ap.perp_dot(ac) / area, ab.perp_dot(ap) / area);
    Some([1.0 - of_b - of_c, of_b, of_c])
}
