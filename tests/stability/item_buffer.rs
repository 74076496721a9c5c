//! Item buffers never miss what a light sees.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::geometry::cube_face::{self, FaceMapping};
use nephroid::light_pass::emitter::Emitter;
use nephroid::light_pass::item_buffer::{CELLS_PER_SIDE, Hiding, ItemBuffer};
use nephroid::light_pass::launch::Launch;
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Light, LightKind, Material, Mesh, Object, Scene, SurfaceKind};
use nephroid::settings::ItemBufferKind;
use nephroid::transport::Tracer;
use nephroid::units::RadiantIntensity;

const MAPPINGS: [FaceMapping; 2] = [FaceMapping::EqualSolidAngle, FaceMapping::Plain];

fn lamp(position: DVec3) -> Light {
    Light {
        name: "lamp".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Point {
            position,
            intensity: RadiantIntensity(1.0),
        },
        size: nephroid::scene::LightSize::None,
    }
}

fn mirrors(triangles: &[[DVec3; 3]]) -> Scene {
    let mesh = Mesh {
        positions: triangles.concat(),
        normals: vec![DVec3::Y; 3 * triangles.len()],
        triangles: (0..triangles.len() as u32)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect(),
        ..Mesh::default()
    };
    Scene {
        objects: vec![Object {
            name: "mirrors".into(),
            node: 0,
            primitive: 0,
            material: 0,
            mesh: mesh.into(),
        }],
        materials: vec![Material {
            surface: SurfaceKind::Mirror,
            ..Material::default()
        }],
        ..Scene::default()
    }
}

fn build(launch: &Launch, scene: &Scene) -> ItemBuffer {
    ItemBuffer::build(launch, &Tracer::new(Arc::new(scene.clone())), &[0], Hiding::Keep)
}

#[test]
fn solid_angles_of_all_cells_sum_to_the_sphere() {
    for mapping in MAPPINGS {
        for side in [1, 7, 128] {
            let cell = |i: usize| i as f64 / side as f64;
            let mut sum = 0.0;
            for row in 0..side {
                for column in 0..side {
                    let low = DVec2::new(cell(column), cell(row));
                    sum += mapping.cell_solid_angle_sr(low, DVec2::new(cell(column + 1), cell(row + 1)));
                }
            }
            let sphere = 4.0 * std::f64::consts::PI;
            assert!(
                (6.0 * sum - sphere).abs() < 1e-12 * sphere,
                "{mapping:?}, {side}: {}",
                6.0 * sum - sphere
            );
        }
    }
}

#[test]
fn equal_cells_have_the_solid_angle_of_their_rectangle() {
    // Thin columns are exact rectangles in x; within them the share of v must be the share of solid angle.
    let mapping = FaceMapping::EqualSolidAngle;
    let width = 1e-5;
    for u in [0.0, 0.13, 0.5, 0.77, 1.0 - width] {
        for (v0, v1) in [(0.0, 0.25), (0.25, 0.5), (0.4, 0.9), (0.9, 1.0)] {
            let low = mapping.plane_from_square(DVec2::new(u, v0));
            let high = mapping.plane_from_square(DVec2::new(u + width, v1));
            let middle = |v: f64| mapping.plane_from_square(DVec2::new(u + 0.5 * width, v)).y;
            let exact = cube_face::rectangle_solid_angle_sr(
                DVec2::new(low.x, middle(v0)),
                DVec2::new(high.x, middle(v1)),
            );
            let stated = mapping.cell_solid_angle_sr(DVec2::new(u, v0), DVec2::new(u + width, v1));
            assert!(
                (exact / stated - 1.0).abs() < 1e-6,
                "u {u}, v {v0} to {v1}: {exact} against {stated}"
            );
        }
    }
}

#[test]
fn mappings_of_a_face_are_inverted() {
    for mapping in MAPPINGS {
        for i in 0..=20 {
            for j in 0..=20 {
                let square = DVec2::new(f64::from(i), f64::from(j)) / 20.0;
                let plane = mapping.plane_from_square(square);
                assert!(
                    plane.abs().max_element() <= 1.0 + 1e-12,
                    "{square} leaves the face at {plane}"
                );
                let back = mapping.square_from_plane(plane);
                assert!(
                    (back - square).abs().max_element() < 1e-12,
                    "{mapping:?}: {square} comes back as {back}"
                );
            }
        }
    }
}

