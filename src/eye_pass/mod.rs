//! From the diffuse surfaces through specular ones into the eye (DS*E).

pub mod view;

pub use view::{Picture, ToneMap, View};
