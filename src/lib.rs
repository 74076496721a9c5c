//! Nephroid bakes light that passed through glass, mirrors and water into illumination maps, and shows the result in an
//! interactive window. This crate is the library behind the program of the same name; baking needs neither a window
//! nor a graphics card.
//!
//! ```
//! use nephroid::{Baker, BakeSettings, Control, LoadOptions, MapFolder, Scene, View, render};
//!
//! # let folder = tempfile::tempdir().expect("a temporary folder");
//! # std::env::set_current_dir(&folder).expect("it is there");
//! let scene = std::sync::Arc::new(Scene::load("builtin:ring", &LoadOptions::default())?); // or a .glb
//! let settings = BakeSettings { max_error: Some(0.1), ..BakeSettings::default() };
//! let control = Control::default(); // any thread may call control.cancel()
//! let bake = Baker::new(scene.clone())?.bake(&settings, &(), &control)?;
//! println!("{} maps, visible error {:?}", bake.maps.len(), bake.estimated_visible);
//! MapFolder::open("maps", false)?.write(&scene, &settings, &bake)?; // OpenEXR files and manifest.json
//! let mut view = View::new(scene.cameras[0].clone(), [64, 36]);
//! let picture = render(&scene, &bake.maps, &view, &(), &control)?;
//! view.exposure_stops = picture.auto_exposure_stops();
//! picture.save("ring.png", &view)?;
//! # assert!(!bake.partial && bake.maps.len() == 1);
//! # Ok::<(), nephroid::Error>(())
//! ```
//!
//! A [`Baker`] that is kept bakes again only what a change of scene or settings affects. [`MapSet`] reads maps back,
//! for [`write_glb`] and [`write_textures`]. [`settings`] has what [`BakeSettings`] are made of.
//!
//! The [guide]: [the window](guide::window), [scenes](guide::scenes), [glass and lights](guide::glass_and_lamps),
//! [surfaces and maps](guide::surfaces), [files and units](guide::formats), [other programs](guide::engines),
//! [many machines](guide::many_machines), [accuracy](guide::accuracy), [hard cases](guide::hard_cases),
//! [how it works](guide::how_it_works), [contributing](guide::contributing), [changes](guide::changes).

// Brackets hold units, as in `area [m²]`, and no links.
#![allow(rustdoc::broken_intra_doc_links)]

pub use bake::{Bake, Baker, StopReason};
pub use error::{Error, ErrorKind, Result, Warning};
pub use export::glb::{Carrier, GlbOptions, write as write_glb};
pub use export::map_folder::MapFolder;
pub use export::map_set::MapSet;
pub use export::textures::{Encoding, TextureFolder, TextureOptions, write as write_textures};
pub use eye_pass::{Picture, ToneMap, View, render};
pub use illumination::IlluminationMap;
pub use progress::{Control, Progress, Stage};
pub use scene::{Camera, LoadOptions, Scene};
pub use settings::{BakeSettings, Estimator, LayerKind, MapResolution};

pub mod guide;
pub mod settings;

// Internals for the crate's own program and tests; they may change without notice. Imports between modules form no
// cycle.
#[doc(hidden)]
pub mod bake;
#[doc(hidden)]
pub mod effect;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod export;
#[doc(hidden)]
pub mod eye_pass;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod geometry;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub mod gpu;
#[doc(hidden)]
pub mod illumination;
#[doc(hidden)]
pub mod light_pass;
#[doc(hidden)]
pub mod optics;
#[doc(hidden)]
pub mod plan;
#[doc(hidden)]
pub mod progress;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod study;
#[doc(hidden)]
pub mod transport;
#[doc(hidden)]
pub mod units;
#[cfg(feature = "viewer")]
#[doc(hidden)]
pub mod viewer;
