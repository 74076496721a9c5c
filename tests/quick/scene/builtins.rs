//! The built-in scenes are the surfaces that the references were computed on.

use std::collections::HashMap;

use nephroid::optics::refraction::{reflect, refract};
use nephroid::optics::wavelength::D_LINE;
use nephroid::scene::Object;
use nephroid::scene::builtin::{NAMES, build};

use super::meshes::volume_m3;
use crate::prelude::*;

fn object<'a>(scene: &'a Scene, name: &str) -> &'a Object {
    let found = scene.objects.iter().find(|object| object.name == name);
    found.unwrap_or_else(|| panic!("{} has no `{name}`", scene.name))
}

/// Directed edges whose twin is missing: 0 for a closed body of consistent winding. Vertices count as one where their
/// positions are equal bit by bit.
fn open_edges(mesh: &Mesh) -> usize {
    let mut ids = HashMap::new();
    let mut weld = |p: &DVec3| {
        let (bits, next) = ((p + DVec3::ZERO).to_array().map(f64::to_bits), ids.len());
        *ids.entry(bits).or_insert(next)
    };
    let welded: Vec<usize> = mesh.positions.iter().map(&mut weld).collect();
    let mut edges: HashMap<(usize, usize), i64> = HashMap::new();
    for triangle in &mesh.triangles {
        for side in 0..3 {
            let [a, b] = [side, (side + 1) % 3].map(|corner| welded[triangle[corner] as usize]);
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    let is_open = |((a, b), count): &(&(usize, usize), &i64)| edges.get(&(*b, *a)) != Some(*count);
    edges.iter().filter(is_open).count()
}

#[test]
fn every_scene_is_whole_and_its_meshes_sound() {
    for name in NAMES {
        let scene = built_in(name);
        assert_eq!(
            (scene.name.as_str(), scene.source.as_str()),
            (name, &*format!("builtin:{name}"))
        );
        assert!(!scene.lights.is_empty() && !scene.cameras.is_empty(), "{name}");
        let mut names = scene.objects.iter().map(|object| object.name.as_str());
        assert!(names.any(|name| ["floor", "wall"].contains(&name)), "{name}");
        let mut kinds = (0..scene.objects.len()).map(|object| scene.material_of(object).surface);
        assert!(kinds.any(SurfaceKind::is_specular), "{name}");
        warns_not(&scene);
        for Object { name: part, mesh, .. } in &scene.objects {
            let at = format!("{name}/{part}");
            assert_eq!(mesh.positions.len(), mesh.normals.len(), "{at}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
            assert!(
                mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-14),
                "{at}"
            );
            assert!(!mesh.triangles.is_empty(), "{at}");
            for triangle in 0..mesh.triangles.len() {
                let face = mesh.face_normal(triangle);
                let agrees = |normal: DVec3| face.dot(normal) > 0.99;
                assert!(
                    mesh.corner_normals(triangle).into_iter().all(agrees),
                    "{at}: {triangle}"
                );
            }
        }
    }
    assert!(build("Ring").is_none() && build("").is_none());
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
        let scene = built_in(name);
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
    // Cone frustums around half an ellipsoid that is missing.
    let bowl_m3 = 0.00365 - 2.0 / 3.0 * PI * 0.128 * 0.128 * 0.084;
    let prism_m3 = |height_m: f64| 0.06 * 0.06 * 0.75_f64.sqrt() / 2.0 * height_m;
    for (name, part, expected_m3, tolerance) in [
        ("ball", "ball", 4.0 / 3.0 * PI * 0.125, 1e-12),
        ("slab", "slab", 8.0 * 8.0 * 0.3, 1e-14),
        ("prism", "prism", prism_m3(0.06), 1e-12),
        ("spectrum", "prism", prism_m3(0.1), 1e-12),
        ("spectrum", "ball", 4.0 / 3.0 * PI * 0.06_f64.powi(3), 0.01),
        ("bowl", "bowl", bowl_m3, 0.5),
    ] {
        let scene = built_in(name);
        let mesh = &object(&scene, part).mesh;
        assert_eq!(open_edges(mesh), 0, "{name}/{part}");
        assert_close(volume_m3(mesh), expected_m3, tolerance, name);
    }
    let gallery = built_in("gallery");
    for solid in ["bowl", "ball", "prism"] {
        let mesh = &object(&gallery, solid).mesh;
        assert_eq!(open_edges(mesh), 0, "{solid}");
        assert!(volume_m3(mesh) > 1e-4, "{solid}");
    }
    let mut cut = object(&built_in("ball"), "ball").mesh.as_ref().clone();
    cut.triangles[17].swap(0, 1);
    assert_ne!(open_edges(&cut), 0, "a turned triangle is seen");
    cut.triangles.remove(17);
    assert_eq!(open_edges(&cut), 3, "a missing one too");
}

/// A ring faces inwards; the pool has its waves; a paraboloid sends a sun's light to its focus.
#[test]
fn shapes_are_those_of_the_references() {
    for name in ["ring", "nephroid"] {
        let scene = built_in(name);
        let ring = &object(&scene, "ring").mesh;
        for (position, normal) in ring.positions.iter().zip(&ring.normals) {
            near(*normal, -position.with_y(0.0), 1e-15, position);
        }
        assert_eq!(open_edges(ring), 2 * 1024, "both rims, no seam along the wall");
    }
    for p in object(&built_in("pool"), "water")
        .mesh
        .positions
        .iter()
        .step_by(97)
    {
        let waves = (9.0 * p.x + 1.0).cos() + (7.0 * p.z + 2.0).cos() + (6.0 * p.x + 5.0 * p.z).cos();
        assert_close(p.y, 1.0 + 0.02 * waves, 1e-14, "height");
    }
    let scene = built_in("paraboloid");
    let dish = &object(&scene, "paraboloid").mesh;
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("paraboloid is lit by a sun");
    };
    for (position, normal) in dish.positions.iter().zip(&dish.normals) {
        let (reflected, to_focus) = (reflect(direction, *normal), DVec3::Y * -0.5 - *position);
        near(to_focus.cross(reflected), DVec3::ZERO, 1e-14, position);
        assert!(reflected.dot(to_focus) > 0.0);
    }
}

/// A plane surface's TEXCOORD_0 fills the unit square without overlap: area in uv of 1.
#[test]
fn showroom_has_its_own_coordinates() {
    let scene = built_in("showroom");
    assert!(scene.triangle_count() < 300_000, "{}", scene.triangle_count());
    for (index, Object { name, mesh, .. }) in scene.objects.iter().enumerate() {
        if scene.material_of(index).surface != SurfaceKind::Diffuse {
            continue;
        }
        let uvs = mesh.uv0.as_ref().expect("it has TEXCOORD_0");
        let is_plane = mesh.normals.iter().all(|n| *n == mesh.normals[0]);
        assert!(is_plane, "{name} is not plane");
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| uvs[vertex as usize]);
            0.5 * (b - a).perp_dot(c - a).abs()
        };
        assert_close(mesh.triangles.iter().map(area).sum(), 1.0, 1e-14, name);
    }
}

