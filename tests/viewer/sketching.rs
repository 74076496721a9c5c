//! Where light lands, as it is drawn over the picture.

use std::sync::Arc;

use glam::DVec3;
use nephroid::light_pass::sketch::{SketchLimits, sketch};
use nephroid::progress::Control;
use nephroid::scene::builtin;
use nephroid::transport::Tracer;
use nephroid::viewer::sketching::Sketcher;

const LIMITS: SketchLimits = SketchLimits {
    max_depth: 8,
    branch_threshold: 0.05,
    cells: 3000,
};

fn tracer(name: &str) -> Arc<Tracer> {
    Arc::new(Tracer::new(Arc::new(
        builtin::build(name).expect("it is built in"),
    )))
}

/// A flat mirror throws no more and no less than the image of its lamp: mirrored at it, rays from the lamp go straight.
#[test]
fn what_a_flat_mirror_sends_lies_where_its_image_would_send_it() {
    let tracer = tracer("mirror");
    let scene = tracer.scene();
    let found = sketch(&tracer, LIMITS, &Control::default());
    assert!(
        found.rays > 500 && !found.patches.is_empty(),
        "{} rays",
        found.rays
    );
    let mirrors = scene.objects.iter().enumerate();
    let mut mirrors = mirrors
        .filter(|(object, _)| scene.material_of(*object).surface == nephroid::scene::SurfaceKind::Mirror);
    let (_, mirror) = mirrors.next().expect("there is a mirror");
    let [a, b, c] = mirror.mesh.corners(0);
    let normal = (b - a).cross(c - a).normalize();
    for landing in &found.landings {
        let lamp = scene.lights[landing.light].kind.position().expect("it is a lamp");
        let image = lamp - normal * (2.0 * (lamp - a).dot(normal));
        // Where the line from the image to the landing goes through the mirror's plane, the mirror is.
        let way = landing.point - image;
        let share = (a - image).dot(normal) / way.dot(normal);
        let met = image + way * share;
        let (low, high) = mirror.mesh.bounds().expect("it has corners");
        let within = met.cmpge(low - DVec3::splat(1e-6)).all() && met.cmple(high + DVec3::splat(1e-6)).all();
        assert!((0.0..=1.0).contains(&share) && within, "{landing:?} over {met}");
    }
}

/// Patches are spanned by landings, and four times the cells have patches of a quarter of the size.
#[test]
fn finer_lattices_have_smaller_patches_between_landings() {
    let tracer = tracer("ball");
    let sketched = |cells: usize| sketch(&tracer, SketchLimits { cells, ..LIMITS }, &Control::default());
    let (coarse, fine) = (sketched(1500), sketched(6000));
    assert!(
        fine.rays > 3 * coarse.rays && fine.rays < 5 * coarse.rays,
        "{} {}",
        coarse.rays,
        fine.rays
    );
    let landings: std::collections::HashSet<[u64; 3]> = coarse
        .landings
        .iter()
        .map(|landing| landing.point.to_array().map(f64::to_bits))
        .collect();
    for patch in &coarse.patches {
        for corner in patch.corners {
            assert!(
                landings.contains(&corner.to_array().map(f64::to_bits)),
                "{patch:?}"
            );
        }
    }
    let middling = |sketch: &nephroid::light_pass::sketch::Sketch| {
        let mut sides: Vec<f64> = sketch
            .patches
            .iter()
            .map(|patch| patch.corners[0].distance(patch.corners[1]))
            .collect();
        sides.sort_by(f64::total_cmp);
        sides[sides.len() / 2]
    };
    let ratio = middling(&coarse) / middling(&fine);
    assert!((1.5..2.7).contains(&ratio), "{ratio}");
    let none = Control::default();
    none.cancel();
    assert_eq!(sketch(&tracer, LIMITS, &none).rays, 0);
}

#[test]
fn it_is_found_once_for_the_same_surfaces_and_forgotten() {
    let surfaces = tracer("ring");
    let mut sketcher = Sketcher::new(Arc::new(|| {}));
    let start = std::time::Instant::now();
    while !sketcher.follow(&surfaces, LIMITS) {
        assert!(start.elapsed().as_secs() < 120, "it never comes");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let found = Arc::clone(sketcher.shown().expect("it was found"));
    assert!(!sketcher.follow(&surfaces, LIMITS) && !found.landings.is_empty());
    sketcher.forget();
    assert!(sketcher.shown().is_none());
}
