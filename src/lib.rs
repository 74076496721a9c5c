//! Nephroid bakes light that passed through glass, mirrors and water into illumination maps, and shows the result in an
//! interactive window. This crate is the library behind the program of the same name; baking needs neither a window
//! nor a graphics card.
//!
//! ```
//! use std::sync::Arc;
//! use nephroid::export::map_folder::MapFolder;
//! use nephroid::progress::Control;
//! use nephroid::scene::{self, LoadOptions};
//! use nephroid::session::BakeSession;
//! use nephroid::settings::{BakeSettings, MapResolution};
//!
//! # let folder = tempfile::tempdir().expect("a temporary folder");
//! # let folder = folder.path();
//! let scene = Arc::new(scene::load("builtin:ring", &LoadOptions::default())?); // or a .glb
//! let map_resolution = MapResolution::Fixed { width: 64, height: 64 };
//! let settings = BakeSettings { density_per_sr: 1e3, map_resolution, ..BakeSettings::default() };
//! let control = Control::default(); // any thread may call control.cancel()
//! let progress = |stage: nephroid::progress::Stage, done: u64, total: u64| println!("{}: {done} of {total}", stage.name());
//! let result = BakeSession::new(scene.clone())?.bake(&settings, &progress, &control)?;
//! assert!(!result.partial && result.maps[0].width() == 64);
//! MapFolder::open(folder, false)?.write(&scene, &settings, &result)?; // maps and manifest.json
//! # Ok::<(), nephroid::error::Error>(())
//! ```
//!
//! A [`session::BakeSession`] that is kept bakes again only what a change of scene or settings affects.
//!
//! The [guide]: [the window](guide::window), [scenes](guide::scenes), [glass and lights](guide::glass_and_lamps),
//! [surfaces and maps](guide::surfaces), [files and units](guide::formats), [other programs](guide::engines),
//! [many machines](guide::many_machines), [accuracy](guide::accuracy), [hard cases](guide::hard_cases),
//! [how it works](guide::how_it_works), [contributing](guide::contributing), [changes](guide::changes).
//!
//! A module imports only from modules above it in `src/lib.rs`.

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

pub mod guide;
