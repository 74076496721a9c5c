//! The built-in scenes are the surfaces that the references were computed on.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use nephroid::scene::builtin::{NAMES, build};
use nephroid::scene::{LightKind, Mesh, Object, Scene, SurfaceKind};

use crate::support::assert_close;

fn scene(name: &str) -> Scene {
    build(name).unwrap_or_else(|| panic!("there is no built-in `{name}`"))
}

fn object<'a>(scene: &'a Scene, name: &str) -> &'a Object {
    let found = scene.objects.iter().find(|object| object.name == name);
    found.unwrap_or_else(|| panic!("{} has no `{name}`", scene.name))
}

/// Directed edges whose twin is missing: 0 for a closed body of consistent winding. Vertices count as one where their
/// positions are equal bit by bit.
fn open_edges(mesh: &Mesh) -> usize {
    let mut ids = HashMap::new();
    let welded: Vec<usize> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = ids.len();
            *ids.entry((p + DVec3::ZERO).to_array().map(f64::to_bits))
                .or_insert(next)
        })
        .collect();
    let mut edges: HashMap<(usize, usize), i64> = HashMap::new();
    for triangle in &mesh.triangles {
        for side in 0..3 {
            let a = welded[triangle[side] as usize];
            let b = welded[triangle[(side + 1) % 3] as usize];
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    edges
        .iter()
        .filter(|((a, b), count)| edges.get(&(*b, *a)) != Some(count))
        .count()
}

fn volume_m3(mesh: &Mesh) -> f64 {
    let six_volumes = (0..mesh.triangles.len()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        a.dot(b.cross(c))
    });
    six_volumes.sum::<f64>() / 6.0
}

#[test]
fn every_name_builds_and_no_other() {
    for name in NAMES {
        let scene = scene(name);
        assert_eq!(scene.name, name);
        assert_eq!(scene.source, format!("builtin:{name}"));
        assert!(
            scene.objects.iter().any(|object| object.name == "floor"),
            "{name} has no floor"
        );
        assert!(!scene.lights.is_empty() && !scene.cameras.is_empty(), "{name}");
        assert!(
            scene
                .objects
                .iter()
                .enumerate()
                .any(|(index, _)| scene.material_of(index).surface.is_specular())
        );
        assert!(scene.warnings.is_empty());
    }
    assert!(build("Ring").is_none() && build("").is_none());
}

#[test]
fn meshes_are_sound() {
    for name in NAMES {
        for Object { name: part, mesh, .. } in &scene(name).objects {
            let at = format!("{name}/{part}");
            assert_eq!(mesh.positions.len(), mesh.normals.len(), "{at}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
            assert!(
                mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-14),
                "{at}: unit normals"
            );
            assert!(!mesh.triangles.is_empty(), "{at}");
            for triangle in 0..mesh.triangles.len() {
                let face = mesh.face_normal(triangle);
                for normal in mesh.corner_normals(triangle) {
                    assert!(
                        face.dot(normal) > 0.99,
                        "{at}: triangle {triangle} faces away from its normals"
                    );
                }
            }
        }
    }
}

#[test]
fn floors_are_grey_and_carry_the_reference_maps_coordinates() {
    for (name, half) in [
        ("ring", 1.0),
        ("ball", 0.6),
        ("pool", 1.0),
        ("mirror", 1.0),
        ("slab", 1.0),
        ("paraboloid", 0.5),
        ("nephroid", 1.0),
    ] {
        let scene = scene(name);
        let floor = object(&scene, "floor");
        let material = &scene.materials[floor.material];
        assert_eq!(material.surface, SurfaceKind::Diffuse);
        assert_eq!(material.base_colour.to_array(), [0.5; 3]);
        let mesh = &floor.mesh;
        assert_close(mesh.area_m2(), 4.0 * half * half, 1e-15, name);
        assert!(mesh.normals.iter().all(|n| *n == DVec3::Y));
        let uvs = mesh.uv0.as_ref().expect("floor has TEXCOORD_0");
        for (position, uv) in mesh.positions.iter().zip(uvs) {
            assert_eq!(position.y, 0.0);
            assert_close(position.x, half * (2.0 * uv.x - 1.0), 1e-15, "u runs along x");
            assert_close(position.z, half * (2.0 * uv.y - 1.0), 1e-15, "v runs along z");
        }
    }
}

