//! The light pass: from the lights through specular surfaces onto diffuse ones.

pub mod accuracy;
pub mod coverage;
pub mod direct;
pub mod explain;
pub mod footprint_statistics;
pub mod indirect;
pub mod item_buffer;
pub mod launch;
pub mod ledger;
pub mod ledger_sum;
pub mod pass_report;
pub mod path;
pub mod photon;
pub mod receiver_maps;
pub mod shard_index;
pub mod sketch;
pub mod spectral_node;
pub mod splat;
pub mod visibility;

pub use crate::scene::emitter;
