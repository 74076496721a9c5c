//! Chains from within glass and water and between mirrors: right, finite, and at an end.

use std::sync::Arc;

use nephroid::eye_pass::reference::{ChainLimits, ReferenceSettings, render};
use nephroid::transport::Tracer;

use crate::chain_laws;

#[test]
fn chains_keep_to_their_laws() {
    for law in chain_laws::all() {
        let tracer = Tracer::new(Arc::new(law.scene.clone()));
        let settings = ReferenceSettings {
            samples_per_side: 1,
            limits: ChainLimits {
                branch_threshold: 1e-10,
                ..Default::default()
            },
            ..Default::default()
        };
        let picture = render(&tracer, &[], &law.view, &settings, &(), &Default::default());
        law.assert_kept(&picture.expect("nobody cancels"), 1e-6);
    }
}
