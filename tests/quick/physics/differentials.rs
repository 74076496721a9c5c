//! Ray differentials against finite differences of traced rays.

use nephroid::light_pass::path::PathLimits;
use nephroid::light_pass::visibility::{CullMode, LightVisibility};
use nephroid::light_pass::wavefront::lattice_ray::{PathSegment, SegmentEnd};
use nephroid::light_pass::wavefront::trace::StrandTracer;
use nephroid::settings::ItemBufferKind;
use nephroid::transport::EffectSet;

use crate::prelude::*;
use support::effect_scenes::by_image;

/// Compares derivatives of the segment that carries most, at places over the domain, with central differences over a
/// step of the unit square; returns the root mean square of the relative difference and how many places there were.
fn mismatch(scene: Scene, step: f64) -> (f64, usize) {
    let tracer = Tracer::new(Arc::new(scene));
    let aim = LightVisibility::take(&tracer, ItemBufferKind::Equal, CullMode::Everything, true);
    let launch = &aim.lights[0].launch;
    let limits = PathLimits {
        max_depth: 4,
        branch_threshold: 0.5,
        effects: EffectSet::EVERYTHING,
        microfacets: None,
    };
    let control = Control::default();
    let rays = StrandTracer::new(&tracer, launch, limits, [2.0 * step; 2], &control);
    let (mut squares, mut count) = (0.0, 0);
    for face in 0..launch.face_count() {
        for index in 0..900 {
            let square = (DVec2::new((index % 30) as f64, (index / 30) as f64) + 0.47) / 30.0;
            let segment = |offset: DVec2| -> Option<PathSegment> {
                let sample = rays.trace(face, square + offset);
                let lands = |segment: &&PathSegment| matches!(segment.landing, SegmentEnd::Receiver { .. });
                sample.segments.iter().find(lands).copied()
            };
            for (axis, along) in [(0, DVec2::X), (1, DVec2::Y)] {
                let found = [DVec2::ZERO, along * -step, along * step].map(segment);
                let [Some(here), Some(before), Some(after)] = found else {
                    continue;
                };
                if before.signature != here.signature || after.signature != here.signature {
                    continue;
                }
                let derivative = [here.differential.across, here.differential.down][axis];
                let origin = (after.ray.origin - before.ray.origin) / (2.0 * step);
                let direction = (after.ray.direction - before.ray.direction) / (2.0 * step);
                let off = (derivative.origin - origin).length() + (derivative.direction - direction).length();
                squares += (off / (origin.length() + direction.length())).powi(2);
                count += 1;
            }
        }
    }
    ((squares / count as f64).sqrt(), count)
}

#[test]
fn derivatives_are_those_of_the_surface() {
    // Mirror planes: exact. Curved mirrors and interfaces: to what the mesh and the step leave.
    for (name, scene, step, largest, least_places) in [
        ("mirror", built_in("mirror"), 1e-3, 1e-5, 20),
        ("ring", built_in("ring"), 2e-3, 1e-3, 20),
        ("paraboloid", built_in("paraboloid"), 4e-3, 1e-3, 20),
        ("ball", built_in("ball"), 2e-3, 5e-3, 20),
        ("pool", built_in("pool"), 1e-4, 5e-3, 20),
        // One quad: what is left is the step of the differences.
        ("pool-bump", built_in("pool-bump"), 1e-4, 1e-5, 20),
        // Images of normals: so short a step rarely leaves a texel.
        ("image", by_image(false), 1e-7, 1e-3, 200),
        ("mirrored image", by_image(true), 1e-7, 1e-3, 200),
    ] {
        let (off, count) = mismatch(scene, step);
        assert!(count > least_places, "{name}: only {count} places");
        assert!(off < largest, "{name}: derivatives are off by {off:.2e}");
    }
}
