//! The caustic layer by pieces of the wavefront: cells of neighbouring light rays that went the same way become smooth
//! patches, and their light is spread exactly over the texels they cover.

pub mod band;
pub mod bodies;
pub mod bumps;
pub mod cell;
pub mod closeness;
pub mod coverage;
mod division;
mod doubt;
pub mod edge;
mod facets;
pub mod kept_rays;
pub mod lattice;
mod mesh;
mod openings;
pub mod overreach;
pub mod pass;
pub mod patch;
pub mod receivers;
pub mod refine;
mod regions;
mod shares;
mod spectral_cell;
pub mod spectrum;
pub mod spread;
pub mod strand;
pub mod trace;
pub mod virtual_vertex;
