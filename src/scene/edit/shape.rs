//! Edits of places and shapes.

use glam::{DQuat, DVec3};

use super::{check_place, out_of_range};
use crate::error::{Error, Result};
use crate::scene::Mesh;

/// A mesh turned about the middle of its box, and then moved.
pub(super) fn moved(mesh: &Mesh, rotation: DQuat, translation: DVec3, name: &str) -> Result<Mesh> {
    let owner = format!("object `{name}`");
    check_place(translation, &owner)?;
    if !(rotation.is_finite() && rotation.length() > 0.0) {
        return Err(out_of_range(&owner, "rotation", rotation, "unit quaternions"));
    }
    let rotation = rotation.normalize();
    let is_turned = rotation != DQuat::IDENTITY;
    let (low, high) = mesh.bounds().unwrap_or_default();
    let centre = 0.5 * (low + high);
    let place = |point: &DVec3| {
        if is_turned {
            rotation * (*point - centre) + centre + translation
        } else {
            *point + translation
        }
    };
    let turn = |normal: &DVec3| if is_turned { rotation * *normal } else { *normal };
    let moved = Mesh {
        positions: mesh.positions.iter().map(place).collect(),
        normals: mesh.normals.iter().map(turn).collect(),
        ..mesh.clone()
    };
    if let Some((low, high)) = moved.bounds() {
        check_place(low, &owner)?;
        check_place(high, &owner)?;
    }
    Ok(moved)
}

/// Refuses what no scene may hold.
pub(super) fn check_mesh(mesh: &Mesh, name: &str) -> Result<()> {
    let vertices = mesh.positions.len();
    let is_whole = mesh.normals.len() == vertices
        && [&mesh.uv0, &mesh.uv1]
            .iter()
            .all(|uvs| uvs.as_ref().is_none_or(|uvs| uvs.len() == vertices))
        && mesh
            .triangles
            .iter()
            .flatten()
            .all(|vertex| (*vertex as usize) < vertices)
        && mesh
            .positions
            .iter()
            .chain(&mesh.normals)
            .all(|vector| vector.is_finite());
    if is_whole {
        return Ok(());
    }
    Err(Error::usage(
        format!("object `{name}`"),
        "its new mesh has an index or a number that is not valid",
        "give finite coordinates, and as many normals as positions",
    ))
}
