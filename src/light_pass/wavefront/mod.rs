//! The caustic layer by wavefront patches: cells of neighbouring rays that took the same path become smooth patches,
//! whose flux is spread exactly over the texels they cover.

pub mod band;
pub mod bumps;
pub mod cell;
mod cell_tests;
pub mod coverage;
mod division;
pub mod edge;
pub mod edge_search;
mod facets;
pub mod kept_rays;
pub mod lattice;
pub mod lattice_ray;
mod mesh;
pub mod overshoot;
pub mod pass;
pub mod patch;
pub mod receivers;
pub mod refine;
mod regions;
mod shares;
mod slits;
mod spectral_cell;
pub mod spectrum;
pub mod spread;
pub mod subcell_features;
pub mod trace;
pub mod virtual_vertex;
