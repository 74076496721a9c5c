//! Bodies of glass: of several parts, inside out, and open.

use nephroid::scene::watertight::volume_m3;
use nephroid::transport::media_at;

use crate::prelude::*;
use support::meshes::{cuboid, inside_out, quad};

fn glass(volume: Value) -> Value {
    let mut extensions = json!({ "KHR_materials_transmission": { "transmissionFactor": 1.0 } });
    if !volume.is_null() {
        extensions["KHR_materials_volume"] = volume;
    }
    let factors = json!({ "metallicFactor": 0.0, "roughnessFactor": 0.0 });
    json!({ "name": "glass", "pbrMetallicRoughness": factors, "extensions": extensions })
}

/// A primitive of some of a mesh's triangles.
fn primitive(file: &mut Glb, mesh: &Mesh, triangles: &[[u32; 3]], material: usize) -> Value {
    let [positions, normals] = [&mesh.positions, &mesh.normals].map(|vectors| file.push_vectors(vectors));
    let indices = file.push_indices(&triangles.concat());
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    json!({ "attributes": attributes, "indices": indices, "material": material })
}

fn unit_cube() -> Mesh {
    cuboid(DVec3::ZERO, dvec3(1.0, 1.0, 1.0))
}

/// The triangles of a unit cube in two parts, of glass with a volume and of another material, by way of `place`.
fn halves(first: Value, second: Value, place: impl FnOnce(&mut Glb, [Value; 2])) -> Scene {
    let mut file = Glb::empty();
    let cube = unit_cube();
    let materials = [first, second].map(|material| file.push("materials", material));
    let (low, high) = cube.triangles.split_at(5);
    let parts = [(low, materials[0]), (high, materials[1])];
    let parts = parts.map(|(part, material)| primitive(&mut file, &cube, part, material));
    place(&mut file, parts);
    file.scene()
}

/// Whether a point is inside the bodies of this many objects.
#[track_caller]
fn bodies_around(scene: &Scene, point: DVec3, expected: usize) {
    let tracer = Tracer::new(Arc::new(scene.clone()));
    assert_eq!(media_at(&tracer, point).objects().len(), expected);
    // A ray across is outside again behind the body.
    let mut ray = Ray {
        origin: dvec3(-9.0, point.y, point.z + 0.01),
        direction: DVec3::X,
    };
    let mut media = MediumStack::default();
    let mut within = 0;
    while let Some(hit) = tracer.closest_hit(&ray) {
        let interaction = tracer.interact(&hit, ray.direction, &media);
        media = interaction.transmission.expect("clear glass").media;
        within = within.max(media.objects().len());
        ray = hit.spawn(ray.direction);
    }
    assert_eq!((within, media.objects().len()), (expected, 0));
}

#[test]
fn parts_that_close_together_are_one_body() {
    let volume = || glass(json!({ "thicknessFactor": 1.0 }));
    let one_mesh = halves(volume(), volume(), |file, parts| {
        let mesh = file.push("meshes", json!({ "primitives": parts }));
        file.push_root(json!({ "mesh": mesh }));
    });
    // Two nodes under three levels of parents, mirrored and scaled.
    let family = halves(volume(), glass(Value::Null), |file, parts| {
        let nodes = parts.map(|part| {
            let mesh = file.push_mesh(part);
            file.push("nodes", json!({ "mesh": mesh }))
        });
        let inner = file.push("nodes", json!({ "children": nodes, "scale": [-0.7, 1.1, 0.9] }));
        let middle = file.push(
            "nodes",
            json!({ "children": [inner], "translation": [0.3, 0.0, 0.1] }),
        );
        file.push_root(json!({ "children": [middle] }));
    });
    for (scene, place) in [(one_mesh, DVec3::splat(0.4)), (family, dvec3(0.0, 0.5, 0.4))] {
        warns_not(&scene);
        assert_eq!([0, 1].map(|part| scene.body_of(part)), [0, 0]);
        let kinds = [0, 1].map(|part| scene.material_of(part).surface);
        assert_eq!(kinds, [SurfaceKind::Dielectric; 2]);
        bodies_around(&scene, place, 1);
    }
}

