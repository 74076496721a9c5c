//! Waves of materials: `nephroid_waves` in a material's `extras`, a list of
//! `{ "amplitude_m", "wavelength_m", "direction": [x, y, z] or [x, z], "phase_rad", "period_s" or "depth_m" }` in the
//! file's world coordinates. `nephroid_swells: true` in a node's `extras` lifts its meshes by them, which are then stated as
//! they are in still water.

use std::sync::Arc;

use glam::DVec3;
use gltf::json::Value;
use serde::Deserialize;
use serde_json::json;

use super::context::LoadContext;
use super::extras;
use crate::scene::waves::gravity_period_s;
use crate::scene::{Scene, Wave, Waves};

/// Key of waves in the extras of a material.
pub const KEY: &str = "nephroid_waves";

/// Says in a node's extras that they lift its meshes.
pub const SWELLS_KEY: &str = "nephroid_swells";

/// A wave as stated in the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WaveEntry {
    amplitude_m: f64,
    wavelength_m: f64,
    direction: Vec<f64>,
    #[serde(default)]
    phase_rad: f64,
    /// 0 if the wave stands still; `None` if gravity moves it.
    period_s: Option<f64>,
    /// Depth of the water [m]; `None` for deep water.
    depth_m: Option<f64>,
}

/// Waves that a material states; `None`, with a warning, if any is invalid.
pub fn read(stated: &Value, owner: &str, load: &mut LoadContext) -> Option<Waves> {
    let waves = Vec::<WaveEntry>::deserialize(stated)
        .map_err(|error| format!("its `{KEY}` cannot be read ({error})"))
        .and_then(|list| list.iter().map(wave).collect())
        .and_then(|waves| Waves::new(waves).map_err(|why| format!("of its `{KEY}`, {why}")));
    waves
        .map_err(|why| {
            load.warn(
                owner,
                format!("{why}: it has none"),
                "give up to 8 waves of amplitude_m, wavelength_m, direction [x, z] or [x, y, z], phase_rad, \
                 period_s or depth_m, with slopes amplitude_m·2π/wavelength_m of at most 1 altogether",
            );
        })
        .ok()
}

/// Lifts the objects of nodes that ask for it; `nodes` are their extras.
pub fn displace(scene: &mut Scene, nodes: &[Value], load: &mut LoadContext) {
    for index in 0..scene.objects.len() {
        let object = &scene.objects[index];
        if extras::stated(nodes, object.node, SWELLS_KEY) != Some(&Value::Bool(true)) {
            continue;
        }
        if scene.material_of(index).waves.is_some() {
            scene.swells.insert(index, Arc::clone(object.mesh()));
        } else {
            load.warn(
                format!("object `{}`", object.name),
                format!("has `{SWELLS_KEY}`, but its material has no `{KEY}`: it stays still"),
                "give its material waves",
            );
        }
    }
    scene.displace_by_waves();
}

fn wave(stated: &WaveEntry) -> Result<Wave, String> {
    let direction = match stated.direction[..] {
        [x, z] => DVec3::new(x, 0.0, z),
        [x, y, z] => DVec3::new(x, y, z),
        _ => DVec3::ZERO,
    };
    let direction = direction
        .try_normalize()
        .ok_or_else(|| format!("of its `{KEY}`, a direction is none"))?;
    let depth_m = stated.depth_m.unwrap_or(f64::INFINITY);
    if depth_m.is_nan() || depth_m <= 0.0 {
        return Err(format!("of its `{KEY}`, a depth of {depth_m} m is none"));
    }
    Ok(Wave {
        amplitude_m: stated.amplitude_m,
        wavelength_m: stated.wavelength_m,
        direction,
        phase_rad: stated.phase_rad,
        period_s: stated
            .period_s
            .unwrap_or_else(|| gravity_period_s(stated.wavelength_m, depth_m)),
    })
}

/// Waves as a file states them; `shift` leads from scene to world coordinates [m].
pub fn written(waves: &Waves, shift: DVec3) -> Value {
    let stated = Vec::<Wave>::from(waves.with_origin(-shift));
    let wave = |wave: &Wave| {
        json!({ "amplitude_m": wave.amplitude_m, "wavelength_m": wave.wavelength_m,
            "direction": wave.direction.to_array(), "phase_rad": wave.phase_rad, "period_s": wave.period_s })
    };
    stated.iter().map(wave).collect()
}
