//! What two bakes have to have in common, and how far they are apart.

use std::collections::BTreeMap;

use nephroid::illumination::{IlluminationMap, Side};
use nephroid::optics::LinearSrgb;
use nephroid::scene::Scene;
use nephroid::session::BakeResult;
use nephroid::settings::LayerKind;

use crate::support::evidence::keep_images;

/// A bake with its scene, whose objects have different names.
pub struct Baked {
    pub scene: Scene,
    pub result: BakeResult,
}

/// A map by its object's name and its side.
type Key = (String, Side);

impl Baked {
    /// All maps, whatever the order of objects.
    fn maps(&self) -> BTreeMap<Key, &IlluminationMap> {
        let key = |map: &IlluminationMap| {
            let name = self.scene.objects[map.chart.object()].name.clone();
            (name, map.chart.receiver.side())
        };
        self.result.maps.iter().map(|map| (key(map), map)).collect()
    }

    /// Whether a layer of a map has light.
    pub fn is_lit(&self) -> bool {
        let layers = self.result.maps.iter().flat_map(|map| &map.layers);
        layers
            .flat_map(|layer| layer.irradiance.as_flattened())
            .any(|e| *e > 0.0)
    }
}

/// The first number that is none, if there is one: in maps, their errors, accounts and estimates. No luminance is below 0
/// by more than rounding, nor any channel unless light is split into colours that no screen has.
pub fn number_fault(baked: &Baked, is_dispersive: bool) -> Option<String> {
    for ((name, side), map) in baked.maps() {
        for layer in &map.layers {
            let is_light = |texel: &[f32; 3]| {
                let channels = texel.map(f64::from);
                let size = channels
                    .iter()
                    .fold(0.0_f64, |size, channel| size.max(channel.abs()));
                let least = if is_dispersive {
                    LinearSrgb::from(channels).luminance()
                } else {
                    min_of(channels)
                };
                size.is_finite() && least >= -f64::from(f32::EPSILON) * size
            };
            if let Some(texel) = layer.irradiance.iter().find(|texel| !is_light(texel)) {
                return Some(format!(
                    "{texel:?} in the {:?} layer of {name}, {side:?}",
                    layer.kind
                ));
            }
        }
        let is_error = |value: &&f32| value.is_finite() && **value >= 0.0;
        if let Some(value) = map.error.iter().flatten().find(|value| !is_error(value)) {
            return Some(format!("{value} in the error of {name}, {side:?}"));
        }
    }
    let estimates = baked.result.maps.iter().map(|map| map.estimated_relative_rmse);
    let mut estimates = estimates.chain([baked.result.estimated_relative_rmse]).flatten();
    if let Some(estimate) = estimates.find(|estimate| !(estimate.is_finite() && *estimate >= 0.0)) {
        return Some(format!("an error is estimated as {estimate}"));
    }
    baked.result.ledgers.iter().find_map(|ledger| {
        let energy = &ledger.energy_w;
        let truncated = energy.truncated.total();
        let accounts = [
            energy.emitted,
            energy.deposited,
            energy.absorbed,
            energy.escaped,
            truncated,
        ];
        let mut all = accounts.into_iter().chain([ledger.not_emitted_w]);
        let bad = all.find(|account| !account.is_finite())?;
        Some(format!("{bad} W in {ledger:?}"))
    })
}

fn min_of(values: [f64; 3]) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

/// The first difference between a bake and another whose every value is `factor` times as large, if there is one; not
/// a bit may be different. The object names tell maps, whatever their order.
pub fn bit_fault(law: &str, one: &Baked, other: &Baked, factor: f32) -> Option<String> {
    layer_fault(law, one, other, |value, expected| {
        (value * factor).to_bits() == expected.to_bits()
    })
}

