//! Geometry from files: where it stands, which way it faces, and what is wrong with it.

use std::f64::consts::FRAC_1_SQRT_2;

use crate::prelude::*;

fn only_mesh(scene: &Scene) -> &Mesh {
    assert_eq!(scene.objects.len(), 1);
    scene.objects[0].mesh_in_scene()
}

pub fn volume_m3(mesh: &Mesh) -> f64 {
    let six_volumes = (0..mesh.triangles.len()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        a.dot(b.cross(c))
    });
    six_volumes.sum::<f64>() / 6.0
}

fn below(mut file: Glb, mut parent: Value) -> Glb {
    parent["children"] = file.json["scenes"][0]["nodes"].clone();
    let index = file.push("nodes", parent);
    file.json["scenes"][0]["nodes"] = json!([index]);
    file
}

fn attributes(file: &mut Glb) -> &mut Value {
    &mut file.json["meshes"][0]["primitives"][0]["attributes"]
}

fn triangle(corners: &[f32; 9]) -> Glb {
    let mut file = Glb::triangle();
    let positions = file.push_floats(corners, 3);
    attributes(&mut file)["POSITION"] = json!(positions);
    file
}

#[test]
fn mirroring_keeps_the_outside_outside() {
    for (scale, volume) in [
        ([1.0, 1.0, 1.0], 8.0 / 3.0),
        ([-2.0, 1.0, 1.0], 16.0 / 3.0),
        ([-1.0, -3.0, -0.5], 4.0),
    ] {
        let scene = below(Glb::tetrahedron(), json!({ "scale": scale })).scene();
        let mesh = only_mesh(&scene);
        assert_close(volume_m3(mesh), volume, 1e-12, "volume by the winding");
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!(position.dot(*normal) > 0.0, "{normal} at {position}, {scale:?}");
        }
    }
}

#[test]
fn normals_stay_perpendicular_under_shear() {
    // The plane x + y = 0 with its normal.
    let mut file = triangle(&[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0, 1.0, 0.0]);
    let normals = file.push_floats(&[0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0].repeat(3), 3);
    attributes(&mut file)["NORMAL"] = json!(normals);
    let shear = "[3, 0, 0, 0, 0.5, 1, 0, 0, 0.2, -0.7, -2, 0, 4, 5, 6, 1]";
    for parent in [
        json!({ "scale": [5.0, 1.0, 0.2] }),
        json!({ "matrix": parsed(shear) }),
    ] {
        let scene = below(file.clone(), parent).scene();
        let mesh = only_mesh(&scene);
        for normal in &mesh.normals {
            near(mesh.face_normal(0).dot(*normal).abs(), 1.0, 1e-7, normal);
        }
    }
}

#[test]
fn missing_and_bad_normals_are_those_of_faces() {
    let mut file = Glb::tetrahedron();
    attributes(&mut file)
        .as_object_mut()
        .expect("is an object")
        .remove("NORMAL");
    let scene = file.scene();
    let mesh = only_mesh(&scene);
    assert_eq!(mesh.positions.len(), 12, "corners of their own");
    for triangle in 0..4 {
        assert_eq!(mesh.corner_normals(triangle), [mesh.face_normal(triangle); 3]);
    }
    assert_close(volume_m3(mesh), 8.0 / 3.0, 1e-12, "volume");
    let mut file = Glb::triangle();
    let normals = file.push_floats(&[0.0, 0.0, 0.0, f32::NAN, 0.0, 1.0, 0.0, 0.0, 3.0], 3);
    attributes(&mut file)["NORMAL"] = json!(normals);
    let scene = file.scene();
    assert_eq!(only_mesh(&scene).normals, [DVec3::Z; 3]);
    warns(&scene, "mesh0 | 2 normals are zero or not finite");
    warns(&scene, "mesh0 | 1 normals are not of length 1");
}

#[test]
fn positions_that_are_no_numbers_are_refused() {
    for bad in [f32::NAN, f32::INFINITY] {
        let file = triangle(&[0.0, 0.0, 0.0, 1.0, 0.0, bad, 0.0, 1.0, 0.0]);
        file.assert_refused("test.glb: mesh `mesh0`, primitive 0: the position of vertex 1");
    }
    below(Glb::triangle(), json!({ "scale": [1e30, 1e30, 1e30] })).assert_refused("lies farther than");
    let huge = || json!({ "scale": [1e300, 1.0, 1.0] });
    below(below(Glb::triangle(), huge()), huge()).assert_refused("its transform is infinite");
}

