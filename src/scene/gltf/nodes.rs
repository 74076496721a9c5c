//! World transforms of nodes, composed in double precision. Every node is visited once.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::json::camera::{Camera as Source, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Node, Root, Value};

use super::context::{LoadContext, damaged};
use super::document::{Document, NodeTransform};
use super::extras;
use super::extras::widen;
use crate::error::{Error, Result};
use crate::scene::Camera;

/// A node of the scene.
#[derive(Clone, Debug)]
pub struct PlacedNode {
    pub node: usize,
    /// Name in the file, or `nodeN`.
    pub name: String,
    pub world_from_node: DAffine3,
}

impl PlacedNode {
    /// Its name in the file; `kind` and index without one.
    pub fn name_or(&self, kind: &str, index: usize) -> String {
        if self.name == format!("node{}", self.node) {
            return format!("{kind}{index}");
        }
        self.name.clone()
    }
}

/// Visible nodes of the default scene, parents first; without a default scene, of the first one; without scenes, of all
/// nodes that are no child.
///
/// # Errors
/// A reference to a node that does not exist; a transform that is not finite.
pub fn place(document: &Document, load: &mut LoadContext) -> Result<Vec<PlacedNode>> {
    let root = &document.root;
    let mut reached = vec![false; root.nodes.len()];
    let mut placed = Vec::new();
    // Explicit stack: a chain of a million nodes must not overflow that of the thread.
    let mut waiting: Vec<(usize, DAffine3, bool)> = Vec::new();
    for node in top_nodes(root, load).into_iter().rev() {
        waiting.push((node, DAffine3::IDENTITY, false));
    }

    // Parents are placed before their children, an order on which the clip relies.
    while let Some((index, world_from_parent, is_below_hidden)) = waiting.pop() {
        let Some(node) = root.nodes.get(index) else {
            return Err(damaged(
                format!("node {index}"),
                "is referred to but does not exist",
            ));
        };
        let name = extras::name(node.name.as_deref(), "node", index);

        // A node with two parents would be placed twice, and one below itself for ever.
        if std::mem::replace(&mut reached[index], true) {
            load.warn(
                format!("node `{name}`"),
                "is its own ancestor or has several parents; it was placed once",
                "give it one parent",
            );
            continue;
        }
        let world_from_node = world_from_parent * local(&document.transforms[index], &name, load)?;
        if !world_from_node.is_finite() {
            return Err(not_finite(&name));
        }

        // What is hidden is walked all the same, and hides all that is below it.
        let is_hidden = is_below_hidden || is_hidden(node);
        let children = node.children.as_deref().unwrap_or_default();
        waiting.extend(
            children
                .iter()
                .rev()
                .map(|child| (child.value(), world_from_node, is_hidden)),
        );
        if !is_hidden {
            placed.push(PlacedNode {
                node: index,
                name,
                world_from_node,
            });
        }
    }

    // Without scenes, roots are nodes without a parent, which a ring of nodes does not have.
    let unreached = reached.iter().filter(|reached| !**reached).count();
    if root.scenes.is_empty() && unreached > 0 {
        load.warn(
            "nodes",
            format!("{unreached} nodes are their own ancestors; they were left out"),
            "give each one parent",
        );
    }
    Ok(placed)
}

/// Extension that hides nodes and their descendants.
pub const VISIBILITY: &str = "KHR_node_visibility";

fn is_hidden(node: &Node) -> bool {
    let stated = node
        .extensions
        .as_ref()
        .and_then(|extensions| extensions.others.get(VISIBILITY));
    stated.and_then(|stated| stated.get("visible")) == Some(&Value::Bool(false))
}

fn top_nodes(root: &Root, load: &mut LoadContext) -> Vec<usize> {
    let default = root.scene.map(|scene| scene.value());
    let chosen = default.and_then(|scene| root.scenes.get(scene));
    if let (Some(scene), None) = (default, chosen) {
        load.warn_damaged(
            "scene",
            format!("the default scene {scene} does not exist; the first one was read"),
        );
    }
    let is_child = find_children(root);
    let Some(scene) = chosen.or(root.scenes.first()) else {
        return (0..root.nodes.len()).filter(|node| !is_child[*node]).collect();
    };
    let listed: Vec<usize> = scene.nodes.iter().map(Index::value).collect();
    for node in &listed {
        if is_child.get(*node) == Some(&true) {
            load.warn(
                format!("node {node}"),
                "stands in the scene although it is the child of another node; it was placed by itself",
                "list only nodes without a parent in the scene",
            );
        }
    }
    listed
}

fn find_children(root: &Root) -> Vec<bool> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root
        .nodes
        .iter()
        .filter_map(|node: &Node| node.children.as_ref())
        .flatten()
    {
        if let Some(entry) = is_child.get_mut(child.value()) {
            *entry = true;
        }
    }
    is_child
}