/// Pseudo-random numbers in [0, 1).
fn random(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn every_visible_triangle_marks_the_cell_of_each_of_its_points() {
    let mut state = 7;
    for kind in [ItemBufferKind::Equal, ItemBufferKind::Cube] {
        for size in [1e-4, 1e-2, 0.3, 3.0] {
            let mut point = |scale: f64| {
                DVec3::new(
                    random(&mut state) - 0.5,
                    random(&mut state) - 0.5,
                    random(&mut state) - 0.5,
                ) * scale
            };
            let triangles: Vec<[DVec3; 3]> = (0..300)
                .map(|_| {
                    let centre = point(2.0);
                    [centre + point(size), centre + point(size), centre + point(size)]
                })
                .collect();
            let scene = mirrors(&triangles);
            let light = lamp(DVec3::new(0.01, 0.02, -0.015));
            let launch = launch(&light, &scene, &[0], kind).expect("a domain");
            let buffer = build(&launch, &scene);
            for corners in &triangles {
                for _ in 0..20 {
                    let (a, b) = (random(&mut state), random(&mut state));
                    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
                    let target = corners[0] + (corners[1] - corners[0]) * a + (corners[2] - corners[0]) * b;
                    assert!(
                        marked_at(&launch, &buffer, target),
                        "{kind:?}, size {size}: {target} is not marked"
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

#[test]
fn a_small_mirror_marks_few_cells() {
    let a = DVec3::new(1.0, 0.2, 0.3);
    let scene = mirrors(&[[a, a + DVec3::Y * 0.01, a + DVec3::Z * 0.01]]);
    let launch = launch(&lamp(DVec3::ZERO), &scene, &[0], ItemBufferKind::Equal).expect("a domain");
    let marked = build(&launch, &scene).marked_cells();
    assert!((1..=4).contains(&marked), "{marked} cells");
}

#[test]
fn a_light_on_the_mirror_itself_still_sees_it() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Z];
    let scene = mirrors(&[corners]);
    for position in [DVec3::ZERO, DVec3::new(0.3, 0.0, 0.3), DVec3::new(0.5, 0.0, 0.0)] {
        let launch = launch(&lamp(position), &scene, &[0], ItemBufferKind::Equal).expect("a domain");
        let buffer = build(&launch, &scene);
        assert!(buffer.marked_cells() > 0, "nothing marked from {position}");
    }
}

#[test]
fn lattice_spans_hold_every_cell_that_touches_a_marked_one() {
    let a = DVec3::new(1.0, 0.2, 0.3);
    let scene = mirrors(&[[a, a + DVec3::Y * 0.3, a + DVec3::Z * 0.1]]);
    let launch = launch(&lamp(DVec3::ZERO), &scene, &[0], ItemBufferKind::Equal).expect("a domain");
    let buffer = build(&launch, &scene);
    for size in [(1, 1), (5, 3), (128, 128), (300, 301), (1000, 77)] {
        for face in 0..6 {
            for row in 0..size.1 {
                let spans = buffer.lattice_spans(face, row, size);
                assert!(
                    spans.windows(2).all(|pair| pair[0].1 < pair[1].0),
                    "spans overlap: {spans:?}"
                );
                for column in 0..size.0 {
                    let listed = spans.iter().any(|span| (span.0..span.1).contains(&column));
                    assert_eq!(
                        listed,
                        touches_marked(&buffer, face, (column, row), size),
                        "{size:?} {column} {row}"
                    );
                }
            }
        }
    }
}

fn touches_marked(buffer: &ItemBuffer, face: usize, cell: (usize, usize), size: (usize, usize)) -> bool {
    let overlaps =
        |i: usize, n: usize, k: usize| i * CELLS_PER_SIDE < (k + 1) * n && k * n < (i + 1) * CELLS_PER_SIDE;
    (0..CELLS_PER_SIDE)
        .filter(|&row| overlaps(cell.1, size.1, row))
        .any(|row| {
            (0..CELLS_PER_SIDE)
                .filter(|&column| overlaps(cell.0, size.0, column))
                .any(|column| buffer.is_marked(face, column, row))
        })
}

/// Cells of all faces that are marked.
fn marks(buffer: &ItemBuffer, faces: usize) -> Vec<(usize, usize, usize)> {
    (0..faces)
        .flat_map(|face| (0..CELLS_PER_SIDE).map(move |row| (face, row)))
        .flat_map(|(face, row)| (0..CELLS_PER_SIDE).map(move |column| (face, column, row)))
        .filter(|&(face, column, row)| buffer.is_marked(face, column, row))
        .collect()
}

fn lights() -> Vec<Light> {
    let spot = |outer_cone_rad| Light {
        kind: LightKind::Spot {
            position: DVec3::new(0.1, -0.2, 0.05),
            direction: DVec3::new(0.5, 0.7, -0.3).normalize(),
            intensity: RadiantIntensity(1.0),
            inner_cone_rad: 0.1,
            outer_cone_rad,
        },
        ..lamp(DVec3::ZERO)
    };
    let sun = LightKind::Sun {
        direction: DVec3::new(0.2, -0.9, 0.3).normalize(),
        normal_irradiance: nephroid::units::Irradiance(1.0),
    };
    vec![
        lamp(DVec3::new(0.01, 0.02, -0.015)),
        lamp(DVec3::new(5.0, 0.3, 0.2)),
        spot(0.4),
        spot(1.2),
        Light {
            kind: sun,
            ..lamp(DVec3::ZERO)
        },
    ]
}

/// A cloud of triangles, seeded.
fn cloud(seed: u64, count: usize, size: f64) -> Vec<[DVec3; 3]> {
    let mut state = seed;
    let mut point =
        |scale: f64| DVec3::from_array(std::array::from_fn(|_| (random(&mut state) - 0.5) * scale));
    (0..count)
        .map(|_| {
            let centre = point(2.0);
            [centre + point(size), centre + point(size), centre + point(size)]
        })
        .collect()
}

#[test]
fn the_whole_marks_what_its_triangles_mark_one_by_one() {
    for light in lights() {
        for (seed, count, size) in [(1, 1100, 1e-3), (2, 200, 0.05), (3, 200, 0.6)] {
            let triangles = cloud(seed, count, size);
            let scene = mirrors(&triangles);
            // One frame for all: a sun's follows the casters.
            let launch = launch(&light, &scene, &[0], ItemBufferKind::Equal).expect("a domain");
            let whole = marks(&build(&launch, &scene), launch.face_count());
            let mut apart: Vec<_> = triangles
                .iter()
                .flat_map(|triangle| marks(&build(&launch, &mirrors(&[*triangle])), launch.face_count()))
                .collect();
            apart.sort_unstable_by_key(|&(face, column, row)| (face, row, column));
            apart.dedup();
            assert!(!whole.is_empty(), "{light:?}, size {size}: nothing is marked");
            assert_eq!(whole, apart, "{light:?}, size {size}");
        }
    }
}

#[test]
fn diffuse_surfaces_among_the_casters_mark_nothing() {
    let mut scene = mirrors(&cloud(4, 60, 0.05));
    let alone = scene.clone();
    let mut dust = mirrors(&cloud(5, 3000, 0.1)).objects.remove(0);
    dust.material = 1;
    // Before the mirrors, so that their triangles are not the hierarchy's first.
    scene.objects.insert(0, dust);
    scene.materials.push(Material::default());
    for light in lights() {
        let launch = launch(&light, &alone, &[0], ItemBufferKind::Equal).expect("a domain");
        let among = ItemBuffer::build(&launch, &Tracer::new(Arc::new(scene.clone())), &[1], Hiding::Keep);
        let faces = launch.face_count();
        assert_eq!(marks(&among, faces), marks(&build(&launch, &alone), faces));
    }
}

#[test]
fn objects_beside_a_cone_are_no_casters() {
    let object = |triangles: &[[DVec3; 3]]| mirrors(triangles).objects.remove(0);
    let small = |at: DVec3| {
        cloud(6, 50, 0.1)
            .into_iter()
            .map(move |t| t.map(|p| p * 0.1 + at))
    };
    let ahead = DVec3::new(3.0, 0.2, 0.1);
    let scene = Scene {
        objects: vec![
            object(&small(-ahead).collect::<Vec<_>>()),
            object(&small(ahead).collect::<Vec<_>>()),
            // Seen by its last triangle alone.
            object(&small(-ahead).chain(small(ahead).take(1)).collect::<Vec<_>>()),
            // A box around the cone, but nothing in it.
            object(&[[-ahead, DVec3::new(3.0, 4.0, 0.1), DVec3::new(-3.0, 4.0, 0.1)]]),
        ],
        ..mirrors(&[])
    };
    let light = Light {
        kind: LightKind::Spot {
            position: DVec3::ZERO,
            direction: DVec3::X,
            intensity: RadiantIntensity(1.0),
            inner_cone_rad: 0.1,
            outer_cone_rad: 0.3,
        },
        ..lamp(DVec3::ZERO)
    };
    let casters = [0, 1, 2, 3];
    let launch = launch(&light, &scene, &casters, ItemBufferKind::Equal).expect("a domain");
    let buffer = ItemBuffer::build(&launch, &Tracer::new(Arc::new(scene)), &casters, Hiding::Keep);
    assert_eq!(buffer.casters, [1, 2]);
}

fn launch(light: &Light, scene: &Scene, casters: &[usize], item_buffer: ItemBufferKind) -> Option<Launch> {
    Launch::new(Emitter::middle(light, scene)?, scene, casters, item_buffer)
}
