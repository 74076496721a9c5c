//! The references: whole, and of the scenes that are built in.

use nephroid::scene::builtin::pool;

use crate::prelude::*;
use support::glb::load_path;
use support::shared_or_skip;

const PAIRS: [(&str, &str); 8] = [
    ("S1", "ring"),
    ("S2", "ball"),
    ("S3", "pool"),
    ("S4", "prism"),
    ("S5", "mirror"),
    ("S6", "slab"),
    ("S7", "paraboloid"),
    ("S8", "nephroid"),
];

fn floor(scene: &Scene) -> &Mesh {
    let mut objects = scene.objects.iter();
    let floor = objects.find(|object| ["floor", "wall"].contains(&object.name.as_str()));
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
        for nm in [400.0, 486.13, 587.56, 656.27, 700.0].map(Nanometres) {
            let [theirs, own] = [(&scene, a), (&ours, b)].map(|(of, it)| of.material_of(it).index_at(nm));
            assert_close(theirs, own, 1e-12, "refractive index");
        }
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
