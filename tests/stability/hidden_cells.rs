//! What an item buffer drops, no ray could have lit.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::light_pass::emitter::Emitter;
use nephroid::light_pass::item_buffer::{CELLS_PER_SIDE, Hiding, ItemBuffer};
use nephroid::light_pass::launch::Launch;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, Scene};
use nephroid::settings::ItemBufferKind;
use nephroid::transport::Tracer;
use nephroid::units::{Flux, Irradiance};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Walls, an opaque ball and a box at random between a lamp and glass.
fn hidden_scene(seed: u64) -> Scene {
    let mut random = Pcg64Mcg::seed_from_u64(0x51de ^ seed << 16);
    let mut between = |low: f64, high: f64| {
        let unit = (random.next_u64() >> 11) as f64 * (-53_f64).exp2();
        low + (high - low) * unit
    };
    let mut scene = Scene::default();
    let matte = || parts::matte("matte", LinearSrgb::grey(0.5));
    let mut place = |height: f64| DVec3::new(between(-0.7, 0.7), height, between(-0.7, 0.7));
    let glass = parts::dielectric("glass", 1.5);
    parts::add(&mut scene, "ball", shapes::sphere(place(0.3), 0.12, 2), glass);
    parts::add(
        &mut scene,
        "mirror",
        shapes::rectangle(place(0.2), DVec3::X * 0.1, DVec3::Z * 0.1),
        parts::mirror(),
    );
    let across = place(0.0).normalize();
    let down = across.cross(DVec3::Y);
    parts::add(
        &mut scene,
        "wall",
        shapes::rectangle(place(0.9), across * 0.5, down * 0.4),
        matte(),
    );
    parts::add(&mut scene, "round", shapes::sphere(place(0.8), 0.25, 3), matte());
    let centre = place(0.7);
    parts::add(
        &mut scene,
        "box",
        shapes::cuboid(centre - 0.2, centre + 0.2),
        matte(),
    );
    scene.lights.push(if seed.is_multiple_of(4) {
        parts::sun("sun", place(-2.0), Irradiance(1.0))
    } else {
        parts::point_light("lamp", place(1.6), Flux(1.0))
    });
    scene
}

#[test]
fn every_ray_of_a_dropped_cell_ends_on_an_opaque_face() {
    let (mut dropped, mut rays) = (0, 0);
    for seed in 0..60 {
        let scene = Arc::new(hidden_scene(seed));
        let tracer = Tracer::new(Arc::clone(&scene));
        let casters = [0, 1];
        let launch = launch(&scene.lights[0], &scene, &casters, ItemBufferKind::Equal).expect("casters");
        let [kept, visible] =
            [Hiding::Keep, Hiding::Drop].map(|hiding| ItemBuffer::build(&launch, &tracer, &casters, hiding));
        assert!(visible.marked_cells() + visible.hidden_cells == kept.marked_cells());
        for face in 0..launch.face_count() {
            for cell in 0..CELLS_PER_SIDE * CELLS_PER_SIDE {
                let (column, row) = (cell % CELLS_PER_SIDE, cell / CELLS_PER_SIDE);
                assert!(kept.is_marked(face, column, row) || !visible.is_marked(face, column, row));
                if !kept.is_marked(face, column, row) || visible.is_marked(face, column, row) {
                    continue;
                }
                dropped += 1;
                for place in 0..49 {
                    let within = DVec2::new(f64::from(place % 7), f64::from(place / 7)) / 6.0;
                    let square = (DVec2::new(column as f64, row as f64) + within) / CELLS_PER_SIDE as f64;
                    let hit = tracer.closest_hit(
                        &launch.ray(face, square.clamp(DVec2::splat(1e-9), DVec2::splat(1.0 - 1e-9))),
                    );
                    let met = hit.map(|hit| scene.objects[hit.object].name.as_str());
                    assert!(
                        matches!(met, Some("wall" | "round" | "box")),
                        "{seed}: a ray met {met:?}"
                    );
                    rays += 1;
                }
            }
        }
    }
    assert!(dropped > 2_000, "{dropped} cells, {rays} rays");
}

#[test]
fn a_light_that_opaque_faces_shut_in_sees_no_caster() {
    let mut scene = Scene::default();
    let glass = parts::dielectric("glass", 1.5);
    parts::add(&mut scene, "ball", shapes::sphere(DVec3::X, 0.3, 3), glass);
    let matte = parts::matte("matte", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "round", shapes::sphere(DVec3::ZERO, 0.2, 3), matte);
    scene.lights.push(parts::point_light(
        "lamp",
        DVec3::new(0.01, 0.02, 0.03),
        Flux(1.0),
    ));
    let launch = launch(&scene.lights[0], &scene, &[0], ItemBufferKind::Equal).expect("a caster");
    let tracer = Tracer::new(Arc::new(scene));
    let buffer = ItemBuffer::build(&launch, &tracer, &[0], Hiding::Drop);
    // Round faces meet at some 600 corners, and edges that share their ends share their planes: no gap is left.
    assert_eq!((buffer.marked_cells(), buffer.casters.len()), (0, 0));
    assert!(buffer.hidden_cells > 100);
}

fn launch(light: &Light, scene: &Scene, casters: &[usize], item_buffer: ItemBufferKind) -> Option<Launch> {
    Launch::new(Emitter::middle(light, scene)?, scene, casters, item_buffer)
}
