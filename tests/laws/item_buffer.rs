//! Item buffers never miss what a light sees, and what they drop, no ray could have lit.

use nephroid::light_pass::emitter::Emitter;
use nephroid::light_pass::item_buffer::{CELLS_PER_SIDE, HiddenCellPolicy, ItemBuffer};
use nephroid::light_pass::launch::Launch;
use nephroid::settings::ItemBufferKind;

use support::laws::Table;
use support::laws::scenes::{Build, light, random};
use support::prelude::*;

pub fn fill(t: &mut Table) {
    t.case("item-buffer")
        .check("each point of a visible triangle is marked", points_marked);
    t.case("hidden-cells")
        .check(
            "every ray of a dropped cell ends on an opaque face",
            dropped_cells,
        )
        .check("a light that is shut in sees no caster", shut_in);
}

fn lamp(position: DVec3) -> Light {
    light(LightKind::Point {
        position,
        intensity: RadiantIntensity(1.0),
    })
}

fn mirror_mesh(triangles: &[[DVec3; 3]]) -> Mesh {
    let corner = 3 * triangles.len() as u32;
    Mesh {
        positions: triangles.concat(),
        normals: vec![DVec3::Y; 3 * triangles.len()],
        triangles: (0..corner)
            .step_by(3)
            .map(|first| [first, first + 1, first + 2])
            .collect(),
        ..Mesh::default()
    }
}

fn mirrors(triangles: &[[DVec3; 3]]) -> Scene {
    Scene::default().mirror(mirror_mesh(triangles))
}

fn launch(light: &Light, scene: &Scene, casters: &[usize], item_buffer: ItemBufferKind) -> Launch {
    let emitter = Emitter::middle(light, scene).expect("a light");
    Launch::new(emitter, scene, casters, item_buffer).expect("a domain")
}

fn equal(light: &Light, scene: &Scene) -> Launch {
    launch(light, scene, &[0], ItemBufferKind::Equal)
}

fn build(launch: &Launch, scene: &Scene) -> ItemBuffer {
    ItemBuffer::build(
        launch,
        &Tracer::new(Arc::new(scene.clone())),
        &[0],
        HiddenCellPolicy::Keep,
    )
}

/// A cloud of triangles.
fn cloud(seed: u64, count: usize, size: f64) -> Vec<[DVec3; 3]> {
    let mut random = random(seed);
    let mut point = |scale: f64| DVec3::from_array(std::array::from_fn(|_| (random() - 0.5) * scale));
    let mut triangle = || {
        let centre = point(2.0);
        std::array::from_fn(|_| centre + point(size))
    };
    (0..count).map(|_| triangle()).collect()
}

fn points_marked() {
    let mut random = random(7);
    for kind in [ItemBufferKind::Equal, ItemBufferKind::Cube] {
        for size in [1e-4, 1e-2, 0.3, 3.0] {
            let triangles = cloud(8, 300, size);
            let scene = mirrors(&triangles);
            let launch = launch(&lamp(dvec3(0.01, 0.02, -0.015)), &scene, &[0], kind);
            let buffer = build(&launch, &scene);
            for [corner, b, c] in &triangles {
                for _ in 0..20 {
                    let (s, t) = (random(), random());
                    let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
                    let target = *corner + (*b - *corner) * s + (*c - *corner) * t;
                    assert!(
                        marked_at(&launch, &buffer, target),
                        "{kind:?}, size {size}: {target}"
                    );
                }
            }
        }
    }
}

fn marked_at(launch: &Launch, buffer: &ItemBuffer, target: DVec3) -> bool {
    (0..launch.face_count()).any(|face| {
        let local = launch.to_face(face, target);
        if local.x.abs() > local.z || local.y.abs() > local.z {
            return false;
        }
        let square = launch.mapping().square_from_plane(local.truncate() / local.z) * CELLS_PER_SIDE as f64;
        let cell = |x: f64| (x as usize).min(CELLS_PER_SIDE - 1);
        buffer.is_marked(face, cell(square.x), cell(square.y))
    })
}

