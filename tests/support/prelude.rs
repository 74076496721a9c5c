//! Names that most tests use, and checks that say what they found.

pub use std::f64::consts::{PI, TAU};
use std::fmt::{Debug, Display};
pub use std::sync::Arc;

pub use glam::{DMat3, DQuat, DVec2, DVec3, dvec2, dvec3};
pub use nephroid::bake::Bake;
pub use nephroid::eye_pass::{Picture, View};
pub use nephroid::geometry::Ray;
pub use nephroid::illumination::IlluminationMap;
pub use nephroid::optics::{LinearSrgb, Nanometres};
pub use nephroid::progress::Control;
pub use nephroid::scene::builtin::{self, parts, shapes};
pub use nephroid::scene::texture::Wrap;
pub use nephroid::scene::{
    Camera, Edit, EditState, Light, LightEdit, LightKind, LightSize, LoadOptions, Material, MaterialEdit,
    Mesh, Motion, Scene, SurfaceKind, Texture, Wave, Waves,
};
pub use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
pub use nephroid::transport::{MediumStack, Tracer};
pub use nephroid::units::{Flux, Irradiance, Radiance, RadiantIntensity};
pub use proptest::prelude::*;
pub use serde_json::{Value, json};
pub use crate::assert_close;
pub use crate::glb::{Glb, assert_warned};
pub use crate::tools::builtin_scene as built_in;

pub const fn rgb(r: f64, g: f64, b: f64) -> LinearSrgb {
    LinearSrgb::new(r, g, b)
}

/// Options of loading, changed.
pub fn options(change: impl FnOnce(&mut LoadOptions)) -> LoadOptions {
    with(LoadOptions::default(), change)
}

pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// What [`near`] compares.
pub trait Apart: Copy + Debug {
    fn apart(self, other: Self) -> f64;
}

impl Apart for f64 {
    fn apart(self, other: Self) -> f64 {
        (self - other).abs()
    }
}

impl Apart for DVec2 {
    fn apart(self, other: Self) -> f64 {
        self.distance(other)
    }
}

impl Apart for DVec3 {
    fn apart(self, other: Self) -> f64 {
        self.distance(other)
    }
}

impl Apart for LinearSrgb {
    fn apart(self, other: Self) -> f64 {
        self.to_array().apart(other.to_array())
    }
}

impl<const N: usize> Apart for [f64; N] {
    /// Of the numbers that differ most.
    fn apart(self, other: Self) -> f64 {
        let off = self.into_iter().zip(other).map(|(a, b)| (a - b).abs());
        off.fold(
            0.0,
            |most, off| if off <= most || most.is_nan() { most } else { off },
        )
    }
}

/// Fails unless two things differ by less than the tolerance.
#[track_caller]
pub fn near<T: Apart>(found: T, expected: T, tolerance: f64, what: impl Debug) {
    let is_near = found.apart(expected) < tolerance;
    assert!(
        is_near,
        "{what:?}: {found:?} instead of {expected:?} within {tolerance}"
    );
}

/// Fails unless a sentence has all the parts, which ` | ` separates.
#[track_caller]
pub fn says(sentence: impl Display, parts: &str) {
    let sentence = sentence.to_string();
    assert!(!sentence.contains('\n'), "more than a line: {sentence}");
    for part in parts.split(" | ") {
        assert!(sentence.contains(part), "no {part:?} in: {sentence}");
    }
}

/// Fails unless one of a scene's warnings has all the parts.
#[track_caller]
pub fn warns(scene: &Scene, parts: &str) {
    assert_warned(scene, &parts.split(" | ").collect::<Vec<_>>());
}

#[track_caller]
pub fn warns_not(scene: &Scene) {
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

/// The rows of a table: `left => right`, a line each.
pub fn rows(table: &str) -> impl Iterator<Item = (&str, &str)> {
    let lines = table.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.map(|line| {
        let (left, right) = line.split_once("=>").unwrap_or((line, ""));
        (left.trim(), right.trim())
    })
}

/// JSON as text.
#[track_caller]
pub fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// A thing, changed.
pub fn with<T>(mut it: T, change: impl FnOnce(&mut T)) -> T {
    change(&mut it);
    it
}