/// The same with two bakes, whose values add up to those of the third but for the rounding of single precision.
pub fn sum_fault(law: &str, parts: [&Baked; 2], whole: &Baked) -> Option<String> {
    let of_parts = parts.map(Baked::maps);
    let of_whole = whole.maps();
    let mut keys = of_parts.iter().flat_map(BTreeMap::keys);
    if let Some((name, side)) = keys.find(|key| !of_whole.contains_key(key)) {
        return Some(format!(
            "{law}: {name}, {side:?} is lit by one lamp and not by both"
        ));
    }
    of_whole.into_iter().find_map(|(key, map)| {
        let mut layers = map.layers.iter();
        layers.find_map(|layer| {
            let dark = vec![[0.0; 3]; layer.irradiance.len()];
            let [one, other] = of_parts.each_ref().map(|maps| {
                let part = maps.get(&key).and_then(|map| map.layer(layer.kind));
                part.map_or(&dark, |part| &part.irradiance)
            });
            let sums = one.as_flattened().iter().zip(other.as_flattened());
            let mut all = layer.irradiance.as_flattened().iter().zip(sums);
            let is_off = |value: f32, a: f32, b: f32| {
                let most = 4.0 * f32::EPSILON * (a.abs() + b.abs()) + f32::MIN_POSITIVE;
                (value - (a + b)).abs() > most
            };
            let (value, (a, b)) = all.find(|(value, (a, b))| is_off(**value, **a, **b))?;
            let expected = added(one, other);
            let files = keep_images(law, &layer.irradiance, &expected, map.chart.width);
            Some(format!(
                "{law}: {key:?}, {:?}: {value} and not {a} + {b}; {files}",
                layer.kind
            ))
        })
    })
}

fn added(one: &[[f32; 3]], other: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let sum = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|channel| a[channel] + b[channel]);
    one.iter().zip(other).map(sum).collect()
}

/// The first map or layer that only one of two bakes has, or whose values are not alike, if there is one.
fn layer_fault(
    law: &str,
    one: &Baked,
    other: &Baked,
    are_alike: impl Fn(f32, f32) -> bool,
) -> Option<String> {
    let (maps, others) = (one.maps(), other.maps());
    if maps.keys().ne(others.keys()) {
        return Some(format!(
            "{law}: maps of {:?} and of {:?}",
            maps.keys().collect::<Vec<_>>(),
            others.keys().collect::<Vec<_>>()
        ));
    }
    for (((name, side), map), other) in maps.iter().zip(others.values()) {
        if map.layers.len() != other.layers.len() {
            return Some(format!("{law}: {name}, {side:?} has other layers"));
        }
        for (layer, expected) in map.layers.iter().zip(&other.layers) {
            let pairs = layer.irradiance.as_flattened().iter();
            let mut pairs = pairs.zip(expected.irradiance.as_flattened());
            if let Some((value, expected_value)) = pairs.find(|(a, b)| !are_alike(**a, **b)) {
                let files = keep_images(law, &layer.irradiance, &expected.irradiance, map.chart.width);
                return Some(format!(
                    "{law}: {:?} layer of {name}, {side:?}: {value:e} and {expected_value:e}; {files}",
                    layer.kind
                ));
            }
        }
    }
    None
}

/// How far the caustic layers of two bakes of one scene are apart.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// sqrt(mean((A − B)²)) / mean(B), over all maps by area [1].
    pub relative_rmse: f64,
    /// Sum of what both bakes estimate of themselves [1].
    pub estimated: f64,
}

/// The distance of two bakes, the values of the first multiplied by a factor; `None` where one of both has no light or
/// no estimate.
pub fn distance(one: &Baked, other: &Baked, factor: f64) -> Option<Distance> {
    let estimate = |baked: &Baked| baked.result.estimated_relative_rmse;
    let estimated = estimate(one)? + estimate(other)?;
    let (maps, others) = (one.maps(), other.maps());
    let mut keys: Vec<&Key> = maps.keys().chain(others.keys()).collect();
    keys.sort();
    keys.dedup();
    let (mut squares, mut flux, mut area) = (0.0, 0.0, 0.0);
    for key in keys {
        let (a, b) = (maps.get(key), others.get(key));
        let chart = &b.or(a)?.chart;
        let values = |map: Option<&&IlluminationMap>| luminance(map, chart.texel_count());
        let larger = if b.is_some() { 1.0 } else { factor };
        for (texel, (a, b)) in values(a).into_iter().zip(values(b)).enumerate() {
            let texel_m2 = chart.texel_area_m2(texel) * larger;
            squares += (a * factor - b) * (a * factor - b) * texel_m2;
            flux += b * texel_m2;
            area += texel_m2;
        }
    }
    (flux > 0.0).then(|| Distance {
        relative_rmse: (squares * area).sqrt() / flux,
        estimated,
    })
}

fn luminance(map: Option<&&IlluminationMap>, texels: usize) -> Vec<f64> {
    let layer = map.and_then(|map| map.layer(LayerKind::Caustic));
    let Some(layer) = layer else {
        return vec![0.0; texels];
    };
    let of = |texel: &[f32; 3]| LinearSrgb::from(texel.map(f64::from)).luminance();
    layer.irradiance.iter().map(of).collect()
}
