//! Files as programs for the web write them: compressed, quantised, instanced. The files in `goldens/gltf` are tori packed
//! by C++ Draco 1.5.7 and by meshoptimizer 1.3, and images by Basis Universal.

use glam::DAffine3;
use nephroid::scene::open_document;

use crate::prelude::*;
use support::glb::{assembled, golden, load_bytes, load_path, parts_of};

fn packed(name: &str) -> Scene {
    load_bytes(&golden(name), &LoadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The torus at a texture coordinate: where it is, and its normal.
fn torus(uv: DVec2) -> (DVec3, DVec3) {
    let (around, across) = (2.0 * PI * uv.x, 2.0 * PI * uv.y);
    let out = dvec3(around.cos(), 0.0, around.sin());
    let normal = across.cos() * out + across.sin() * DVec3::Y;
    (2.0 * out + 0.7 * normal + DVec3::Y, normal)
}

#[track_caller]
fn is_torus(mesh: &Mesh, triangles: usize, at: DAffine3, (off_m, off_normal): (f64, f64), what: &str) {
    assert_eq!(mesh.triangles.len(), triangles, "{what}");
    let uvs = mesh.uv0.as_ref().expect("texture coordinates");
    for (vertex, uv) in uvs.iter().enumerate() {
        let (position, normal) = torus(*uv);
        near(mesh.positions[vertex], at.transform_point3(position), off_m, what);
        near(
            mesh.normals[vertex],
            at.transform_vector3(normal),
            off_normal,
            what,
        );
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        let (_, normal) = torus(uvs[corners[0] as usize]);
        let faces = mesh.face_normal(triangle).dot(at.transform_vector3(normal));
        assert!(faces.abs() > 0.3, "{what}: triangle {triangle} lies askew");
    }
}

#[test]
fn draco_is_unpacked() {
    for name in ["draco.glb", "draco_sequential.glb"] {
        let scene = packed(name);
        warns_not(&scene);
        let at = DAffine3::from_translation(dvec3(1.0, 2.0, 3.0));
        is_torus(scene.objects[0].mesh_in_scene(), 96, at, (5e-3, 5e-3), name);
    }
    let mut damaged = golden("draco.glb");
    let end = damaged.len();
    damaged[end - 600..].fill(0x55);
    let refused = load_bytes(&damaged, &LoadOptions::default()).expect_err("it is damaged");
    says(
        refused,
        "mesh `torus`, primitive 0 | its Draco data cannot be unpacked",
    );
}

/// Both versions with every mode and filter; the wide files are instanced.
#[test]
fn meshopt_is_unpacked() {
    let scene = packed("meshopt.glb");
    assert!(
        scene
            .warnings
            .iter()
            .all(|warning| warning.what.contains("colours")),
        "{:?}",
        scene.warnings
    );
    let mut found = scene.objects.iter();
    for (node, (name, triangles)) in [("v0", 512), ("v0wide", 160), ("v1", 512), ("v1wide", 160)]
        .into_iter()
        .enumerate()
    {
        let node = DAffine3::from_translation(6.0 * node as f64 * DVec3::X);
        let is_wide = name.ends_with("wide");
        for instance in 0..if is_wide { 5 } else { 1 } {
            let object = found.next().expect("an object");
            let half = 0.3 * f64::from(instance);
            let turn = DQuat::from_axis_angle(dvec3(0.6, 0.8, 0.0), 2.0 * half);
            let place = dvec3(0.0, 3.0, 0.25) * f64::from(instance);
            let (at, called) = match is_wide {
                true => (
                    DAffine3::from_rotation_translation(turn, place),
                    format!("{name}_{:04}", instance + 1),
                ),
                false => (DAffine3::IDENTITY, name.to_owned()),
            };
            assert_eq!(object.name, called);
            let mesh = object.mesh_in_scene();
            is_torus(
                mesh,
                triangles,
                node * at,
                (2e-3, if is_wide { 2e-3 } else { 0.02 }),
                name,
            );
            let second = mesh.uv1.as_ref().expect("a second set");
            for (uv, second) in mesh.uv0.iter().flatten().zip(second) {
                near(*second, torus(*uv).0.truncate(), 1e-3, "floats without a filter");
            }
            let material = &scene.materials[object.material];
            let colour = if name.starts_with("v1") {
                [0.5525, 0.5, 0.3]
            } else {
                [1.0; 3]
            };
            let sums = (0..mesh.triangles.len()).fold(LinearSrgb::BLACK, |sum, triangle| {
                sum + mesh.colour(triangle, [1.0 / 3.0; 3]) * mesh.triangle_area_m2(triangle)
            });
            let mean = material.base_colour * sums / mesh.area_m2();
            near(mean.to_array(), colour, 0.02, name);
        }
    }
    assert!(found.next().is_none());
}

#[test]
fn damaged_meshopt_is_refused() {
    let whole = golden("meshopt.glb");
    for (what, words) in rows(
        r#"
        "byteStride":12 => "byteStride":13 => its data is damaged
        "count":289 => "count":999999999 => its size cannot be right
        "mode":"TRIANGLES" => "mode":"TRIANGLEZ" => unknown variant
        "filter":"OCTAHEDRAL" => "filter":"QUATERNION" => its data is damaged
        "#,
    ) {
        let (with, words) = words.split_once(" => ").expect("three columns");
        let file = changed(&whole, what, with);
        let refused = load_bytes(&file, &LoadOptions::default()).expect_err(what);
        says(
            refused,
            &format!("needs buffer view | cannot be unpacked | {words}"),
        );
    }
}

/// A file with a text of its document replaced wherever it stands.
fn changed(glb: &[u8], what: &str, with: &str) -> Vec<u8> {
    let (text, binary) = parts_of(glb).expect("it is whole");
    let text = String::from_utf8_lossy(text).replace(what, with);
    assembled(text.into_bytes(), binary.to_vec())
}

#[test]
fn basis_images_are_read() {
    for name in ["etc1s.ktx2", "uastc.ktx2"] {
        let image = json!({ "mimeType": "image/ktx2" });
        let basisu = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
        let mut file = Glb::triangle().with_texture(&golden(name), image, basisu);
        file.json["extensionsUsed"] = json!(["KHR_texture_basisu"]);
        file.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
        let image = &file.scene().textures[0];
        let quarters = [
            (3.0, 3.0, [230, 40, 40, 255]),
            (12.0, 3.0, [40, 200, 60, 255]),
            (3.0, 12.0, [50, 60, 220, 255]),
        ];
        for (column, row, texel) in quarters {
            let found = image.code(column, row).map(f64::from);
            near(found, texel.map(f64::from), 12.0, name);
        }
        assert_eq!(image.code(12.0, 12.0)[3], 0, "{name}");
    }
}

/// Adds an accessor of vectors of three integers, with 4-byte strides.
fn push_integers(file: &mut Glb, component: u32, normalised: bool, values: &[i32]) -> usize {
    let bytes = if matches!(component, 5120 | 5121) { 1 } else { 2 };
    let mut data = Vec::new();
    for vector in values.chunks(3) {
        data.extend(
            vector
                .iter()
                .flat_map(|value| value.to_le_bytes().into_iter().take(bytes)),
        );
        data.resize(data.len().next_multiple_of(4), 0);
    }
    let view = file.push_view(&data);
    file.json["bufferViews"][view]["byteStride"] = json!((3 * bytes).next_multiple_of(4));
    let count = values.len() / 3;
    let item = json!({ "bufferView": view, "componentType": component, "count": count, "type": "VEC3", "normalized": normalised });
    file.push("accessors", item)
}

#[test]
fn integers_stand_for_places_and_directions() {
    let plain = Glb::tetrahedron().scene();
    let plain = plain.objects[0].mesh_in_scene();
    let corners = [1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1];
    // Component, whether it is normalised, what stands for −1 and 1, and what brings them there.
    for (component, normalised, [low, high], scale, shift) in [
        (5120, false, [-100, 100], 0.01, 0.0),
        (5120, true, [-127, 127], 1.0, 0.0),
        (5121, false, [0, 200], 0.01, -1.0),
        (5121, true, [0, 255], 2.0, -1.0),
        (5122, false, [-20_000, 20_000], 5e-5, 0.0),
        (5122, true, [-32_768, 32_767], 1.0, 0.0),
        (5123, false, [40_000, 60_000], 1e-4, -5.0),
        (5123, true, [0, 65_535], 2.0, -1.0),
    ] {
        let mut file = Glb::tetrahedron();
        let positions = corners.map(|sign| if sign < 0 { low } else { high });
        let positions = push_integers(&mut file, component, normalised, &positions);
        let normals = push_integers(&mut file, 5120, true, &corners.map(|sign| 73 * sign));
        file.json["meshes"][0]["primitives"][0]["attributes"] =
            json!({ "POSITION": positions, "NORMAL": normals });
        file.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        file.json["nodes"][0]["translation"] = json!([shift, shift, shift]);
        file.assert_refused("has a format that glTF does not allow there");
        file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let scene = file.scene();
        warns_not(&scene);
        let mesh = scene.objects[0].mesh_in_scene();
        assert_eq!(mesh.triangles, plain.triangles);
        for (vertex, position) in plain.positions.iter().enumerate() {
            near(mesh.positions[vertex], *position, 1e-12, (component, normalised));
            near(
                mesh.normals[vertex],
                plain.normals[vertex],
                1e-12,
                (component, normalised),
            );
        }
    }
}

#[test]
fn instances_are_objects_and_can_be_written() {
    let mut file = Glb::tetrahedron();
    let places = file.push_floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 7.0], 3);
    let sizes = file.push_floats(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 3.0], 3);
    let attributes = json!({ "TRANSLATION": places, "SCALE": sizes, "_ID": 0 });
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    file.json["nodes"][0]["translation"] = json!([0.0, 1.0, 0.0]);
    file.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let folder = folder();
    let path = folder.path().join("many.glb");
    std::fs::write(&path, file.bytes()).expect("can be written");
    let scene = load_path(&path, &LoadOptions::default()).expect("it can be read");
    warns_not(&scene);
    let opened = open_document(&scene, &LoadOptions::default()).expect("it can be opened");
    let written = opened.glb.into_bytes().expect("it is small");
    let again = load_bytes(&written, &LoadOptions::default()).expect("it can be read again");
    for scene in [&scene, &again] {
        let names: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!(names, ["solid_0001", "solid_0002", "solid_0003"]);
        for (object, (place, size)) in scene.objects.iter().zip([
            (dvec3(0.0, 1.0, 0.0), DVec3::ONE),
            (dvec3(5.0, 1.0, 0.0), DVec3::splat(2.0)),
            (dvec3(0.0, 1.0, 7.0), dvec3(1.0, 1.0, 3.0)),
        ]) {
            near(
                object.mesh_in_scene().positions[0],
                place + size,
                1e-12,
                &object.name,
            );
        }
    }
    file.json["accessors"][sizes]["count"] = json!(2);
    file.assert_refused(
        "node `solid`: its instances have different numbers of translations, rotations and scales",
    );
}

