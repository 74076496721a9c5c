//! The light-map coordinates of a surface in the exported file.

use std::collections::HashMap;

use glam::{DAffine3, DVec2, DVec3};
use serde_json::{Value, json};

use crate::error::Warning;
use crate::illumination::{Chart, UvSet};
use crate::scene::{Glb, Mesh, Scene};

/// Adds a map's coordinates to the primitive of its surface, unless it uses the primitive's own. Vertices are split at
/// chart borders. Returns the n of their TEXCOORD_n; `None` if the node's transform cannot be inverted.
pub fn write(
    glb: &mut Glb,
    scene: &Scene,
    chart: &Chart,
    world_from_node: &DAffine3,
    warnings: &mut Vec<Warning>,
) -> Option<usize> {
    // A map on the coordinates of the mesh needs no new vertices.
    match chart.uv_set {
        UvSet::TexCoord0 => return Some(0),
        UvSet::TexCoord1 => return Some(1),
        UvSet::Generated => {}
    }

    // Vertices are written in the space of the node; a node that is scaled to nothing has none to return to.
    let object = &scene.objects[chart.object()];
    let place = (object.node, object.primitive);
    let determinant = world_from_node.matrix3.determinant();
    let node_from_world = world_from_node.inverse();
    if determinant == 0.0 || !node_from_world.is_finite() {
        return None;
    }

    // A vertex at a chart border has one place in each chart, so that it is split into as many.
    let parted = SplitMesh::new(object.mesh_in_scene(), chart, determinant < 0.0);

    // Normals reach the world by the inverse transpose, and so return to the node by the transpose.
    let normal_from_world = world_from_node.matrix3.transpose();
    let position = |vertex: usize| {
        let world = object.mesh_in_scene().positions[vertex] + scene.origin_world;
        node_from_world.transform_point3(world).as_vec3().to_array()
    };
    let normal = |vertex: usize| {
        let normal = (normal_from_world * object.mesh_in_scene().normals[vertex]).normalize_or(DVec3::Y);
        normal.as_vec3().to_array()
    };
    let of_vertices = |value: &dyn Fn(usize) -> [f32; 3]| -> Vec<[f32; 3]> {
        parted.vertices.iter().map(|&(vertex, _)| value(vertex)).collect()
    };

    // Coordinates that the material uses and all other attributes of the old primitive follow their vertices.
    let was = glb.primitive(place).clone();
    let mut attributes = json!({
        "POSITION": glb.push_vectors(&of_vertices(&position)),
        "NORMAL": glb.push_vectors(&of_vertices(&normal)),
    });
    let uvs: Vec<[f32; 2]> = parted
        .vertices
        .iter()
        .map(|(_, uv)| uv.as_vec2().to_array())
        .collect();
    let generated = glb.push_vectors(&uvs);
    let tex_coord = add_sets(
        glb,
        object.mesh_in_scene(),
        &parted,
        &was,
        generated,
        &mut attributes,
    );
    keep_others(
        glb,
        &object.name,
        object.mesh_in_scene(),
        &parted,
        &was,
        &mut attributes,
        warnings,
    );

    let skin = format!("/nodes/{}/skin", object.node);
    if glb.json.pointer(&skin).is_some() {
        // Positions are written as the joints deformed them: a skin would do so again.
        glb.remove(&skin);
        warnings.push(Warning::new(
            format!("surface `{}`", object.name),
            "lost its skin: its map is that of one pose",
            "give it light-map coordinates (TEXCOORD_1) of its own",
        ));
    }

    // Triangles are indexed anew: the old mode, morph targets and compressed data belong to other vertices.
    let indices = glb.push_indices(parted.corners.iter().copied());
    let primitive = glb.primitive(place);
    primitive["attributes"] = attributes;
    primitive["indices"] = json!(indices);
    if let Some(fields) = primitive.as_object_mut() {
        fields.shift_remove("mode");
        fields.shift_remove("targets");
        if let Some(extensions) = fields.get_mut("extensions").and_then(Value::as_object_mut) {
            // Its data is now written uncompressed.
            extensions.shift_remove("KHR_draco_mesh_compression");
        }
    }
    Some(tex_coord)
}

/// A mesh with one map coordinate per vertex.
struct SplitMesh {
    /// Original vertex and map coordinate of each vertex.
    vertices: Vec<(usize, DVec2)>,
    /// Vertices of the triangles, three each.
    corners: Vec<u32>,
}

impl SplitMesh {
    fn new(mesh: &Mesh, chart: &Chart, is_mirrored: bool) -> Self {
        let mut known: HashMap<(u32, [u64; 2]), u32> = HashMap::new();
        let mut parted = Self {
            vertices: Vec::new(),
            corners: Vec::new(),
        };
        for (triangle, uvs) in mesh.triangles.iter().zip(&chart.corner_uvs) {
            // A mirroring node reversed the triangles; the file has their original order.
            let order = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
            for corner in order {
                let (vertex, uv) = (triangle[corner], uvs[corner]);
                let next = parted.vertices.len() as u32;
                let key = (vertex, uv.to_array().map(f64::to_bits));
                let index = *known.entry(key).or_insert(next);
                if index == next {
                    parted.vertices.push((vertex as usize, uv));
                }
                parted.corners.push(index);
            }
        }
        parted
    }
}

