//! Where light lands, as it is drawn over the picture.

use std::collections::HashSet;

use nephroid::light_pass::sketch::{Sketch, SketchLimits, sketch};
use nephroid::viewer::background::Wake;
use nephroid::viewer::sketching::Sketcher;

use super::*;

const LIMITS: SketchLimits = SketchLimits {
    max_depth: 8,
    branch_threshold: 0.05,
    cells: 3000,
};

fn tracer(name: &str) -> Arc<Tracer> {
    Arc::new(Tracer::new(options(name).scene))
}

/// Mirrored at it, rays from the lamp go straight: landings lie on lines from the lamp's image through the mirror.
#[test]
fn flat_mirrors_send_light_as_from_an_image() {
    let tracer = tracer("mirror");
    let scene = tracer.scene();
    let found = sketch(&tracer, LIMITS, &Control::default());
    assert!(
        found.rays > 500 && !found.patches.is_empty(),
        "{} rays",
        found.rays
    );
    let is_mirror = |object: &usize| scene.material_of(*object).surface == SurfaceKind::Mirror;
    let mirror = (0..scene.objects.len())
        .find(is_mirror)
        .expect("there is a mirror");
    let mirror = scene.objects[mirror].mesh_in_scene();
    let [a, b, c] = mirror.corners(0);
    let normal = (b - a).cross(c - a).normalize();
    let (low, high) = mirror.bounds().expect("it has corners");
    for landing in &found.landings {
        let lamp = scene.lights[landing.light].kind.position().expect("it is a lamp");
        let image = lamp - normal * (2.0 * (lamp - a).dot(normal));
        let way = landing.point - image;
        let share = (a - image).dot(normal) / way.dot(normal);
        let met = image + way * share;
        let margin = DVec3::splat(1e-6);
        let within = met.cmpge(low - margin).all() && met.cmple(high + margin).all();
        assert!((0.0..=1.0).contains(&share) && within, "{landing:?} over {met}");
    }
}

/// Four times the cells have patches of a quarter of the size.
#[test]
fn finer_lattices_have_smaller_patches() {
    let tracer = tracer("ball");
    let sketched = |cells: usize| sketch(&tracer, SketchLimits { cells, ..LIMITS }, &Control::default());
    let (coarse, fine) = (sketched(1500), sketched(6000));
    let times = fine.rays as f64 / coarse.rays as f64;
    assert!(times > 3.0 && times < 5.0, "{times}");
    let bits = |point: DVec3| point.to_array().map(f64::to_bits);
    let landings = coarse.landings.iter().map(|landing| bits(landing.point));
    let landings: HashSet<_> = landings.collect();
    for patch in &coarse.patches {
        let mut corners = patch.corners.iter();
        assert!(
            corners.all(|corner| landings.contains(&bits(*corner))),
            "{patch:?}"
        );
    }
    let middling = |sketch: &Sketch| {
        let sides = sketch.patches.iter();
        let mut sides: Vec<f64> = sides
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
fn found_once_for_the_same_surfaces() {
    let surfaces = tracer("ring");
    let mut sketcher = Sketcher::new(&Wake::new(|| ()));
    wait_for("the sketch", || sketcher.follow(&surfaces, LIMITS));
    let found = Arc::clone(sketcher.shown().expect("it was found"));
    assert!(!sketcher.follow(&surfaces, LIMITS) && !found.landings.is_empty());
    sketcher.forget();
    assert!(sketcher.shown().is_none());
}
