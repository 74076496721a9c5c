//! Bakes of reference scenes: against an independent solver, against the law of energy, against themselves.

mod accuracy;
mod bumps;
mod collection;
mod common;
mod coverage;
mod indirect;
mod live;
mod plan;
mod probe;
mod shards;
mod smoothing;
mod soft;
mod sparse;
mod spectral;
mod surfaces;
mod tiles;
mod wavefront;
