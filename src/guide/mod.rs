//! The guide: what the program does, how to use it, and how the code works.
//!
//! | page | about |
//! |---|---|
//! | [`window`] | the interactive program: keys, panel, editing, filming |
//! | [`scenes`] | built-in scenes, and what is read from glTF |
//! | [`glass_and_lamps`] | materials, glass catalogue, metals, lights and their spectra |
//! | [`surfaces`] | which surfaces get maps, layers, resolution, texture coordinates |
//! | [`moving_scenes`] | running water and keyframes: live, baked, rendered |
//! | [`formats`] | the folder of a bake, exported files, units |
//! | [`blender`] | the add-on: bake the open scene, and what it reads |
//! | [`engines`] | maps in three.js, Godot, Unity, Bevy and Unreal |
//! | [`many_machines`] | one bake on many machines |
//! | [`options`] | every option of a bake: values, default, accuracy, cost |
//! | [`accuracy`] | estimators, error targets, energy accounts, studies, comparisons |
//! | [`hard_cases`] | what is tested, and the limits that remain |
//! | [`how_it_works`] | the algorithm, a glossary, and two walks through the code |
//! | [`contributing`] | layout of the source, tests, where to add things |
//! | [`changes`] | change log |

#[doc = include_str!("accuracy.md")]
pub mod accuracy {}

#[doc = include_str!("blender.md")]
pub mod blender {}

#[doc = include_str!("changes.md")]
pub mod changes {}

#[doc = include_str!("contributing.md")]
pub mod contributing {}

#[doc = include_str!("engines.md")]
pub mod engines {}

#[doc = include_str!("formats.md")]
pub mod formats {}

#[doc = include_str!("glass_and_lamps.md")]
pub mod glass_and_lamps {}

#[doc = include_str!("hard_cases.md")]
pub mod hard_cases {}

#[doc = include_str!("how_it_works.md")]
pub mod how_it_works {}

#[doc = include_str!("many_machines.md")]
pub mod many_machines {}

#[doc = include_str!("moving_scenes.md")]
pub mod moving_scenes {}
#[doc = include_str!("options.md")]
pub mod options {}

#[doc = include_str!("scenes.md")]
pub mod scenes {}

#[doc = include_str!("surfaces.md")]
pub mod surfaces {}

#[doc = include_str!("window.md")]
pub mod window {}