/// Adds the UV sets of the mesh that its material uses, and the generated one, as TEXCOORD_1 if that is free. Sets have
/// to be numbered without gaps, so a mesh without any gets the generated one as TEXCOORD_0 too.
fn add_sets(
    glb: &mut Glb,
    mesh: &Mesh,
    parted: &SplitMesh,
    was: &Value,
    generated: usize,
    attributes: &mut Value,
) -> usize {
    let material = was["material"].as_u64().map_or(Value::Null, |material| {
        glb.json["materials"][material as usize].clone()
    });
    let uses_second = mesh.uv1.is_some() && highest_set(&material) >= 1;
    let mut push = |uvs: &[DVec2]| {
        let uvs: Vec<[f32; 2]> = parted
            .vertices
            .iter()
            .map(|&(vertex, _)| uvs[vertex].as_vec2().to_array())
            .collect();
        json!(glb.push_vectors(&uvs))
    };
    attributes["TEXCOORD_0"] = mesh.uv0.as_deref().map_or(json!(generated), &mut push);
    let mut tex_coord = 1;
    if let Some(uvs) = mesh.uv1.as_deref().filter(|_| uses_second) {
        attributes["TEXCOORD_1"] = push(uvs);
        tex_coord = 2;
    }
    attributes[format!("TEXCOORD_{tex_coord}")] = json!(generated);
    tex_coord
}

/// The highest UV set that a material refers to.
fn highest_set(material: &Value) -> u64 {
    match material {
        Value::Object(fields) => {
            let own = fields.get("texCoord").and_then(Value::as_u64).unwrap_or(0);
            fields.values().map(highest_set).fold(own, u64::max)
        }
        Value::Array(items) => items.iter().map(highest_set).max().unwrap_or(0),
        _ => 0,
    }
}

/// Copies the other vertex attributes: tangents, colours. Those of a mesh that was repaired on loading are lost.
fn keep_others(
    glb: &mut Glb,
    name: &str,
    mesh: &Mesh,
    parted: &SplitMesh,
    was: &Value,
    attributes: &mut Value,
    warnings: &mut Vec<Warning>,
) {
    // Positions, normals and coordinates are written anew; every other attribute follows its vertex.
    for (semantic, accessor) in was["attributes"].as_object().into_iter().flatten() {
        let is_known =
            ["POSITION", "NORMAL"].contains(&semantic.as_str()) || semantic.starts_with("TEXCOORD_");
        if is_known {
            continue;
        }
        let accessor = accessor.as_u64().unwrap_or(u64::MAX) as usize;
        match gathered(glb, accessor, mesh.positions.len(), parted) {
            Some(index) => attributes[semantic] = json!(index),
            None => warnings.push(Warning::new(
                format!("surface `{name}`"),
                format!("lost its {semantic} where its map's coordinates were added"),
                "give it light-map coordinates (TEXCOORD_1) of its own",
            )),
        }
    }

    // Morph targets move vertices away from the shape that was lit.
    if was.get("targets").is_some() {
        warnings.push(Warning::new(
            format!("surface `{name}`"),
            "lost its morph targets: its map is that of one shape",
            "bake the shape that is shown",
        ));
    }
}

/// Copies an accessor in the order of the new vertices; `None` if it cannot be read.
fn gathered(glb: &mut Glb, accessor: usize, vertices: usize, parted: &SplitMesh) -> Option<usize> {
    // Only an accessor of one element for each vertex can follow a split; a sparse one would need its base too.
    let stated = glb.json["accessors"].get(accessor)?.clone();
    if stated.get("sparse").is_some() || stated["count"].as_u64()? != vertices as u64 {
        return None;
    }

    // Only plain data in the binary chunk can be copied: other buffers and compressed views are not at hand.
    let view = glb.json["bufferViews"]
        .get(stated["bufferView"].as_u64()? as usize)?
        .clone();
    let element = element_bytes(&stated)?;
    if view["buffer"].as_u64()? != 0 || view.get("extensions").is_some() {
        return None;
    }

    // A damaged file may state any offset and stride, so that every sum and range is checked.
    let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
    let stride = number(&view["byteStride"]).max(element);
    let start = number(&view["byteOffset"]).checked_add(number(&stated["byteOffset"]))?;
    let mut bytes = Vec::new();
    for &(vertex, _) in &parted.vertices {
        let from = start.checked_add(vertex.checked_mul(stride)?)?;
        bytes.extend(glb.binary().get(from..from.checked_add(element)?)?);
        // Vertex elements are aligned to four bytes.
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }

    // Type and bounds of the accessor stay, since a split repeats elements and makes none.
    let view = glb.push_view(&bytes);
    if element % 4 != 0 {
        glb.json["bufferViews"][view]["byteStride"] = json!(element.next_multiple_of(4));
    }
    let mut copy = stated;
    copy["bufferView"] = json!(view);
    copy["count"] = json!(parted.vertices.len());
    let fields = copy.as_object_mut()?;
    fields.shift_remove("byteOffset");
    Some(glb.push("/accessors", copy))
}

fn element_bytes(accessor: &Value) -> Option<usize> {
    let components = match accessor["type"].as_str()? {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => return None,
    };
    let each = match accessor["componentType"].as_u64()? {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    };
    Some(components * each)
}