/// Marked cells of all faces.
fn marks(buffer: &ItemBuffer, faces: usize) -> Vec<(usize, usize, usize)> {
    let cells =
        (0..faces * CELLS_PER_SIDE).flat_map(|row| (0..CELLS_PER_SIDE).map(move |column| (row, column)));
    let cells = cells.map(|(row, column)| (row / CELLS_PER_SIDE, row % CELLS_PER_SIDE, column));
    cells
        .filter(|&(face, row, column)| buffer.is_marked(face, column, row))
        .collect()
}

/// Walls, an opaque ball and a box at random between a lamp and glass.
fn hidden_scene(seed: u64) -> Scene {
    let mut random = random(0x51de ^ seed << 16);
    let mut place = |height: f64| dvec3(1.4 * random() - 0.7, height, 1.4 * random() - 0.7);
    let ball = shapes::sphere(place(0.3), 0.12, 2);
    let mirror = shapes::rectangle(place(0.2), DVec3::X * 0.1, DVec3::Z * 0.1);
    let across = place(0.0).normalize();
    let wall = shapes::rectangle(place(0.9), across * 0.5, across.cross(DVec3::Y) * 0.4);
    let scene = Scene::default()
        .glass(1.5, ball)
        .mirror(mirror)
        .diffuse("wall", wall);
    let scene = scene.diffuse("round", shapes::sphere(place(0.8), 0.25, 3));
    let centre = place(0.7);
    let scene = scene.diffuse("box", shapes::cuboid(centre - 0.2, centre + 0.2));
    match seed % 4 {
        0 => scene.sun(place(-2.0)),
        _ => scene.lamp(place(1.6)),
    }
}

fn dropped_cells() {
    let mut dropped = 0;
    for seed in 0..60 {
        let scene = Arc::new(hidden_scene(seed));
        let tracer = Tracer::new(Arc::clone(&scene));
        let launch = launch(&scene.lights[0], &scene, &[0, 1], ItemBufferKind::Equal);
        let build = |hiding| ItemBuffer::build(&launch, &tracer, &[0, 1], hiding);
        let (kept, visible) = (build(HiddenCellPolicy::Keep), build(HiddenCellPolicy::Drop));
        assert_eq!(visible.marked_cells() + visible.hidden_cells, kept.marked_cells());
        let faces = launch.face_count();
        let [all, seen] = [marks(&kept, faces), marks(&visible, faces)];
        assert!(seen.iter().all(|cell| all.binary_search(cell).is_ok()));
        for (face, row, column) in all.into_iter().filter(|cell| seen.binary_search(cell).is_err()) {
            dropped += 1;
            for place in 0..49 {
                let within = dvec2(f64::from(place % 7), f64::from(place / 7)) / 6.0;
                let square = (dvec2(column as f64, row as f64) + within) / CELLS_PER_SIDE as f64;
                let ray = launch.ray(face, square.clamp(DVec2::splat(1e-9), DVec2::splat(1.0 - 1e-9)));
                let met = tracer
                    .closest_hit(&ray)
                    .map(|hit| scene.objects[hit.object].name.as_str());
                assert!(
                    matches!(met, Some("wall" | "round" | "box")),
                    "{seed}: a ray met {met:?}"
                );
            }
        }
    }
    assert!(dropped > 2_000, "{dropped} cells");
}

/// Round faces meet at some 600 corners, and edges that share their ends share their planes: no gap is left.
fn shut_in() {
    let scene = Scene::default().glass(1.5, shapes::sphere(DVec3::X, 0.3, 3));
    let scene = scene.diffuse("round", shapes::sphere(DVec3::ZERO, 0.2, 3));
    let lamp = parts::point_light("lamp", dvec3(0.01, 0.02, 0.03), Flux(1.0));
    let launch = equal(&lamp, &scene);
    let buffer = ItemBuffer::build(
        &launch,
        &Tracer::new(Arc::new(scene)),
        &[0],
        HiddenCellPolicy::Drop,
    );
    assert_eq!((buffer.marked_cells(), buffer.casters.len()), (0, 0));
    assert!(buffer.hidden_cells > 100);
}
