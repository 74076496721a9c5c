//! What the picture takes of the eye's chains, as the panel lists it.

use crate::effect::EffectSwitch;
use crate::eye_pass::View;
use crate::eye_pass::renderer::EyeCounts;
use crate::plan;
use crate::scene::Scene;
use crate::session::{EffectCounts, EffectReport};

/// The decision for a view, with what exists for it on the device.
pub fn chains(scene: &Scene, view: &View, switch: EffectSwitch, counts: &EyeCounts) -> EffectReport {
    let aspect = f64::from(view.width) / f64::from(view.height);
    EffectReport {
        line: plan::chains(scene, Some((&view.camera, aspect)), switch),
        counts: EffectCounts {
            bytes: counts.chain_bytes,
            pipelines: Some(counts.specular_pipelines),
            gpu_ms: counts.gpu_ms.map(|times| times.specular),
            ..EffectCounts::default()
        },
    }
}
