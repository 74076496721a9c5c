//! How far maps are from what they must be.

use glam::DVec3;

use crate::illumination::{IlluminationMap, Layer};
use crate::optics::LinearSrgb;
use crate::scene::Scene;
use crate::session::BakeResult;
use crate::settings::LayerKind;
use crate::study::agreement::{Agreement, TexelPair, pair_maps};

/// Deposited on all surfaces, over all lights [W].
pub fn deposited_w(result: &BakeResult) -> f64 {
    result
        .ledgers
        .iter()
        .map(|ledger| ledger.energy_w.deposited)
        .sum()
}

/// Emitted towards specular surfaces, over all lights [W].
pub fn emitted_w(result: &BakeResult) -> f64 {
    result.ledgers.iter().map(|ledger| ledger.energy_w.emitted).sum()
}

/// |actual − expected| over the expected.
pub fn off(actual: f64, expected: f64) -> f64 {
    (actual - expected).abs() / expected.abs()
}

/// Relative RMSE between the caustic maps of two bakes of the same surfaces; 0 where both are dark, infinite where one
/// is or where sizes differ.
pub fn apart(a: &BakeResult, b: &BakeResult) -> f64 {
    maps_apart(&a.maps, &b.maps, 1.0)
}

/// The same, of the second bake's maps times a factor.
pub fn maps_apart(maps: &[IlluminationMap], references: &[IlluminationMap], factor: f64) -> f64 {
    let Some(mut pairs) = pair_maps(maps, references) else {
        return f64::INFINITY;
    };
    for pair in &mut pairs {
        pair.reference *= factor;
    }
    if pairs
        .iter()
        .all(|pair| pair.image == 0.0 && pair.reference == 0.0)
    {
        return 0.0;
    }
    Agreement::of(&pairs).map_or(f64::INFINITY, |agreement| agreement.relative_rmse)
}

/// What both bakes think of their own errors, together.
pub fn estimates(a: &BakeResult, b: &BakeResult) -> f64 {
    let estimate = |result: &BakeResult| result.estimated_relative_rmse.unwrap_or(0.0);
    estimate(a) + estimate(b)
}

/// The caustic maps of one surface in several bakes, added up; a bake without one adds nothing.
pub fn map_sum(like: &IlluminationMap, bakes: &[BakeResult]) -> IlluminationMap {
    let mut irradiance = vec![[0.0_f32; 3]; like.chart.texel_count()];
    let maps = bakes.iter().flat_map(|bake| &bake.maps);
    let parts = maps.filter(|map| map.chart.receiver == like.chart.receiver);
    for layer in parts.filter_map(|map| map.layer(LayerKind::Caustic)) {
        for (total, part) in irradiance.iter_mut().zip(&layer.irradiance) {
            for channel in 0..3 {
                total[channel] += part[channel];
            }
        }
    }
    let mut sum = like.clone();
    sum.layers = vec![Layer {
        kind: LayerKind::Caustic,
        irradiance,
    }];
    sum
}

/// Whether two bakes gave the same maps, bit for bit.
pub fn same_bits(a: &BakeResult, b: &BakeResult) -> bool {
    let bits = |map: &IlluminationMap| -> Vec<u32> {
        let values = map
            .layers
            .iter()
            .flat_map(|layer| layer.irradiance.iter().flatten());
        values.map(|e| e.to_bits()).collect()
    };
    a.maps.len() == b.maps.len() && a.maps.iter().zip(&b.maps).all(|(a, b)| bits(a) == bits(b))
}

/// The map of the object of that name, if it received light.
pub fn map_of<'a>(result: &'a BakeResult, scene: &Scene, name: &str) -> Option<&'a IlluminationMap> {
    let mut maps = result.maps.iter();
    maps.find(|map| scene.objects[map.chart.object()].name == name)
}

/// Luminance of a layer, texel by texel [W/m²]; nothing where the surface received no light.
pub fn luminance(map: Option<&IlluminationMap>, kind: LayerKind) -> Vec<f64> {
    let layer = map.and_then(|map| map.layer(kind));
    let texels = layer.map_or(&[][..], |layer| &layer.irradiance);
    let of = |rgb: &[f32; 3]| LinearSrgb::from(rgb.map(f64::from)).luminance();
    texels.iter().map(of).collect()
}

/// Relative RMSE of the caustic layer of a floor, or of another rectangle whose TEXCOORD_0 run along its edges, against
/// what theory says of every point [W/m²]; each texel against the mean of 4 × 4 of its points.
pub fn against_theory(result: &BakeResult, scene: &Scene, name: &str, theory: impl Fn(DVec3) -> f64) -> f64 {
    const POINTS: usize = 4;
    let map = map_of(result, scene, name);
    let values = luminance(map, LayerKind::Caustic);
    let (Some(map), Some(object)) = (map, scene.objects.iter().find(|object| object.name == name)) else {
        return f64::INFINITY;
    };
    let Some((low, high)) = object.mesh.bounds() else {
        return f64::INFINITY;
    };
    let (width, height) = (map.width(), map.height());
    let pairs: Vec<TexelPair> = values
        .iter()
        .enumerate()
        .map(|(texel, image)| {
            let mean = (0..POINTS * POINTS).map(|point| {
                let u =
                    ((texel % width) as f64 + ((point % POINTS) as f64 + 0.5) / POINTS as f64) / width as f64;
                let v = ((texel / width) as f64 + ((point / POINTS) as f64 + 0.5) / POINTS as f64)
                    / height as f64;
                theory(low + (high - low) * DVec3::new(u, 0.0, v))
            });
            TexelPair {
                image: *image,
                reference: mean.sum::<f64>() / (POINTS * POINTS) as f64,
                area_m2: 1.0,
            }
        })
        .collect();
    Agreement::of(&pairs).map_or(f64::INFINITY, |agreement| agreement.relative_rmse)
}

/// Solid angle of triangles as seen from a point [sr], each as if nothing hid it (van Oosterom and Strackee 1983).
pub fn solid_angle_sr(mesh: &crate::scene::Mesh, eye: DVec3) -> f64 {
    let of = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner - eye);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below).abs()
    };
    (0..mesh.triangles.len()).map(of).sum()
}