/// At minimum deviation light goes through a prism along its base, in and out at the same angle.
#[test]
fn prism_has_minimum_deviation() {
    let scene = built_in("prism");
    let prism = object(&scene, "prism");
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("prism is lit by a sun");
    };
    let glass = &scene.materials[prism.material];
    assert!(glass.is_dispersive());
    let deviation = |n: f64| {
        let [first, second] = [-1.0, 1.0].map(|side| dvec3(side * 0.75_f64.sqrt(), 0.5, 0.0));
        let inside = refract(direction, first, n).expect("it enters");
        let out = refract(inside, -second, 1.0 / n).expect("it leaves");
        (inside, direction.angle_between(out))
    };
    let (inside, yellow) = deviation(glass.index_at(D_LINE));
    near(inside, DVec3::X, 1e-12, "along the base");
    let expected = 2.0 * 0.8175_f64.asin().to_degrees() - 60.0;
    assert_close(yellow.to_degrees(), expected, 1e-12, "deviation");
    // As the solver's table of this scene has it.
    for (nm, degrees) in [(400.0, 51.637_754_065_4), (700.0, 49.182_654_092_7)] {
        let (_, found) = deviation(glass.index_at(Nanometres(nm)));
        assert_close(found.to_degrees(), degrees, 1e-6, "deviation");
    }
}
