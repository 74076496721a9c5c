//! Bakes of reference scenes: against an independent solver, against the law of energy, against themselves.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

#[path = "bake/accuracy.rs"]
mod accuracy;
#[path = "bake/auto_or_everything.rs"]
mod auto_or_everything;
#[path = "bake/brute_force.rs"]
mod brute_force;
#[path = "support/bump_scenes.rs"]
mod bump_scenes;
#[path = "bake/bumps.rs"]
mod bumps;
#[path = "bake/closed_forms.rs"]
mod closed_forms;
#[path = "bake/collection.rs"]
mod collection;
#[path = "bake/coverage.rs"]
mod coverage;
#[path = "bake/effect_matrix.rs"]
mod effect_matrix;
#[path = "support/effect_scenes.rs"]
mod effect_scenes;
#[path = "bake/energy.rs"]
mod energy;
#[path = "bake/forecast.rs"]
mod forecast;
#[path = "scene/glb.rs"]
#[allow(dead_code)]
mod glb;
#[path = "bake/hard_cases.rs"]
mod hard_cases;
#[path = "support/hard_scenes.rs"]
mod hard_scenes;
#[path = "bake/indirect.rs"]
mod indirect;
#[path = "bake/invariance.rs"]
mod invariance;
#[path = "bake/kept.rs"]
mod kept;
#[path = "bake/lamps.rs"]
mod lamps;
#[path = "bake/layers.rs"]
mod layers;
#[path = "bake/live.rs"]
mod live;
#[path = "bake/map_files.rs"]
mod map_files;
#[path = "eye/meshes.rs"]
#[allow(dead_code)]
mod meshes;
#[path = "bake/nested.rs"]
mod nested;
#[path = "bake/openings.rs"]
mod openings;
#[path = "bake/probe.rs"]
mod probe;
#[path = "bake/reference.rs"]
mod reference;
#[path = "eye/scenes.rs"]
#[allow(dead_code)]
mod scenes;
#[path = "bake/shards.rs"]
mod shards;
#[path = "bake/smoothing.rs"]
mod smoothing;
#[path = "bake/soft.rs"]
mod soft;
#[path = "bake/sparse.rs"]
mod sparse;
#[path = "bake/spectral.rs"]
mod spectral;
#[path = "bake/spectral_metals.rs"]
mod spectral_metals;
#[path = "support/mod.rs"]
mod support;
#[path = "bake/surfaces.rs"]
mod surfaces;
#[path = "bake/threshold.rs"]
mod threshold;
#[path = "bake/tiles.rs"]
mod tiles;
#[path = "bake/tiny.rs"]
mod tiny;
#[path = "bake/tools.rs"]
mod tools;
#[path = "bake/useless.rs"]
mod useless;
#[path = "bake/wavefront.rs"]
mod wavefront;
