//! Item buffers never miss what a light sees, and what they drop, no ray could have lit.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::geometry::cube_face::{self, FaceMapping};
use nephroid::light_pass::emitter::Emitter;
use nephroid::light_pass::item_buffer::{CELLS_PER_SIDE, HiddenCellPolicy, ItemBuffer};
use nephroid::light_pass::launch::Launch;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, Material, Mesh, Scene};
use nephroid::settings::ItemBufferKind;
use nephroid::transport::Tracer;
use nephroid::units::{Flux, Irradiance, RadiantIntensity};

use support::laws::Table;
use support::laws::law::off;
use support::laws::scenes::{Build, light, random};

const MAPPINGS: [FaceMapping; 2] = [FaceMapping::EqualSolidAngle, FaceMapping::Plain];

pub fn fill(t: &mut Table) {
    t.case("cells-of-a-cube")
        .fact("solid angles sum to the sphere", 1e-12, solid_angles_of_all)
        .fact(
            "solid angle of a cell is that of its rectangle",
            1e-6,
            solid_angle_of_one,
        )
        .fact("mappings of a face are inverted", 1e-12, mappings_inverted);
    t.case("item-buffer")
        .check("each point of a visible triangle is marked", points_marked)
        .check("a small mirror marks few cells", few_cells)
        .check("a light on the mirror sees it", light_on_mirror)
        .check("spans hold every cell that touches a marked one", spans)
        .check("the whole marks what its triangles mark", whole_and_parts)
        .check("diffuse surfaces mark nothing", diffuse_marks_nothing)
        .check("objects beside a cone are no casters", beside_a_cone);
    t.case("hidden-cells")
        .check(
            "every ray of a dropped cell ends on an opaque face",
            dropped_cells,
        )
        .check("a light that is shut in sees no caster", shut_in);
}

fn solid_angles_of_all() -> f64 {
    let of = |mapping: FaceMapping, side: usize| {
        let corner = |index: usize| DVec2::new((index % side) as f64, (index / side) as f64) / side as f64;
        let cell = |index| mapping.cell_solid_angle_sr(corner(index), corner(index) + 1.0 / side as f64);
        off(
            6.0 * (0..side * side).map(cell).sum::<f64>(),
            4.0 * std::f64::consts::PI,
        )
    };
    let all = MAPPINGS
        .into_iter()
        .flat_map(|mapping| [1, 7, 128].map(|side| of(mapping, side)));
    all.fold(0.0, f64::max)
}

/// Thin columns are exact rectangles in x; within them the share of v must be the share of solid angle.
fn solid_angle_of_one() -> f64 {
    let mapping = FaceMapping::EqualSolidAngle;
    let width = 1e-5;
    let mut worst: f64 = 0.0;
    for u in [0.0, 0.13, 0.5, 0.77, 1.0 - width] {
        for (v0, v1) in [(0.0, 0.25), (0.25, 0.5), (0.4, 0.9), (0.9, 1.0)] {
            let plane = |u, v| mapping.plane_from_square(DVec2::new(u, v));
            let middle = |v| plane(u + 0.5 * width, v).y;
            let (low, high) = (
                DVec2::new(plane(u, v0).x, middle(v0)),
                DVec2::new(plane(u + width, v1).x, middle(v1)),
            );
            let stated = mapping.cell_solid_angle_sr(DVec2::new(u, v0), DVec2::new(u + width, v1));
            worst = worst.max(off(cube_face::rectangle_solid_angle_sr(low, high), stated));
        }
    }
    worst
}

