//! The built-in scenes are the surfaces that the references were computed on.

use std::collections::HashMap;

use nephroid::optics::refraction::refract;
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
        for (index, object) in scene.objects.iter().enumerate() {
            let (part, mesh) = (&object.name, object.mesh_in_scene());
            let at = format!("{name}/{part}");
            // Normals of what waves lift are those of still water.
            let least = if scene.swells.contains_key(&index) {
                0.9
            } else {
                0.99
            };
            assert_eq!(mesh.positions.len(), mesh.normals.len(), "{at}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
            assert!(
                mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-14),
                "{at}"
            );
            assert!(!mesh.triangles.is_empty(), "{at}");
            for triangle in 0..mesh.triangles.len() {
                let face = mesh.face_normal(triangle);
                let agrees = |normal: DVec3| face.dot(normal) > least;
                assert!(
                    mesh.corner_normals(triangle).into_iter().all(agrees),
                    "{at}: {triangle}"
                );
            }
        }
    }
    assert!(build("Ring").is_none() && build("").is_none());
}

/// Its file is what the README and the guide say of it.
#[test]
fn gallery_has_an_exhibit_for_each_camera() {
    let scene = built_in("gallery");
    let cameras: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let expected = [
        "overview",
        "wine glass",
        "tumbler",
        "ring",
        "pool",
        "ceiling",
        "prism",
        "butterfly",
    ];
    assert_eq!(cameras, expected);
    let is_receiver = |object: &usize| !scene.material_of(*object).surface.is_specular();
    assert!((0..scene.objects.len()).filter(is_receiver).count() <= 40);
    assert_eq!(scene.lights.len(), 2);
}

/// That their light lands where it should is held by the references.
#[test]
fn solids_are_closed() {
    for (name, solids) in [
        ("ball", &["ball"][..]),
        ("slab", &["slab"]),
        ("prism", &["prism"]),
        ("spectrum", &["prism", "ball"]),
        ("bowl", &["bowl"]),
        (
            "gallery",
            &["wine glass", "wine", "tumbler", "whisky", "ball", "prism", "lens"],
        ),
    ] {
        let scene = built_in(name);
        for solid in solids {
            let mesh = object(&scene, solid).mesh_in_scene();
            assert_eq!(open_edges(mesh), 0, "{name}/{solid}");
            assert!(volume_m3(mesh) > 5e-5, "{name}/{solid}");
        }
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