#[test]
fn morph_targets_have_their_default_weights() {
    let mut file = Glb::triangle();
    let target = file.push_floats(&[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 4.0], 3);
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    for (of_mesh, of_node, heights) in [
        (json!([0.5]), Value::Null, [1.0, 1.0, 2.0]),
        (json!([0.5]), json!([1.0]), [2.0, 2.0, 4.0]),
        (json!([0.5]), json!([0.0]), [0.0; 3]),
        (Value::Null, Value::Null, [0.0; 3]),
        (json!("none"), json!({}), [0.0; 3]),
    ] {
        file.json["meshes"][0]["weights"] = of_mesh;
        file.json["nodes"][0]["weights"] = of_node;
        let scene = file.scene();
        warns(&scene, "morph targets | at rest");
        let positions = &scene.objects[0].mesh_in_scene().positions;
        let found: Vec<f64> = positions.iter().map(|position| position.z).collect();
        near([found[0], found[1], found[2]], heights, 1e-12, "heights");
    }
}

#[test]
fn skins_stand_where_their_joints_do() {
    let mut file = Glb::triangle();
    let joints = file.push_view(&[0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0]);
    let joints = json!({ "bufferView": joints, "componentType": 5121, "count": 3, "type": "VEC4" });
    let joints = file.push("accessors", joints);
    let weights = file.push_floats(&[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0], 4);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    let (low, high) = (
        file.push_root(json!({ "translation": [0.0, 0.0, 1.0] })),
        file.push_root(json!({ "translation": [10.0, 0.0, 3.0], "scale": [2.0, 2.0, 2.0] })),
    );
    file.json["nodes"][0]["skin"] = json!(0);
    // What a skin bends stands where its joints do, wherever its node is.
    file.json["nodes"][0]["translation"] = json!([0.0, 99.0, 0.0]);
    file.json["skins"] = json!([{ "joints": [low, high] }]);
    let scene = file.scene();
    warns(&scene, "skins | at rest");
    let expected = [dvec3(0.0, 0.0, 1.0), dvec3(12.0, 0.0, 3.0), dvec3(5.0, 1.5, 2.0)];
    for (position, expected) in scene.objects[0].mesh_in_scene().positions.iter().zip(expected) {
        near(*position, expected, 1e-12, "corner");
    }
    file.json["skins"] = json!([{ "joints": [low] }]);
    warns(&file.scene(), "do not fit its vertices; it was left as it is");
}

