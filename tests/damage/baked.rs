//! What loads can be baked: a scene whose damage went unnoticed keeps the laws all the same.

use std::sync::Arc;

use nephroid::error::Result;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};

use crate::tools::energy_fault;

/// More triangles take longer than there is time for in each of thousands of tries.
const MOST_TRIANGLES: usize = 3_000;

/// Memory that such a bake may take [bytes].
pub const MOST_BYTES: usize = 512 << 20;

/// The least that can be asked for.
fn settings() -> BakeSettings {
    BakeSettings {
        density_per_sr: 20.0,
        map_resolution: MapResolution::Fixed { width: 8, height: 8 },
        max_depth: 3,
        wavefronts: Some(1),
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        memory_bytes: 64 << 20,
        threads: 2,
        ..BakeSettings::default()
    }
}

/// Whether a scene is small enough to be tried.
pub fn is_small(scene: &Scene) -> bool {
    scene.triangle_count() <= MOST_TRIANGLES && scene.lights.len() <= 8
}

/// Bakes it.
pub fn bake(scene: Scene) -> Result<BakeResult> {
    BakeSession::new(Arc::new(scene))?.bake(&settings(), &(), &Control::default())
}

/// The first number that is none, or an open ledger, if there is one.
pub fn fault(result: &BakeResult) -> Option<String> {
    let layers = result.maps.iter().flat_map(|map| &map.layers);
    let mut values = layers.flat_map(|layer| layer.irradiance.as_flattened());
    match values.find(|value| !value.is_finite()) {
        Some(value) => Some(format!("{value} in a map")),
        None => energy_fault(result),
    }
}