fn local(transform: &NodeTransform, name: &str, load: &mut LoadContext) -> Result<DAffine3> {
    // A matrix excludes translation, rotation and scale.
    if let Some(matrix) = transform.matrix {
        let matrix = DMat4::from_cols_array(&matrix);
        if !matrix.is_finite() {
            return Err(not_finite(name));
        }
        if matrix.row(3) != glam::DVec4::W {
            load.warn_damaged(
                format!("node `{name}`"),
                "its matrix is not affine; its last row was read as 0 0 0 1",
            );
        }
        let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.truncate());
        return Ok(DAffine3 {
            matrix3: DMat3::from_cols(columns[0], columns[1], columns[2]),
            translation: matrix.w_axis.truncate(),
        });
    }

    // A quaternion that is not of unit length would scale the node as well.
    let (scale, rotation, translation) = stated(transform);
    if !scale.is_finite() || !translation.is_finite() || !rotation.is_finite() {
        return Err(not_finite(name));
    }
    let length = rotation.length();
    if (length - 1.0).abs() > 1e-3 {
        load.warn_damaged(
            format!("node `{name}`"),
            format!("its rotation has the length {length} and was brought to 1"),
        );
    }
    Ok(DAffine3::from_scale_rotation_translation(
        scale,
        unit(rotation),
        translation,
    ))
}

fn stated(transform: &NodeTransform) -> (DVec3, DQuat, DVec3) {
    (
        DVec3::from(transform.scale.unwrap_or([1.0; 3])),
        DQuat::from_array(transform.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
        DVec3::from(transform.translation.unwrap_or_default()),
    )
}

fn unit(rotation: DQuat) -> DQuat {
    if rotation.length() > 0.0 {
        rotation / rotation.length()
    } else {
        DQuat::IDENTITY
    }
}

/// Transform from a placed node to its parent, and the same as scale, rotation and translation [m], which holds for
/// nodes without a matrix.
pub fn at_rest(document: &Document, node: usize) -> (DAffine3, (DVec3, DQuat, DVec3)) {
    let transform = &document.transforms[node];
    // The transforms of placed nodes are valid.
    let at_rest = local(transform, "", &mut LoadContext::default()).unwrap_or(DAffine3::IDENTITY);
    let (scale, rotation, translation) = stated(transform);
    (at_rest, (scale, unit(rotation), translation))
}

fn not_finite(name: &str) -> Error {
    damaged(
        format!("node `{name}`"),
        "its transform is infinite or not a number",
    )
}

/// Cameras of the placed nodes, with the glTF indices of these. Unreadable ones are left out with a warning.
pub fn read_all(root: &Root, placed: &[PlacedNode], load: &mut LoadContext) -> (Vec<Camera>, Vec<usize>) {
    let mut nodes = Vec::new();
    let mut cameras = Vec::new();
    for placed in placed {
        let Some(index) = root.nodes[placed.node].camera else {
            continue;
        };
        let source = root.cameras.get(index.value());
        let read = source.ok_or_else(|| format!("is camera {}, which does not exist", index.value()));
        let is_orthographic = read
            .as_ref()
            .is_ok_and(|source| matches!(source.type_, Checked::Valid(Type::Orthographic)));

        // The list of nodes stays parallel to that of cameras, so that an unreadable one enters neither.
        match read.and_then(|source| read_one(source, placed)) {
            Ok(camera) => {
                if is_orthographic {
                    let what = "is orthographic; it was read as one far behind, with an angle of view of 1°";
                    let remedy = "make it a perspective camera where the last half degree matters";
                    load.warn(format!("camera `{}`", placed.name), what, remedy);
                }
                let name = placed.name_or("camera", cameras.len());
                cameras.push(Camera { name, ..camera });
                nodes.push(placed.node);
            }
            Err(why) => load.warn(
                format!("camera `{}`", placed.name),
                format!("{why}; it was left out"),
                "repair the camera or choose another one",
            ),
        }
    }
    (cameras, nodes)
}

/// Angle of view of an orthographic camera: its rays are parallel to within half a degree [rad].
const PARALLEL_FOV_RAD: f64 = PI / 180.0;

fn read_one(source: &Source, placed: &PlacedNode) -> std::result::Result<Camera, String> {
    // An orthographic camera is read as a narrow perspective far behind it, which frames the same height at its place.
    let (vertical_fov_rad, near_m, behind_m) =
        match (&source.type_, &source.perspective, &source.orthographic) {
            (Checked::Valid(Type::Perspective), Some(lens), _) => (widen(lens.yfov), widen(lens.znear), 0.0),
            (Checked::Valid(Type::Orthographic), _, Some(lens)) => {
                let half_height_m = widen(lens.ymag).abs();
                let behind_m = half_height_m / (0.5 * PARALLEL_FOV_RAD).tan();
                (PARALLEL_FOV_RAD, behind_m + widen(lens.znear), behind_m)
            }
            _ => return Err("has no lens".into()),
        };

    // A lens that opens by nothing or by half a turn has no image.
    if !(vertical_fov_rad > 0.0 && vertical_fov_rad < PI) {
        return Err(format!("has an angle of view of {vertical_fov_rad} rad"));
    }
    if !(near_m > 0.0 && near_m.is_finite()) {
        return Err(format!("has a near plane at {near_m} m"));
    }

    let axis = |axis: DVec3| placed.world_from_node.transform_vector3(axis).try_normalize();
    let forward = axis(DVec3::NEG_Z);
    // Scale and shear do not affect a camera: its axes are made orthogonal again.
    let right = axis(DVec3::Y)
        .zip(forward)
        .and_then(|(up, forward)| forward.cross(up).try_normalize());
    let (Some(forward), Some(right)) = (forward, right) else {
        return Err("has no direction, since its node is scaled to nothing".into());
    };
    Ok(Camera {
        name: String::new(),
        position: placed.world_from_node.translation - forward * behind_m,
        forward,
        up: right.cross(forward),
        vertical_fov_rad,
        near_m,
    })
}
