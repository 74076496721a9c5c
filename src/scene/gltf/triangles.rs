//! Converts indices and primitive modes to triangles.

use gltf::json::mesh::Mode;

/// Triangles of `vertices` under a mode, with the winding of the specification; `None` for points and lines. Left-over
/// vertices are dropped.
pub fn assemble(vertices: &[u32], mode: Mode) -> Option<Vec<[u32; 3]>> {
    match mode {
        Mode::Triangles => Some(vertices.as_chunks().0.to_vec()),
        Mode::TriangleStrip => {
            let windows = vertices.windows(3).enumerate();
            // Every second triangle of a strip has reversed winding.
            let turned = windows.map(|(index, w)| {
                let odd = index % 2;
                [w[0], w[1 + odd], w[2 - odd]]
            });
            Some(turned.collect())
        }
        Mode::TriangleFan => {
            let (first, rest) = vertices.split_first()?;
            Some(rest.windows(2).map(|w| [w[0], w[1], *first]).collect())
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

/// Number of vertices that do not complete a triangle.
pub fn left_over(vertices: usize, mode: Mode) -> usize {
    match mode {
        Mode::Triangles => vertices % 3,
        _ if vertices < 3 => vertices,
        _ => 0,
    }
}
