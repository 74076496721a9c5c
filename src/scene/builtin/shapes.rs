//! Meshes of exact surfaces: vertices on the surface with its exact normals, wound counter-clockwise about them.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::scene::Mesh;

/// Flat parallelogram `centre` + s·`half_u` + t·`half_v` [m], |s|, |t| ≤ 1, facing `half_u` × `half_v`; its TEXCOORD_0
/// is ((s + 1)/2, (t + 1)/2).
pub fn rectangle(centre: DVec3, half_u: DVec3, half_v: DVec3) -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    Mesh {
        positions: corners.map(|(s, t)| centre + half_u * s + half_v * t).to_vec(),
        normals: vec![half_u.cross(half_v).normalize(); 4],
        uv0: Some(corners.map(|(s, t)| DVec2::new(s + 1.0, t + 1.0) * 0.5).to_vec()),
        uv1: None,
        colours: None,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Horizontal rectangle at height `y` [m] that faces up, with TEXCOORD_0 u = x and v = z, each from minimum to maximum.
pub fn floor(x: [f64; 2], z: [f64; 2], y: f64) -> Mesh {
    let mut mesh = rectangle(
        DVec3::new(0.5 * (x[0] + x[1]), y, 0.5 * (z[0] + z[1])),
        DVec3::X * (0.5 * (x[1] - x[0])),
        DVec3::Z * (0.5 * (z[1] - z[0])),
    );
    mesh.normals.fill(DVec3::Y);
    for triangle in &mut mesh.triangles {
        triangle.swap(1, 2);
    }
    mesh
}

/// Closed box with flat faces between two corners [m].
pub fn cuboid(low: DVec3, high: DVec3) -> Mesh {
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let axes = [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z];
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        let (out, u, v) = (axes[axis], axes[(axis + 1) % 3], axes[(axis + 2) % 3]);
        append(&mut mesh, &rectangle(centre + out, u, v));
        append(&mut mesh, &rectangle(centre - out, v, u));
    }
    mesh
}

/// Grid over a curved sheet. `surface(u, v)` returns position [m] and unit normal for u, v in [0, 1]; triangles of zero
/// area (at a pole) are left out.
pub fn sheet(columns: u32, rows: u32, surface: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let (position, normal) = surface(
                f64::from(column) / f64::from(columns),
                f64::from(row) / f64::from(rows),
            );
            mesh.positions.push(position);
            mesh.normals.push(normal);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let first = row * (columns + 1) + column;
            let above = first + columns + 1;
            push_oriented(&mut mesh, [first, first + 1, above + 1]);
            push_oriented(&mut mesh, [first, above + 1, above]);
        }
    }
    mesh
}

/// Closed prism with flat faces: a triangle [m], counter-clockwise about `along`, extruded by `along` [m].
pub fn prism(outline: [DVec3; 3], along: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    let [a, b, c] = outline;
    append(&mut mesh, &facet([a, c, b]));
    append(&mut mesh, &facet(outline.map(|corner| corner + along)));
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let side = [from, to, to + along, from + along];
        append(
            &mut mesh,
            &Mesh {
                positions: side.to_vec(),
                normals: vec![(to - from).cross(along).normalize(); 4],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Mesh::default()
            },
        );
    }
    mesh
}

/// One flat triangle [m] with vertices of its own.
pub fn facet(corners: [DVec3; 3]) -> Mesh {
    let [a, b, c] = corners;
    Mesh {
        positions: corners.to_vec(),
        normals: vec![(b - a).cross(c - a).normalize(); 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    }
}

/// Closed sphere [m]: an icosahedron subdivided `levels` times (20·4^levels triangles) and scaled to exactly the volume
/// of the sphere, so that the mesh lies partly inside and partly outside of it.
pub fn sphere(centre: DVec3, radius: f64, levels: u32) -> Mesh {
    let (mut directions, mut triangles) = icosahedron();
    for _ in 0..levels {
        triangles = halve_edges(&mut directions, &triangles);
    }
    let unit_volume: f64 = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|vertex| directions[vertex as usize]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    let scaled = radius * (4.0 / 3.0 * std::f64::consts::PI / unit_volume).cbrt();
    Mesh {
        positions: directions.iter().map(|d| centre + *d * scaled).collect(),
        normals: directions,
        uv0: None,
        uv1: None,
        colours: None,
        triangles,
    }
}

/// A mesh moved by `offset` [m].
#[must_use]
pub fn moved(mut mesh: Mesh, offset: DVec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|position| *position += offset);
    mesh
}

/// Appends a mesh to another, without texture coordinates.
pub fn append(mesh: &mut Mesh, part: &Mesh) {
    let offset = mesh.positions.len() as u32;
    mesh.positions.extend(&part.positions);
    mesh.normals.extend(&part.normals);
    mesh.triangles
        .extend(part.triangles.iter().map(|t| t.map(|vertex| vertex + offset)));
}

/// Adds a triangle with the winding of its vertex normals.
fn push_oriented(mesh: &mut Mesh, [a, b, c]: [u32; 3]) {
    let position = |vertex: u32| mesh.positions[vertex as usize];
    let face = (position(b) - position(a)).cross(position(c) - position(a));
    let normal: DVec3 = [a, b, c]
        .iter()
        .map(|vertex| mesh.normals[*vertex as usize])
        .sum();
    match face.dot(normal) {
        side if side > 0.0 => mesh.triangles.push([a, b, c]),
        side if side < 0.0 => mesh.triangles.push([a, c, b]),
        _ => {}
    }
}

/// Unit vertices and outward triangles of a regular icosahedron.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut vertices = Vec::with_capacity(12);
    for (short, long) in [(-1.0, -golden), (1.0, -golden), (-1.0, golden), (1.0, golden)] {
        vertices.push(DVec3::new(0.0, short, long).normalize());
        vertices.push(DVec3::new(short, long, 0.0).normalize());
        vertices.push(DVec3::new(long, 0.0, short).normalize());
    }
    // Neighbours are pairs at cosine 1/√5; every triple of mutual neighbours is a face.
    let near = |a: usize, b: usize| vertices[a].dot(vertices[b]) > 0.4;
    let mut triangles = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = vertices[a].dot(vertices[b].cross(vertices[c])) > 0.0;
                    let [a, b, c] = [a as u32, b as u32, c as u32];
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    (vertices, triangles)
}

/// Subdivides every triangle into four; new vertices are shared and lie on the unit sphere.
fn halve_edges(directions: &mut Vec<DVec3>, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut midpoints: HashMap<(u32, u32), u32> = HashMap::with_capacity(triangles.len() * 3 / 2);
    let mut finer = Vec::with_capacity(triangles.len() * 4);
    for &[a, b, c] in triangles {
        let mut midpoint = |a: u32, b: u32| {
            *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                directions.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
        finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    finer
}