#[test]
fn an_opaque_part_closes_a_body_too() {
    let black = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0 } });
    for volume in [json!({ "thicknessFactor": 1.0 }), Value::Null] {
        let scene = halves(glass(volume), black.clone(), |file, parts| {
            let mesh = file.push("meshes", json!({ "primitives": parts }));
            file.push_root(json!({ "mesh": mesh }));
        });
        assert_eq!(scene.material_of(0).surface, SurfaceKind::Dielectric);
        warns_not(&scene);
    }
}

#[test]
fn what_is_inside_out_is_turned() {
    for volume in [json!({ "thicknessFactor": 1.0 }), Value::Null] {
        for split in [12, 5] {
            let mut file = Glb::empty();
            let material = file.push("materials", glass(volume.clone()));
            let mut cube = unit_cube();
            cube.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            let parts = cube.triangles.chunks(split);
            let parts: Vec<Value> = parts
                .map(|part| primitive(&mut file, &cube, part, material))
                .collect();
            let mesh = file.push("meshes", json!({ "primitives": parts }));
            for (place, scale) in [(0.0, 1.0), (3.0, -1.0)] {
                file.push_root(json!({ "mesh": mesh, "translation": [0, place, 0], "scale": [scale, 1, 1] }));
            }
            let scene = file.scene();
            warns(&scene, "inside out");
            let sum = |node: usize| -> f64 {
                let parts = scene.objects.iter().filter(|object| object.node == node);
                parts.map(|part| volume_m3(part.in_scene())).sum()
            };
            near([0, 1].map(sum), [1.0; 2], 1e-9, "volumes");
            for (object, part) in scene.objects.iter().enumerate() {
                let mesh = part.copy_in_scene();
                let agrees =
                    |triangle| mesh.face_normal(triangle).dot(mesh.corner_normals(triangle)[0]) > 0.0;
                assert!((0..mesh.triangles.len()).all(agrees), "{object}");
            }
            bodies_around(&scene, DVec3::splat(0.4), 1);
        }
    }
}

/// Both sides of a face, written as two.
#[test]
fn faces_that_a_body_has_twice_count_once() {
    for (twice, other_diagonal) in [(1, false), (6, false), (12, false), (12, true)] {
        let mut file = Glb::empty();
        let material = file.push("materials", glass(json!({ "thicknessFactor": 1.0 })));
        let mut cube = unit_cube();
        let mut backs = unit_cube();
        backs.triangles.truncate(twice);
        if other_diagonal {
            for pair in backs.triangles.chunks_exact_mut(2) {
                let [[a, b, c], [_, _, d]] = [pair[0], pair[1]];
                pair.copy_from_slice(&[[a, b, d], [b, c, d]]);
            }
        }
        shapes::append(&mut cube, &inside_out(backs));
        let part = primitive(&mut file, &cube, &cube.triangles, material);
        let mesh = file.push_mesh(part);
        for (place, scale) in [(0.0, 1.0), (3.0, -1.0)] {
            file.push_root(json!({ "mesh": mesh, "translation": [0, place, 0], "scale": [scale, 1, 1] }));
        }
        let scene = file.scene();
        warns(&scene, "faces that it has twice");
        for object in &scene.objects {
            assert_eq!(object.mesh().triangles.len(), 12);
            near(volume_m3(object.in_scene()), 1.0, 1e-9, "volume");
        }
        bodies_around(&scene, DVec3::splat(0.4), 1);
    }
}