#[test]
fn ball_and_slab_are_closed_and_have_their_volume() {
    let ball = scene("ball");
    let mesh = &object(&ball, "ball").mesh;
    assert_eq!(open_edges(mesh), 0);
    assert_close(
        volume_m3(mesh),
        4.0 / 3.0 * PI * 0.125,
        1e-12,
        "volume of the ball",
    );
    assert_close(mesh.area_m2(), PI, 3e-5, "area of the ball");
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let from_centre = *position - DVec3::new(0.0, 0.8, 0.0);
        assert_close(from_centre.length(), 0.5, 2e-5, "radius");
        assert!((from_centre.normalize() - *normal).length() < 1e-14);
    }
    let slab = scene("slab");
    let mesh = &object(&slab, "slab").mesh;
    assert_eq!(open_edges(mesh), 0);
    assert_close(volume_m3(mesh), 8.0 * 8.0 * 0.3, 1e-14, "volume of the slab");
    for (name, part) in [("ball", "ball"), ("slab", "slab")] {
        let scene = scene(name);
        let material = &scene.materials[object(&scene, part).material];
        assert_eq!((material.surface, material.ior), (SurfaceKind::Dielectric, 1.5));
        assert!(material.volume.is_some());
    }
}

#[test]
fn the_closedness_check_sees_a_missing_and_a_turned_triangle() {
    let ball = scene("ball");
    let mut mesh = object(&ball, "ball").mesh.as_ref().clone();
    mesh.triangles[17].swap(0, 1);
    assert_ne!(open_edges(&mesh), 0);
    mesh.triangles.remove(17);
    assert_eq!(open_edges(&mesh), 3);
}

#[test]
fn ring_is_a_cylinder_that_faces_inwards() {
    for name in ["ring", "nephroid"] {
        let scene = scene(name);
        let ring = object(&scene, "ring");
        assert_eq!(scene.materials[ring.material].surface, SurfaceKind::Mirror);
        assert_eq!(ring.mesh.triangles.len(), 2048);
        assert_close(ring.mesh.area_m2(), PI, 1e-5, "area 2πRH");
        for (position, normal) in ring.mesh.positions.iter().zip(&ring.mesh.normals) {
            assert!(position.y == 0.0 || position.y == 0.5);
            let outward = DVec3::new(position.x, 0.0, position.z);
            assert!(
                (*normal + outward).length() < 1e-15,
                "normal {normal} at {position}"
            );
        }
        // Both rims, and no seam along the wall.
        assert_eq!(open_edges(&ring.mesh), 2 * 1024);
    }
}

#[test]
fn pool_is_the_wave_surface() {
    let scene = scene("pool");
    let water = object(&scene, "water");
    assert_eq!(water.mesh.triangles.len(), 2 * 512 * 512);
    let material = &scene.materials[water.material];
    assert_eq!((material.surface, material.ior), (SurfaceKind::Dielectric, 1.333));
    let height = |x: f64, z: f64| {
        1.0 + 0.02 * ((9.0 * x + 1.0).cos() + (7.0 * z + 2.0).cos() + (6.0 * x + 5.0 * z).cos())
    };
    let step = 1e-5;
    for (p, normal) in water.mesh.positions.iter().zip(&water.mesh.normals).step_by(97) {
        assert_close(p.y, height(p.x, p.z), 1e-14, "height");
        let slope_x = (height(p.x + step, p.z) - height(p.x - step, p.z)) / (2.0 * step);
        let slope_z = (height(p.x, p.z + step) - height(p.x, p.z - step)) / (2.0 * step);
        let expected = DVec3::new(-slope_x, 1.0, -slope_z).normalize();
        assert!(
            (*normal - expected).length() < 1e-9,
            "{normal} instead of {expected}"
        );
    }
    let (low, high) = water.mesh.bounds().expect("has vertices");
    assert_eq!((low.x, low.z, high.x, high.z), (-1.5, -1.5, 1.5, 1.5));
}

