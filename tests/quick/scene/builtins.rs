//! The built-in scenes are the surfaces that the references were computed on.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use nephroid::optics::Nanometres;
use nephroid::optics::refraction::{reflect, refract};
use nephroid::optics::wavelength::D_LINE;
use nephroid::scene::builtin::{NAMES, build};
use nephroid::scene::{LightKind, Mesh, Object, Scene, SurfaceKind};

use support::assert_close;

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
fn every_name_builds() {
    for name in NAMES {
        let scene = scene(name);
        assert_eq!(scene.name, name);
        assert_eq!(scene.source, format!("builtin:{name}"));
        assert!(
            scene
                .objects
                .iter()
                .any(|object| ["floor", "wall"].contains(&object.name.as_str())),
            "{name} has neither floor nor wall"
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
fn floors_have_map_coordinates() {
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

/// Solids are closed and have their volume [m³]. That their light lands where it should is held by the references.
#[test]
fn solids_are_closed() {
    let prism_m3 = |height_m: f64| 0.06 * 0.06 * 0.75_f64.sqrt() / 2.0 * height_m;
    for (name, part, expected_m3, tolerance) in [
        ("ball", "ball", 4.0 / 3.0 * PI * 0.125, 1e-12),
        ("slab", "slab", 8.0 * 8.0 * 0.3, 1e-14),
        ("prism", "prism", prism_m3(0.06), 1e-12),
        ("spectrum", "prism", prism_m3(0.1), 1e-12),
        ("spectrum", "ball", 4.0 / 3.0 * PI * 0.06_f64.powi(3), 0.01),
        // Cone frustums around half an ellipsoid that is missing.
        (
            "bowl",
            "bowl",
            0.00365 - 2.0 / 3.0 * PI * 0.128 * 0.128 * 0.084,
            0.5,
        ),
    ] {
        let scene = scene(name);
        let mesh = &object(&scene, part).mesh;
        assert_eq!(open_edges(mesh), 0, "{name}/{part}");
        assert_close(volume_m3(mesh), expected_m3, tolerance, name);
    }
    let gallery = scene("gallery");
    for solid in ["bowl", "ball", "prism"] {
        let mesh = &object(&gallery, solid).mesh;
        assert_eq!(open_edges(mesh), 0, "{solid}");
        assert!(volume_m3(mesh) > 1e-4, "{solid}");
    }
    let mut cut = object(&scene("ball"), "ball").mesh.as_ref().clone();
    cut.triangles[17].swap(0, 1);
    assert_ne!(open_edges(&cut), 0, "a turned triangle is seen");
    cut.triangles.remove(17);
    assert_eq!(open_edges(&cut), 3, "a missing one too");
}

#[test]
fn rings_face_inwards() {
    for name in ["ring", "nephroid"] {
        let scene = scene(name);
        let ring = &object(&scene, "ring").mesh;
        for (position, normal) in ring.positions.iter().zip(&ring.normals) {
            let outward = DVec3::new(position.x, 0.0, position.z);
            assert!((*normal + outward).length() < 1e-15, "{normal} at {position}");
        }
        assert_eq!(open_edges(ring), 2 * 1024, "both rims, no seam along the wall");
    }
}

#[test]
fn pool_has_its_waves() {
    let scene = scene("pool");
    for p in object(&scene, "water").mesh.positions.iter().step_by(97) {
        let waves = (9.0 * p.x + 1.0).cos() + (7.0 * p.z + 2.0).cos() + (6.0 * p.x + 5.0 * p.z).cos();
        assert_close(p.y, 1.0 + 0.02 * waves, 1e-14, "height");
    }
}

#[test]
fn paraboloid_has_its_focus() {
    let scene = scene("paraboloid");
    let dish = &object(&scene, "paraboloid").mesh;
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("paraboloid is lit by a sun");
    };
    let focus = DVec3::new(0.0, -0.5, 0.0);
    for (position, normal) in dish.positions.iter().zip(&dish.normals) {
        let reflected = reflect(direction, *normal);
        let miss_m = (focus - *position).cross(reflected).length();
        assert!(
            miss_m < 1e-14 && reflected.dot(focus - *position) > 0.0,
            "{miss_m} m"
        );
    }
}

/// Whether a plane surface's TEXCOORD_0 fills the unit square without overlap: area in uv of 1.
#[test]
fn showroom_has_its_own_coordinates() {
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

/// At minimum deviation light goes through a prism along its base, in and out at the same angle.
#[test]
fn prism_has_minimum_deviation() {
    let scene = scene("prism");
    let prism = object(&scene, "prism");
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("prism is lit by a sun");
    };
    let glass = &scene.materials[prism.material];
    assert!(glass.is_dispersive());
    let deviation = |n: f64| {
        let (first, second) = (
            DVec3::new(-0.75_f64.sqrt(), 0.5, 0.0),
            DVec3::new(0.75_f64.sqrt(), 0.5, 0.0),
        );
        let inside = refract(direction, first, n).expect("it enters");
        let out = refract(inside, -second, 1.0 / n).expect("it leaves");
        (inside, direction.angle_between(out))
    };
    let (inside, yellow) = deviation(glass.index_at(D_LINE));
    assert!((inside - DVec3::X).length() < 1e-12, "{inside}");
    assert_close(
        yellow.to_degrees(),
        2.0 * (0.8175_f64).asin().to_degrees() - 60.0,
        1e-12,
        "deviation",
    );
    // As the solver's table of this scene has it.
    for (nm, degrees) in [(400.0, 51.637_754_065_4), (700.0, 49.182_654_092_7)] {
        let (_, found) = deviation(glass.index_at(Nanometres(nm)));
        assert_close(found.to_degrees(), degrees, 1e-6, "deviation");
    }
}