#[test]
fn materials_of_old_are_converted() {
    for (stated, base, metallic, roughness) in [
        (
            json!({ "diffuseFactor": [0.5, 0.25, 0.0, 1.0], "specularFactor": [0.04, 0.04, 0.04], "glossinessFactor": 0.8 }),
            [0.5, 0.25, 0.0],
            0.0,
            0.2,
        ),
        (
            json!({ "diffuseFactor": [0.0, 0.0, 0.0, 1.0], "specularFactor": [0.9, 0.7, 0.3] }),
            [0.9, 0.7, 0.3],
            1.0,
            0.0,
        ),
        (
            json!({ "diffuseFactor": [0.5, 0.5, 0.5, 1.0], "specularGlossinessTexture": { "index": 0 }, "glossinessFactor": 0.5 }),
            [0.5; 3],
            0.0,
            0.5,
        ),
    ] {
        let has_texture = stated.get("specularGlossinessTexture").is_some();
        let name = "KHR_materials_pbrSpecularGlossiness";
        let mut file = Glb::triangle().with_material(json!({ "extensions": { name: stated } }));
        file.json["extensionsUsed"] = json!([name]);
        file.json["extensionsRequired"] = json!([name]);
        let scene = file.scene();
        match has_texture {
            true => warns(&scene, "its specular-glossiness was read without its texture"),
            false => warns_not(&scene),
        }
        let material = scene.material_of(0);
        near(material.base_colour.to_array(), base, 1e-6, "base colour");
        near(
            [material.metallic, material.roughness],
            [metallic, roughness],
            1e-6,
            "metallic and roughness",
        );
    }
}

#[test]
fn hidden_nodes_are_left_out_with_all_below() {
    let mut file = Glb::triangle();
    let below = file.push("nodes", json!({ "mesh": 0 }));
    let hidden = json!({ "children": [below], "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": false } } });
    file.push_root(hidden);
    file.json["extensionsUsed"] = json!(["KHR_node_visibility"]);
    let scene = file.scene();
    warns_not(&scene);
    assert_eq!(scene.objects.len(), 1);
}

#[test]
fn variants_are_named() {
    let mut file = Glb::triangle();
    let variants = json!({ "variants": [{ "name": "red" }, { "name": "blue" }] });
    file.json["extensions"] = json!({ "KHR_materials_variants": variants });
    file.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    warns(
        &file.scene(),
        "materials | have variants, which are left out (red, blue)",
    );
}
