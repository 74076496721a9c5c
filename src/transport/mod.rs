//! Light transport at a surface, shared by the light pass, the direct layer and the CPU eye pass.

pub mod bend;
mod hierarchy;
pub mod interaction;
pub mod medium;
pub mod microfacets;
mod normal_texture;
mod packed;
pub mod sharp_edges;
pub mod smoothing;
pub mod tracer;
mod traversed;

pub use crate::plan::EffectSet;
pub use hierarchy::SceneNode;
pub use interaction::{Branch, DiffuseResponse, Event, Interaction, Meeting, NormalSource};
pub use medium::{MediumStack, media_at};
pub use microfacets::ggx_reflection;
pub use packed::{PackedInstance, PackedMesh};
pub use tracer::{RayHit, SurfaceHit, Tracer};
pub use traversed::TraversedCells;
