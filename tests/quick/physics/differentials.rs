//! Ray differentials against finite differences of traced rays.

use std::sync::Arc;

use glam::DVec2;
use nephroid::light_pass::caustic::path::PathLimits;
use nephroid::light_pass::caustic::setup::{Aim, Aiming};
use nephroid::light_pass::wavefront::strand::{Landing, Strand};
use nephroid::light_pass::wavefront::trace::StrandTracer;
use nephroid::progress::Control;
use nephroid::scene::{Scene, builtin};
use nephroid::settings::ItemBufferKind;
use nephroid::transport::{EffectSet, Tracer};

use support::bump_scenes::by_image;

/// Compares derivatives of the strand that carries most, at places over the domain, with central differences over a
/// step of the unit square; returns the root mean square of the relative difference and how many places there were.
fn mismatch(scene: Scene, step: f64) -> (f64, usize) {
    let tracer = Tracer::new(Arc::new(scene));
    let aim = Aim::take(&tracer, ItemBufferKind::Equal, Aiming::Everything, true);
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
            let strand = |offset: DVec2| -> Option<Strand> {
                let sample = rays.trace(face, square + offset);
                sample
                    .strands
                    .iter()
                    .find(|strand| matches!(strand.landing, Landing::Receiver { .. }))
                    .copied()
            };
            let here = strand(DVec2::ZERO);
            for (axis, along) in [(0, DVec2::X), (1, DVec2::Y)] {
                let (Some(here), Some(before), Some(after)) =
                    (here, strand(along * -step), strand(along * step))
                else {
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
fn derivatives_are_those_of_the_smooth_surface() {
    // Mirror planes: exact. Curved mirrors and interfaces: to what the mesh and the step leave.
    for (name, step, largest) in [
        ("mirror", 1e-3, 1e-5),
        ("ring", 2e-3, 1e-3),
        ("paraboloid", 4e-3, 1e-3),
        ("ball", 2e-3, 5e-3),
        ("pool", 4e-3, 5e-3),
        // One quad: what is left is the step of the differences.
        ("pool-bump", 1e-4, 1e-5),
    ] {
        let (off, count) = mismatch(builtin::build(name).expect("a built-in scene"), step);
        println!("{name}: {off:.2e} over {count} places");
        assert!(count > 20, "{name}: only {count} places");
        assert!(off < largest, "{name}: derivatives are off by {off:.2e}");
    }
}

#[test]
fn derivatives_of_images_of_normals_are_those_between_their_texels() {
    for mirrored in [false, true] {
        // So short a step rarely leaves a texel.
        let (off, count) = mismatch(by_image(mirrored), 1e-7);
        println!("{off:.2e} over {count} places");
        assert!(count > 200 && off < 1e-3, "{off:.2e} over {count} places");
    }
}
