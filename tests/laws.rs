//! Laws that every bake keeps, whatever is in the scene: tried on random ones.
//!
//! 200 scenes for each law, the same in every run; `NEPHROID_RANDOM_SCENES=10000` tries as many.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

#[path = "laws/changes.rs"]
mod changes;
#[path = "laws/exact.rs"]
mod exact;
#[path = "laws/maps.rs"]
mod maps;
#[path = "laws/recipe.rs"]
mod recipe;
#[path = "support/mod.rs"]
mod support;
#[path = "bake/tools.rs"]
#[allow(dead_code)]
mod tools;
#[path = "laws/trial.rs"]
mod trial;
#[path = "laws/within_errors.rs"]
mod within_errors;
