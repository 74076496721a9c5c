//! Sessions, settings and comparisons that tests of bakes share.

use nephroid::bake::Baker;
use nephroid::illumination::compare::relative_rmse;

use support::prelude::*;
use support::tools::{bake, bits, brute, caustic, map_of, set, settings};

pub fn session(scene: &Scene) -> Baker {
    Baker::new(Arc::new(scene.clone())).expect("a session")
}

pub fn run(session: &mut Baker, settings: &BakeSettings) -> Bake {
    session.bake(settings, &(), &Control::default()).expect("a bake")
}

/// Applies an edit to a session's scene.
pub fn edit(session: &mut Baker, edit: &Edit) {
    let scene = edit.apply(session.scene()).expect("a sound edit");
    session.set_scene(Arc::new(scene)).expect("a sound scene");
}

pub fn sized(settings: BakeSettings, (width, height): (usize, usize)) -> BakeSettings {
    let map_resolution = MapResolution::Fixed { width, height };
    set(settings, |s| s.map_resolution = map_resolution)
}

pub fn automatic(settings: BakeSettings) -> BakeSettings {
    set(settings, |s| s.map_resolution = MapResolution::Auto)
}

pub fn with_layers(layers: &[LayerKind], settings: BakeSettings) -> BakeSettings {
    set(settings, |s| s.layers = layers.to_vec())
}

pub const CAUSTIC_AND_DIRECT: [LayerKind; 2] = [LayerKind::Caustic, LayerKind::Direct];

/// Luminance of the floor's caustic [W/m²].
pub fn floor(result: &Bake, scene: &Scene) -> Vec<f64> {
    caustic(map_of(result, scene, "floor"))
}

/// The map of the same receiver.
pub fn same_map<'a>(result: &'a Bake, map: &IlluminationMap) -> Option<&'a IlluminationMap> {
    let mut maps = result.maps.iter();
    maps.find(|found| found.chart.receiver == map.chart.receiver)
}

/// Luminance of the same receiver's caustic [W/m²]; black where the result has none.
pub fn caustic_like(result: &Bake, map: &IlluminationMap) -> Vec<f64> {
    let dark = || vec![0.0; map.chart.texel_count()];
    let same = same_map(result, map).filter(|map| map.layer(LayerKind::Caustic).is_some());
    same.map_or_else(dark, caustic)
}

/// Root mean square of the difference over the reference's mean, texels weighing alike.
pub fn rmse(image: &[f64], reference: &[f64]) -> f64 {
    relative_rmse(image, reference).expect("a reference with light")
}

/// Relative RMSE of all maps that a result states.
pub fn estimate(result: &Bake) -> f64 {
    result.estimated_relative_rmse.expect("an estimate")
}

pub fn all_bits(result: &Bake) -> Vec<u32> {
    result.maps.iter().flat_map(bits).collect()
}

/// What differs between two results beside what they took; `None` where nothing does.
pub fn difference(a: &Bake, b: &Bake) -> Option<String> {
    if a.ledgers != b.ledgers {
        return Some(format!("ledgers: {:?} and {:?}", a.ledgers, b.ledgers));
    }
    let receivers = |result: &Bake| -> Vec<_> {
        let chart = |map: &IlluminationMap| (map.chart.receiver, map.width(), map.height(), map.layers.len());
        result.maps.iter().map(chart).collect()
    };
    if receivers(a) != receivers(b) {
        return Some(format!("maps of {:?} and {:?}", receivers(a), receivers(b)));
    }
    let estimates = [a, b].map(|result| result.estimated_relative_rmse);
    if estimates[0].map(f64::to_bits) != estimates[1].map(f64::to_bits) {
        return Some(format!("estimates: {estimates:?}"));
    }
    let error_bits = |map: &IlluminationMap| -> Option<Vec<u32>> {
        let error = map.error.as_ref()?;
        Some(error.iter().map(|e| e.to_bits()).collect())
    };
    a.maps.iter().zip(&b.maps).find_map(|(a, b)| {
        let what = if bits(a) != bits(b) {
            "map"
        } else if a.chart.layout != b.chart.layout {
            "tiles"
        } else if error_bits(a) != error_bits(b) {
            "error"
        } else {
            return None;
        };
        Some(format!("the {what} of {:?}", a.chart.receiver))
    })
}

#[track_caller]
pub fn assert_same(a: &Bake, b: &Bake, what: &str) {
    assert_eq!(difference(a, b), None, "{what}");
}

/// Fails unless a session now gives what a fresh bake of its scene gives.
#[track_caller]
pub fn assert_fresh(session: &mut Baker, settings: &BakeSettings, what: &str) -> (Bake, Bake) {
    let now = run(session, settings);
    let fresh = bake(Scene::clone(session.scene()), settings);
    assert_same(&now, &fresh, what);
    (now, fresh)
}

/// Relative RMSE of the floor's caustic against brute force, without the latter's noise, which must not hide more than
/// `most_noise`; and the watts of both.
pub fn off_brute_force(result: &Bake, scene: &Scene, rays: u64, most_noise: f64) -> (f64, [f64; 2]) {
    let side = map_of(result, scene, "floor").width();
    let reference = brute(scene, &settings(1.0, side), rays);
    let noise = map_of(&reference, scene, "floor").estimated_relative_rmse;
    let noise = noise.expect("a noise");
    assert!(noise < most_noise, "noise {noise}");
    let off = rmse(&floor(result, scene), &floor(&reference, scene));
    let deposited_w = [result, &reference].map(|result| result.ledgers[0].energy_w.deposited);
    ((off * off - noise * noise).max(0.0).sqrt(), deposited_w)
}

/// A torus whose outer radius is 0.98 of a size [m], around the y axis before it is turned.
pub fn torus(centre: DVec3, turn: DQuat, size: f64) -> Mesh {
    shapes::sheet(96, 48, |u, v| {
        let ((sine_u, cosine_u), (sine_v, cosine_v)) = (turned(u), turned(v));
        let outward = dvec3(cosine_u, 0.0, sine_u);
        let normal = outward * cosine_v + DVec3::Y * sine_v;
        let place = centre + turn * (outward + normal * 0.4) * (0.7 * size);
        (place, turn * normal)
    })
}

/// Sine and cosine of so many turns.
pub fn turned(turns: f64) -> (f64, f64) {
    (TAU * turns.fract()).sin_cos()
}