#[test]
fn counts_beyond_the_data_are_refused_at_once() {
    let mut file = Glb::triangle();
    let indices = file.push_indices(&[0, 1, 7]);
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    file.assert_refused("refers to vertex 7, but has only 3");

    let mut file = Glb::triangle();
    for count in [4_000_000_000_u64, u64::MAX] {
        file.json["accessors"][0]["count"] = json!(count);
        file.assert_refused("do not fit into buffer view 0");
    }
    let mut file = Glb::triangle();
    let fields = file.json["accessors"][0].as_object_mut().expect("is an object");
    fields.remove("bufferView");
    fields["count"] = json!(4_000_000_000_u64);
    file.assert_refused("would take more memory than the limit");

    let mut file = Glb::triangle();
    file.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX);
    file.assert_refused("ends beyond its buffer");

    // Neither can instances exceed the limit.
    let mut file = Glb::triangle();
    for _ in 0..20_000 {
        file.push_root(json!({ "mesh": 0 }));
    }
    let refused = file.load_with(&options(|options| options.memory_limit_bytes = 4_000_000));
    says(
        refused.expect_err("too much"),
        "would take more memory than the limit of 4 MB",
    );
    assert_eq!(file.scene().objects.len(), 20_001);
}

#[test]
fn strips_and_fans_face_as_specified() {
    let mut file = Glb::empty();
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let positions = file.push_floats(&square, 3);
    let attributes = json!({ "POSITION": positions });
    let strip = file.push_mesh(json!({ "attributes": attributes, "mode": 5 }));
    let order = file.push_indices(&[0, 1, 3, 2]);
    let fan = file.push_mesh(json!({ "attributes": attributes, "mode": 6, "indices": order }));
    let lines = file.push_mesh(json!({ "attributes": attributes, "mode": 1 }));
    let odd = file.push_indices(&[0, 1, 2, 3]);
    let left_over = file.push_mesh(json!({ "attributes": attributes, "indices": odd }));
    for mesh in [strip, fan, lines, left_over] {
        file.push_root(json!({ "mesh": mesh }));
    }
    let scene = file.scene();
    assert_eq!(scene.objects.len(), 3);
    for object in &scene.objects[..2] {
        assert_close(object.mesh_in_scene().area_m2(), 1.0, 1e-15, "area");
        assert!((0..2).all(|triangle| object.mesh_in_scene().face_normal(triangle) == DVec3::Z));
    }
    warns(&scene, "mesh2 | points or lines");
    warns(&scene, "mesh3 | 1 vertices at its end make no triangle");
}

#[test]
fn sparse_values_and_short_texture_coordinates_are_read() {
    let mut file = Glb::triangle();
    let at = file.push_view(&[2, 0]);
    let value: Vec<u8> = [0.0_f32, 5.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let values = file.push_view(&value);
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": at, "componentType": 5123 },
        "values": { "bufferView": values },
    });
    let view = file.push_view(&[0, 255, 51, 102, 255, 0]);
    let uvs = r#"{"componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"}"#;
    let mut uvs = parsed(uvs);
    uvs["bufferView"] = json!(view);
    let uvs = file.push("accessors", uvs);
    attributes(&mut file)["TEXCOORD_0"] = json!(uvs);
    let scene = file.scene();
    let mesh = only_mesh(&scene);
    assert_eq!(mesh.positions[2], DVec3::Y * 5.0);
    let uvs: Vec<[f64; 2]> = mesh.uv0.iter().flatten().map(|uv| uv.to_array()).collect();
    assert_eq!(uvs, [[0.0, 1.0], [0.2, 0.4], [1.0, 0.0]]);
    let offset = file.json["bufferViews"][at]["byteOffset"].as_u64();
    file.binary[offset.expect("a number") as usize] = 9;
    file.assert_refused("sparse value for element 9");
}

/// On diffuse surfaces from corner to corner, elsewhere by the mean of a triangle.
#[test]
fn vertex_colours_multiply_the_base_colour() {
    let corners = [[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.5, 0.5, 0.5]];
    for (metallic, is_each) in [(0.0, true), (1.0, false)] {
        let mut file = Glb::triangle();
        let colours = file.push_floats(corners.as_flattened(), 3);
        attributes(&mut file)["COLOR_0"] = json!(colours);
        let factors = json!({ "baseColorFactor": [0.5, 1.0, 1.0, 1.0], "metallicFactor": metallic,
            "roughnessFactor": 1.0 - metallic });
        let scene = file
            .with_material(json!({ "pbrMetallicRoughness": factors }))
            .scene();
        let mesh = only_mesh(&scene);
        assert_eq!(mesh.colours.is_some(), is_each);
        let at = |barycentric: [f64; 3]| {
            let colour = mesh.colour(0, barycentric) * scene.material_of(0).base_colour;
            dvec3(colour.r, colour.g, colour.b)
        };
        let mean = dvec3(0.25, 0.5, 0.5);
        let first = if is_each { dvec3(0.5, 0.0, 0.5) } else { mean };
        near(at([1.0, 0.0, 0.0]), first, 1e-6, "first corner");
        near(at([1.0 / 3.0; 3]), mean, 1e-6, "middle");
        if is_each {
            warns_not(&scene);
        } else {
            warns(&scene, "vertex colours were read as their mean");
        }
    }
}

