//! Maps by brute force.

use std::sync::Arc;

use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::BakeResult;
use nephroid::settings::BakeSettings;
use nephroid::study::brute_force::brute_force;
use nephroid::transport::Tracer;

/// A scene's maps by brute force.
pub fn brute(scene: &Scene, settings: &BakeSettings, rays: u64) -> BakeResult {
    let tracer = Tracer::new(Arc::new(scene.clone()));
    brute_force(&tracer, settings, rays, &(), &Control::default()).expect("a reference")
}
