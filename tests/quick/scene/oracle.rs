//! The references: whole, and of the scenes that are built in.

use nephroid::scene::builtin::pool;

use crate::prelude::*;
use support::glb::load_path;
use support::{project_file, reference_map, shared_or_skip};

const PAIRS: [(&str, &str); 7] = [
    ("S1", "ring"),
    ("S2", "ball"),
    ("S3", "pool"),
    ("S5", "mirror"),
    ("S6", "slab"),
    ("S7", "paraboloid"),
    ("S8", "nephroid"),
];

fn floor(scene: &Scene) -> &Mesh {
    let floor = scene.objects.iter().find(|object| object.name == "floor");
    floor.expect("there is a floor").mesh_in_scene()
}

fn caster(scene: &Scene) -> usize {
    let casters = |index: &usize| scene.material_of(*index).surface.is_specular();
    let mut found = (0..scene.objects.len()).filter(casters);
    let caster = found.next().expect("there is something specular");
    assert_eq!(found.next(), None);
    caster
}

fn assert_same_light(file: &Scene, ours: &Scene) {
    assert_eq!((file.lights.len(), ours.lights.len()), (1, 1));
    // The files state 32-bit numbers.
    let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-6, "{a} and {b}");
    match (file.lights[0].kind, ours.lights[0].kind) {
        (
            LightKind::Point { position, intensity },
            LightKind::Point {
                position: p,
                intensity: i,
            },
        ) => {
            near(position, p);
            assert_close(intensity.0, i.0, 1e-6, "radiant intensity");
        }
        (
            LightKind::Sun {
                direction,
                normal_irradiance,
            },
            LightKind::Sun {
                direction: d,
                normal_irradiance: e,
            },
        ) => {
            near(direction, d);
            assert_close(normal_irradiance.0, e.0, 1e-6, "irradiance");
        }
        kinds => panic!("{kinds:?}"),
    }
}

#[test]
fn files_and_built_in_scenes_agree() {
    for (file, name) in PAIRS {
        let Some(path) = shared_or_skip(&format!("oracle/{file}.glb")) else {
            return;
        };
        let scene = load_path(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let ours = built_in(name);
        assert!(scene.warnings.is_empty(), "{file}: {:?}", scene.warnings);
        assert_same_light(&scene, &ours);
        let (a, b) = (floor(&scene), floor(&ours));
        assert_close(a.area_m2(), b.area_m2(), 1e-6, "floor");
        let corner = |mesh: &Mesh| {
            let uvs = mesh.uv0.as_ref().expect("floor has TEXCOORD_0");
            let at = uvs
                .iter()
                .position(|uv| *uv == DVec2::new(1.0, 0.0))
                .expect("has a corner at (1, 0)");
            mesh.positions[at]
        };
        assert!(
            (corner(a) - corner(b)).length() < 1e-6,
            "{file}: the maps lie alike"
        );
        let (a, b) = (caster(&scene), caster(&ours));
        assert_eq!(
            scene.material_of(a).surface,
            ours.material_of(b).surface,
            "{file}"
        );
        assert_close(
            scene.material_of(a).ior,
            ours.material_of(b).ior,
            1e-12,
            "refractive index",
        );
        // The file has waves as a fine mesh.
        let waves = ours.material_of(b).waves.as_ref();
        let meshed = waves.map(|waves| pool::meshed(DVec3::Y, [1.5; 2], [512; 2], waves));
        let b = meshed.as_ref().unwrap_or(ours.objects[b].mesh_in_scene());
        let a = scene.objects[a].mesh_in_scene();
        assert_close(a.area_m2(), b.area_m2(), 1e-5, file);
        assert!(
            b.triangles.len() >= a.triangles.len(),
            "{file}: {} < {}",
            b.triangles.len(),
            a.triangles.len()
        );
        let (low, high) = a.bounds().expect("has vertices");
        let (our_low, our_high) = b.bounds().expect("has vertices");
        assert!(
            (low - our_low).length() + (high - our_high).length() < 2e-5,
            "{file}: bounds"
        );
    }
}

/// The maps' headers and means are those that `assets/SOURCES.md` states, to six decimals.
#[test]
fn references_are_whole() {
    for (file, mean) in [
        ("S1", 1.748_115),
        ("S2", 0.757_516),
        ("S3", 0.942_750),
        ("S5", 0.321_665),
        ("S6", 1.622_741),
        ("S7", 0.502_656),
        ("S8", 0.241_662),
    ] {
        let values = reference_map(file);
        assert_eq!(values.len(), 256 * 256);
        near(values.iter().sum::<f64>() / 65_536.0, mean, 5.1e-7, file);
    }
    project_file("assets/reference/S2_profile.csv");
}

/// The corners of a mesh, triangle by triangle, in an order that says nothing of the file's.
fn corners(mesh: &Mesh) -> Vec<[i64; 3]> {
    // The file states 32-bit numbers: to 1 µm.
    let round = |point: DVec3| point.to_array().map(|x| (x * 1e6).round() as i64);
    let all = (0..mesh.triangles.len()).flat_map(|triangle| mesh.corners(triangle));
    let mut all: Vec<_> = all.map(round).collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[test]
fn prism_is_that_of_its_file() {
    let Some(path) = shared_or_skip("oracle/S4.glb") else {
        return;
    };
    let scene = load_path(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let ours = built_in("prism");
    warns_not(&scene);
    assert_same_light(&scene, &ours);
    assert_eq!(scene.objects.len(), ours.objects.len());
    for (index, (theirs, own)) in scene.objects.iter().zip(&ours.objects).enumerate() {
        assert_eq!(
            corners(theirs.mesh_in_scene()),
            corners(own.mesh_in_scene()),
            "{}",
            own.name
        );
        assert_close(
            theirs.mesh_in_scene().area_m2(),
            own.mesh_in_scene().area_m2(),
            1e-4,
            &own.name,
        );
        let (theirs, own) = (scene.material_of(index), ours.material_of(index));
        assert_eq!(theirs.surface, own.surface);
        assert_eq!(theirs.base_colour, own.base_colour);
        for nm in [400.0, 486.13, 587.56, 656.27, 700.0] {
            let [a, b] = [theirs, own].map(|material| material.index_at(Nanometres(nm)));
            assert_close(a, b, 1e-12, "refractive index");
        }
    }
    let [wall, own] = [&scene, &ours].map(|scene| scene.objects[0].mesh_in_scene());
    let [uvs, own_uvs] = [wall, own].map(|mesh| mesh.uv0.as_ref().expect("it has TEXCOORD_0"));
    assert_eq!(wall.positions.len(), 4);
    for (position, uv) in wall.positions.iter().zip(uvs) {
        let mut corners = own.positions.iter();
        let same = corners.position(|own| own.distance(*position) < 1e-6);
        assert_eq!(own_uvs[same.expect("the same corner")], *uv);
    }
}