#[test]
fn flat_triangles_and_unused_vertices_are_dropped() {
    let mut file = Glb::tetrahedron();
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [2.0, 0.0, 0.0],
        [9e9, 0.0, 0.0],
    ];
    let positions = file.push_floats(corners.as_flattened(), 3);
    let normals = file.push_floats(&[0.0, 0.0, 1.0].repeat(5), 3);
    let indices = file.push_indices(&[0, 1, 2, 0, 1, 3, 2, 2, 1]);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    file.json["meshes"][0] = json!({ "primitives": [{ "attributes": attributes, "indices": indices }] });
    let scene = file.scene();
    assert_eq!(only_mesh(&scene).triangles.len(), 1);
    assert_eq!(scene.bounds(), Some((DVec3::ZERO, dvec3(1.0, 1.0, 0.0))));
    warns(&scene, "2 triangles without area were dropped");
}

#[test]
fn loops_shared_nodes_and_deep_chains_end() {
    let mut file = Glb::triangle();
    file.json["nodes"][0]["children"] = json!([0]);
    let scene = file.scene();
    assert_eq!(scene.objects.len(), 1);
    warns(&scene, "node `tri` | its own ancestor or has several parents");

    let mut file = Glb::triangle();
    for child in 0..100_000 {
        file.push("nodes", json!({ "children": [child], "translation": [1, 0, 0] }));
    }
    file.json["scenes"][0]["nodes"] = json!([100_000]);
    let scene = file.scene();
    assert_eq!(
        only_mesh(&scene).positions[0] + scene.origin_world,
        DVec3::X * 1e5
    );
}

#[test]
fn nodes_share_their_mesh_and_stand_as_if_alone() {
    let placed = [
        json!({}),
        json!({ "translation": [1.0, 0.5, 0.25] }),
        json!({ "rotation": [0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2], "scale": [1.0, 2.0, 3.0] }),
        json!({ "scale": [-1.0, 1.0, 1.0] }),
        json!({ "scale": [1.0, 1.0, -2.0] }),
    ];
    let mut flat = Glb::tetrahedron();
    attributes(&mut flat)
        .as_object_mut()
        .expect("is an object")
        .remove("NORMAL");
    for (of, shared) in [
        // Corners are split in the order of the scene's triangles.
        (flat, vec![(1, 2), (3, 4)]),
        (Glb::tetrahedron(), vec![(1, 2), (2, 3), (3, 4)]),
    ] {
        let with = |nodes: &[Value]| {
            let mut file = of.clone();
            file.json["scenes"][0]["nodes"] = json!([]);
            for node in nodes {
                let mut node = node.clone();
                node["mesh"] = json!(0);
                file.push_root(node);
            }
            file.scene()
        };
        let scene = with(&placed);
        for (object, node) in scene.objects.iter().zip(&placed) {
            let alone = with(std::slice::from_ref(node));
            assert_eq!(**object.mesh_in_scene(), *only_mesh(&alone), "{node}");
            assert!(volume_m3(object.mesh_in_scene()) > 0.0, "{node}");
        }
        for (a, b) in shared {
            let [a, b] = [a, b].map(|index: usize| scene.objects[index].mesh());
            assert!(Arc::ptr_eq(a, b));
        }
        let first = &scene.objects[0];
        assert!(Arc::ptr_eq(first.mesh(), first.mesh_in_scene()));
    }
}

#[test]
fn without_scenes_all_top_nodes_are_read() {
    let mut file = below(Glb::triangle(), json!({ "translation": [0.0, 0.0, 2.0] }));
    let fields = file.json.as_object_mut().expect("is an object");
    fields.remove("scenes");
    fields.remove("scene");
    let scene = file.scene();
    assert_eq!(only_mesh(&scene).positions[0], DVec3::Z * 2.0);
    assert!(Glb::empty().scene().objects.is_empty());
}
