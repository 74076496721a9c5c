//! Rays, triangles and hierarchies. Knows nothing of materials or light.

pub mod bvh;
pub mod cube_face;
pub mod enclosure;
pub mod frustum;
pub mod packed;
pub mod polygon;
pub mod ray;
pub mod sampling;
pub mod triangle;
mod wide;

pub use bvh::TriangleBvh;
pub use frustum::Frustum;
pub use packed::{PackedBvh, PackedNode};
pub use ray::Ray;
