//! Files for other programs: maps with their manifest, pictures, glTF, textures; and how maps are read back.

pub mod exr;
pub mod float_image;
pub mod frame_folder;
pub mod glb;
pub mod manifest;
pub mod map_folder;
pub mod map_set;
pub mod pfm;
pub mod picture;
mod quantity;
pub mod sequence;
pub mod shards;
pub mod textures;
#[cfg(feature = "gpu")]
pub mod web;

pub use crate::illumination::uv_file;
pub use float_image::FloatImage;
pub use quantity::{DEFAULT_CUT, Quantity};