/// Every ray along the axis is reflected through the focus, and the opening is a disc of 0.4 m across the beam.
#[test]
fn paraboloid_gathers_the_sun_in_its_focus() {
    let scene = scene("paraboloid");
    let dish = object(&scene, "paraboloid");
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("paraboloid is lit by a sun");
    };
    let focus = DVec3::new(0.0, -0.5, 0.0);
    for (position, normal) in dish.mesh.positions.iter().zip(&dish.mesh.normals) {
        let reflected = nephroid::optics::refraction::reflect(direction, *normal);
        let miss = (focus - *position).cross(reflected).length();
        assert!(miss < 1e-14, "misses the focus by {miss} m");
        assert!(reflected.dot(focus - *position) > 0.0);
    }
    let across = |triangle: usize| {
        let [a, b, c] = dish.mesh.corners(triangle);
        0.5 * (b - a).cross(c - a).dot(-direction)
    };
    let opening: f64 = (0..dish.mesh.triangles.len()).map(across).sum();
    assert_close(opening, PI * 0.16, 1e-4, "opening across the beam");
}

#[test]
fn plane_mirror_is_turned_fifteen_degrees() {
    let scene = scene("mirror");
    let mesh = &object(&scene, "mirror").mesh;
    assert_close(mesh.area_m2(), 0.6 * 0.5, 1e-14, "area");
    let (low, high) = mesh.bounds().expect("has vertices");
    assert_close(0.5 * (high.x - low.x), 0.077_645_7, 1e-6, "half width in x");
    assert_close(0.5 * (high.z - low.z), 0.289_777_7, 1e-6, "half width in z");
    assert_close(low.y, 0.2, 1e-14, "lower edge");
    assert_close(high.y, 0.7, 1e-14, "upper edge");
}

#[test]
fn lights_have_the_references_power() {
    for (name, position) in [
        ("ring", [-0.7, 1.2, 0.0]),
        ("ball", [0.0, 3.0, 0.0]),
        ("mirror", [-0.1, 1.2, 0.1]),
        ("slab", [0.1, 2.0, -0.05]),
    ] {
        let light = scene(name).lights[0].clone();
        let LightKind::Point {
            position: at,
            intensity,
        } = light.kind
        else {
            panic!("{name} is lit by a point light");
        };
        assert_eq!(at.to_array(), position);
        assert_close(
            intensity.0 * 4.0 * PI * light.colour.luminance(),
            100.0,
            1e-12,
            name,
        );
    }
    for (name, along) in [
        ("pool", DVec3::new(0.3, -1.0, 0.2)),
        ("paraboloid", DVec3::new(0.8, -0.6, 0.0)),
        (
            "nephroid",
            DVec3::new(0.939_692_620_785_908_4, -0.342_020_143_325_668_7, 0.0),
        ),
    ] {
        let light = scene(name).lights[0].clone();
        let LightKind::Sun {
            direction,
            normal_irradiance,
        } = light.kind
        else {
            panic!("{name} is lit by a sun");
        };
        assert!(
            (direction - along.normalize()).length() < 1e-15,
            "{name}: {direction}"
        );
        assert_close(normal_irradiance.0 * light.colour.luminance(), 1.0, 1e-12, name);
    }
}

/// Whether a plane surface's TEXCOORD_0 fills the unit square without overlap: area in uv of 1.
#[test]
fn showrooms_receivers_are_plane_with_coordinates_of_their_own() {
    let scene = scene("showroom");
    assert!(scene.triangle_count() < 300_000, "{}", scene.triangle_count());
    for (index, Object { name, mesh, .. }) in scene.objects.iter().enumerate() {
        if scene.material_of(index).surface != SurfaceKind::Diffuse {
            continue;
        }
        let uvs = mesh
            .uv0
            .as_ref()
            .unwrap_or_else(|| panic!("{name} has no TEXCOORD_0"));
        assert!(
            mesh.normals.iter().all(|n| *n == mesh.normals[0]),
            "{name} is not plane"
        );
        let covered: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|vertex| uvs[vertex as usize]);
                0.5 * (b - a).perp_dot(c - a).abs()
            })
            .sum();
        assert_close(covered, 1.0, 1e-14, name);
    }
}