fn mappings_inverted() -> f64 {
    let of = |mapping: FaceMapping, index: i32| {
        let square = DVec2::new(f64::from(index % 21), f64::from(index / 21)) / 20.0;
        let plane = mapping.plane_from_square(square);
        let beyond = (plane.abs().max_element() - 1.0).max(0.0);
        beyond.max((mapping.square_from_plane(plane) - square).abs().max_element())
    };
    let all = MAPPINGS
        .into_iter()
        .flat_map(|mapping| (0..441).map(move |index| of(mapping, index)));
    all.fold(0.0, f64::max)
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
            let launch = launch(&lamp(DVec3::new(0.01, 0.02, -0.015)), &scene, &[0], kind);
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

fn few_cells() {
    let a = DVec3::new(1.0, 0.2, 0.3);
    let scene = mirrors(&[[a, a + DVec3::Y * 0.01, a + DVec3::Z * 0.01]]);
    let marked = build(&equal(&lamp(DVec3::ZERO), &scene), &scene).marked_cells();
    assert!((1..=4).contains(&marked), "{marked} cells");
}

fn light_on_mirror() {
    let scene = mirrors(&[[DVec3::ZERO, DVec3::X, DVec3::Z]]);
    for position in [DVec3::ZERO, DVec3::new(0.3, 0.0, 0.3), DVec3::new(0.5, 0.0, 0.0)] {
        let buffer = build(&equal(&lamp(position), &scene), &scene);
        assert!(buffer.marked_cells() > 0, "nothing marked from {position}");
    }
}

fn spans() {
    let a = DVec3::new(1.0, 0.2, 0.3);
    let scene = mirrors(&[[a, a + DVec3::Y * 0.3, a + DVec3::Z * 0.1]]);
    let buffer = build(&equal(&lamp(DVec3::ZERO), &scene), &scene);
    let overlaps =
        |i: usize, n: usize, k: usize| i * CELLS_PER_SIDE < (k + 1) * n && k * n < (i + 1) * CELLS_PER_SIDE;
    for (width, height) in [(1, 1), (5, 3), (128, 128), (300, 301), (1000, 77)] {
        for (face, row) in (0..6).flat_map(|face| (0..height).map(move |row| (face, row))) {
            let spans = buffer.lattice_spans(face, row, (width, height));
            assert!(
                spans.windows(2).all(|pair| pair[0].1 < pair[1].0),
                "spans overlap: {spans:?}"
            );
            for column in 0..width {
                let is_listed = spans.iter().any(|span| (span.0..span.1).contains(&column));
                let mut rows = (0..CELLS_PER_SIDE).filter(|&cell| overlaps(row, height, cell));
                let touches = rows.any(|cell_row| {
                    let mut columns = (0..CELLS_PER_SIDE).filter(|&cell| overlaps(column, width, cell));
                    columns.any(|cell| buffer.is_marked(face, cell, cell_row))
                });
                assert_eq!(is_listed, touches, "{width} × {height}: {column} {row}");
            }
        }
    }
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

fn spot(outer_cone_rad: f64, position: DVec3, direction: DVec3) -> Light {
    light(LightKind::Spot {
        position,
        direction: direction.normalize(),
        intensity: RadiantIntensity(1.0),
        inner_cone_rad: 0.1,
        outer_cone_rad,
    })
}

fn lights() -> [Light; 5] {
    let narrow_or_wide = |angle| spot(angle, DVec3::new(0.1, -0.2, 0.05), DVec3::new(0.5, 0.7, -0.3));
    [
        lamp(DVec3::new(0.01, 0.02, -0.015)),
        lamp(DVec3::new(5.0, 0.3, 0.2)),
        narrow_or_wide(0.4),
        narrow_or_wide(1.2),
        parts::sun("sun", DVec3::new(0.2, -0.9, 0.3), Irradiance(1.0)),
    ]
}

fn whole_and_parts() {
    for light in lights() {
        for (seed, count, size) in [(1, 1100, 1e-3), (2, 200, 0.05), (3, 200, 0.6)] {
            let triangles = cloud(seed, count, size);
            let scene = mirrors(&triangles);
            // One frame for all: a sun's follows the casters.
            let launch = equal(&light, &scene);
            let faces = launch.face_count();
            let whole = marks(&build(&launch, &scene), faces);
            let each = triangles.iter().map(|triangle| mirrors(&[*triangle]));
            let mut apart: Vec<_> = each
                .flat_map(|part| marks(&build(&launch, &part), faces))
                .collect();
            apart.sort_unstable();
            apart.dedup();
            assert!(!whole.is_empty() && whole == apart, "{light:?}, size {size}");
        }
    }
}

fn diffuse_marks_nothing() {
    let alone = mirrors(&cloud(4, 60, 0.05));
    let mut among = alone.clone();
    // Before the mirrors, so that their triangles are not the hierarchy's first.
    let mut dust = mirrors(&cloud(5, 3000, 0.1)).objects.remove(0);
    dust.material = 1;
    among.objects.insert(0, dust);
    among.materials.push(Material::default());
    for light in lights() {
        let launch = equal(&light, &alone);
        let buffer = ItemBuffer::build(
            &launch,
            &Tracer::new(Arc::new(among.clone())),
            &[1],
            HiddenCellPolicy::Keep,
        );
        let faces = launch.face_count();
        assert_eq!(marks(&buffer, faces), marks(&build(&launch, &alone), faces));
    }
}

fn beside_a_cone() {
    let small = |at: DVec3| {
        cloud(6, 50, 0.1)
            .into_iter()
            .map(move |t| t.map(|p| p * 0.1 + at))
    };
    let ahead = DVec3::new(3.0, 0.2, 0.1);
    let objects: [Vec<_>; 4] = [
        small(-ahead).collect(),
        small(ahead).collect(),
        // Seen by its last triangle alone.
        small(-ahead).chain(small(ahead).take(1)).collect(),
        // A box around the cone, but nothing in it.
        vec![[-ahead, DVec3::new(3.0, 4.0, 0.1), DVec3::new(-3.0, 4.0, 0.1)]],
    ];
    let scene = objects.iter().fold(Scene::default(), |scene, object| {
        scene.mirror(mirror_mesh(object))
    });
    let casters = [0, 1, 2, 3];
    let launch = launch(
        &spot(0.3, DVec3::ZERO, DVec3::X),
        &scene,
        &casters,
        ItemBufferKind::Equal,
    );
    let buffer = ItemBuffer::build(
        &launch,
        &Tracer::new(Arc::new(scene)),
        &casters,
        HiddenCellPolicy::Keep,
    );
    assert_eq!(buffer.casters, [1, 2]);
}

/// Walls, an opaque ball and a box at random between a lamp and glass.
fn hidden_scene(seed: u64) -> Scene {
    let mut random = random(0x51de ^ seed << 16);
    let mut place = |height: f64| DVec3::new(1.4 * random() - 0.7, height, 1.4 * random() - 0.7);
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
                let within = DVec2::new(f64::from(place % 7), f64::from(place / 7)) / 6.0;
                let square = (DVec2::new(column as f64, row as f64) + within) / CELLS_PER_SIDE as f64;
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
    let lamp = parts::point_light("lamp", DVec3::new(0.01, 0.02, 0.03), Flux(1.0));
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