#[test]
fn an_open_mesh_bounds_nothing_unless_water_is_held() {
    let sheet = |double_sided: bool, walls: bool| {
        let mut file = Glb::empty();
        // Half is left behind each 0.25 m.
        let tint =
            json!({ "thicknessFactor": 0.5, "attenuationDistance": 0.25, "attenuationColor": [0.5, 1, 1] });
        let mut water = glass(tint);
        water["doubleSided"] = json!(double_sided);
        let material = file.push("materials", water);
        let wall = file.push(
            "materials",
            json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0 } }),
        );
        let level = quad(dvec3(0.0, 0.5, 0.0), DVec3::X, DVec3::Z);
        let part = primitive(&mut file, &level, &level.triangles, material);
        let mesh = file.push_mesh(part);
        file.push_root(json!({ "name": "sheet", "mesh": mesh }));
        if walls {
            let basin = cuboid(dvec3(-0.001, 0.0, -0.001), dvec3(1.001, 1.0, 1.001));
            let part = primitive(&mut file, &basin, &basin.triangles, wall);
            let mesh = file.push_mesh(part);
            file.push_root(json!({ "mesh": mesh }));
        }
        file.scene()
    };
    let held = sheet(false, true);
    assert_eq!(held.material_of(0).surface, SurfaceKind::Dielectric);
    for scene in [sheet(false, false), sheet(true, true)] {
        assert_eq!(scene.material_of(0).surface, SurfaceKind::ThinWall);
        warns(&scene, "node `sheet` | states a volume but bounds none");
        let [red, green, _] = scene.material_of(0).base_colour.to_array();
        near(red, 0.25, 1e-7, "as thick as it is stated to be");
        near(green, 1.0, 1e-7, "green");
    }
}

#[test]
fn a_closed_mesh_has_the_interior_that_is_stated() {
    let volume =
        json!({ "thicknessFactor": 0.0, "attenuationDistance": 0.1, "attenuationColor": [0.5, 0.25, 0.75] });
    let scene = Glb::tetrahedron().with_material(glass(volume)).scene();
    let found = scene.material_of(0).volume.expect("it is solid");
    near(found.attenuation_distance_m, 0.1, 1e-6, "distance");
    near(found.attenuation_colour, rgb(0.5, 0.25, 0.75), 1e-9, "colour");
}

#[test]
fn transmission_and_alpha_mix() {
    let mut half = glass(Value::Null);
    half["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = json!(0.5);
    let scene = Glb::triangle().with_material(half).scene();
    let read = scene.material_of(0);
    let mixture = read.mixture(LinearSrgb::WHITE, 1.0);
    assert_eq!(
        (read.surface, mixture.clear, mixture.body),
        (SurfaceKind::Varied, 0.5, 0.5)
    );
    for (mode, alpha) in [("BLEND", 0.25), ("OPAQUE", 1.0)] {
        let factors = json!({ "metallicFactor": 0.0 });
        let mut file =
            Glb::triangle().with_material(json!({ "pbrMetallicRoughness": factors, "alphaMode": mode }));
        let colours = file.push_floats(&[1.0, 1.0, 1.0, 0.25].repeat(3), 4);
        file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colours);
        let scene = file.scene();
        let read = scene.material_of(0);
        near(
            1.0 - read.mixture(LinearSrgb::WHITE, 1.0).hole,
            alpha,
            1e-6,
            "what is there",
        );
        // Matte: light passes straight through what is not there.
        assert!(!read.is_specular());
    }
}

#[test]
fn what_stays_dark_is_said() {
    let lamp = json!({ "type": "point", "intensity": 100.0 });
    let black = json!({ "name": "bulb", "pbrMetallicRoughness": { "metallicFactor": 0.0 } });
    let bulb = Glb::tetrahedron()
        .with_material(black.clone())
        .with_light("lamp", lamp.clone());
    warns(&bulb.scene(), "light `lamp` | is within `solid`, which is opaque");
    let mut facing = Glb::triangle()
        .with_material(black)
        .with_light("sun", json!({ "type": "directional" }));
    warns_not(&facing.scene());
    // The sun shines along −z, the triangle faces z; turned, its back is lit.
    facing.json["nodes"][0]["rotation"] = json!([1.0, 0.0, 0.0, 0.0]);
    warns(&facing.scene(), "node `tri` | faces away from every light");
}
