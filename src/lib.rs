//! Nephroid bakes light that went through glass, mirrors and water into illumination maps, and lets you walk through
//! the result.
//!
//! ```text
//!  glTF or built-in ─► Scene ─► EffectPlan ─► light pass ──► IlluminationMaps ─► eye pass ─► window, PNG
//!                               what this     CPU, rayon      flux per texel     wgpu raster or
//!                               scene needs   obvhs BVH                          CPU ray tracer
//! ```
//!
//! Baking takes a scene, settings, somebody who hears of progress and somebody who may stop it; no window and no graphics
//! card:
//!
//! ```
//! use std::sync::Arc;
//! use nephroid::export::map_folder::MapFolder;
//! use nephroid::progress::{Control, Stage};
//! use nephroid::scene::{self, LoadOptions};
//! use nephroid::session::BakeSession;
//! use nephroid::settings::{BakeSettings, MapResolution};
//!
//! # let folder = tempfile::tempdir().expect("a temporary folder");
//! # let folder = folder.path();
//! let scene = Arc::new(scene::load("builtin:ring", &LoadOptions::default())?); // or a .glb
//! let settings = BakeSettings {
//!     density_per_sr: 1e3,
//!     map_resolution: MapResolution::Fixed { width: 64, height: 64 },
//!     ..BakeSettings::default()
//! };
//! let control = Control::default(); // any thread may call control.cancel(): what there is comes back, marked partial
//! let progress = |stage: Stage, done: u64, total: u64| println!("{}: {done} of {total}", stage.name());
//! let result = BakeSession::new(Arc::clone(&scene))?.bake(&settings, &progress, &control)?;
//! assert!(!result.partial && result.maps[0].width() == 64);
//! MapFolder::open(folder, false)?.write(&scene, &settings, &result)?; // maps and manifest.json
//! # Ok::<(), nephroid::error::Error>(())
//! ```
//!
//! A [`session::BakeSession`] that is kept bakes again what a change of scene or settings touches, and no more.
//!
//! A module imports only what stands above it in this list.

// Units stand in brackets, as in `area [m²]`, which are no links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod effect;
pub mod error;
pub mod settings;
pub mod units;

pub mod files;
#[cfg(feature = "gpu")]
pub mod gpu;

pub mod optics;

pub mod geometry;

pub mod scene;

pub mod plan;

pub mod transport;

pub mod illumination;

pub mod progress;

pub mod light_pass;

pub mod eye_pass;

pub mod session;

pub mod export;

pub mod study;

#[cfg(feature = "viewer")]
pub mod viewer;
