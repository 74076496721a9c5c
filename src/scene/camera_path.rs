//! A camera path from a file: straight lines between keys at equal intervals of time.
//!
//! The file is JSON: `{"frames": N, "vertical_fov_deg": F, "keys": [{"position_m": [x, y, z], "target_m": [x, y, z],
//! "roll_deg": R}, ...]}`, positions in the coordinates of the scene's file; `roll_deg` is optional. Other fields are
//! refused.

use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Camera;
use crate::error::{Error, Result};
use crate::files;

/// Largest number of frames, and of keys.
pub const MAX_FRAMES: usize = 10_000;
/// Size limit of a file: far beyond what the largest number of keys takes [bytes].
const MAX_BYTES: u64 = 8_000_000;
/// Limit of the coordinates [m].
const MAX_COORDINATE_M: f64 = 1e9;
/// Allowed fields of view [degrees].
const FOV_DEG: std::ops::RangeInclusive<f64> = 0.1..=170.0;

/// Contents of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathPlan {
    /// Number of frames from the first key to the last, 1 to [`MAX_FRAMES`].
    pub frames: usize,
    /// Field of view, 0.1 to 170 [degrees].
    pub vertical_fov_deg: f64,
    /// 2 to [`MAX_FRAMES`] keys.
    pub keys: Vec<Key>,
}

/// Position and target of the eye at some time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// In the coordinates of the scene's file [m].
    pub position_m: DVec3,
    /// In the same coordinates [m]; differs from the position.
    pub target_m: DVec3,
    /// Roll to the right, −360 to 360 [degrees].
    #[serde(default, skip_serializing_if = "is_level")]
    pub roll_deg: f64,
}

impl Key {
    fn lerp(self, other: Self, share: f64) -> Self {
        Self {
            position_m: self.position_m.lerp(other.position_m, share),
            target_m: self.target_m.lerp(other.target_m, share),
            roll_deg: self.roll_deg + share * shorter_way_deg(other.roll_deg - self.roll_deg),
        }
    }

    /// Camera at the key, in scene coordinates.
    pub fn camera(&self, name: String, origin_world: DVec3, vertical_fov_rad: f64) -> Camera {
        let (position, target) = (self.position_m - origin_world, self.target_m - origin_world);
        let mut camera = Camera::look_at(name, position, target, vertical_fov_rad);
        let (sine, cosine) = self.roll_deg.to_radians().sin_cos();
        camera.up = camera.up * cosine + camera.right() * sine;
        camera
    }

    fn is_in_range(self) -> bool {
        let coordinates = [self.position_m, self.target_m].map(|point| point.to_array());
        // False for NaN.
        let is_in_range = |coordinate: &f64| coordinate.abs() <= MAX_COORDINATE_M;
        coordinates.as_flattened().iter().all(is_in_range) && self.roll_deg.abs() <= 360.0
    }
}

fn is_level(roll_deg: &f64) -> bool {
    *roll_deg == 0.0
}

/// The equivalent rotation by at most half a turn.
fn shorter_way_deg(turn_deg: f64) -> f64 {
    turn_deg - 360.0 * (turn_deg / 360.0).round()
}

impl PathPlan {
    /// Reads a file without checking the ranges of its values.
    ///
    /// # Errors
    /// A file that cannot be read, or that is not JSON of this form.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = files::read_file(path, MAX_BYTES)?;
        Self::parse(&bytes, &path.display().to_string())
    }

    fn parse(json: &[u8], location: &str) -> Result<Self> {
        serde_json::from_slice(json).map_err(|error| {
            refused(
                location,
                &error.to_string(),
                "give frames, vertical_fov_deg and keys with position_m and target_m, as the guide's page on the window shows",
            )
        })
    }

    /// Writes the plan to a file for [`read`](Self::read).
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|error| Error::failure("camera path", error.to_string(), "report this"))?;
        files::write_atomically(path, |writer| writeln!(writer, "{text}"))
    }

    /// Checks the plan and interpolates its frames; `location` is named in errors.
    ///
    /// # Errors
    /// Fewer than 2 keys; frames, field of view or coordinates out of range; an eye at its target.
    pub fn path(&self, location: &str) -> Result<CameraPath> {
        // Values come from a file; within these ranges, frames are few enough to be kept and all cameras are finite.
        let Self {
            frames,
            vertical_fov_deg,
            ref keys,
        } = *self;
        let refused = |what: String, remedy: &str| Err(refused(location, &what, remedy));
        if !(1..=MAX_FRAMES).contains(&frames) {
            return refused(format!("{frames} frames"), "give 1 to 10000 frames");
        }
        if !(2..=MAX_FRAMES).contains(&keys.len()) {
            return refused(format!("number of keys: {}", keys.len()), "give 2 to 10000 keys");
        }
        if !FOV_DEG.contains(&vertical_fov_deg) {
            return refused(
                format!("vertical_fov_deg is {vertical_fov_deg}"),
                "give an angle of 0.1 to 170 degrees",
            );
        }
        if let Some(key) = keys.iter().position(|key| !key.is_in_range()) {
            return refused(
                format!("key {} lies beyond 1e9 m, or leans by more than a turn", key + 1),
                "give coordinates in metres within the scene, and an angle in degrees",
            );
        }

        // Eye and target may meet between two keys that keep them apart, so that frames are checked and not keys.
        let frames: Vec<Key> = (0..frames).map(|frame| at(keys, frame, frames)).collect();
        if let Some(frame) = frames.iter().position(|key| key.position_m == key.target_m) {
            return refused(
                format!("in frame {} the eye is at its target", frame + 1),
                "move one of the two",
            );
        }
        Ok(CameraPath {
            frames,
            vertical_fov_rad: vertical_fov_deg.to_radians(),
        })
    }
}

fn refused(location: &str, what: &str, remedy: &str) -> Error {
    Error::failure(location, format!("is no camera path ({what})"), remedy)
}

/// Interpolated keys, one per frame.
#[derive(Clone, Debug)]
pub struct CameraPath {
    frames: Vec<Key>,
    vertical_fov_rad: f64,
}

impl CameraPath {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read; those of [`parse`](Self::parse).
    pub fn read(path: &Path) -> Result<Self> {
        PathPlan::read(path)?.path(&path.display().to_string())
    }

    /// Reads the contents of a file; `location` is named in errors.
    ///
    /// # Errors
    /// Text that is not JSON of this form; errors of [`PathPlan::path`].
    pub fn parse(json: &[u8], location: &str) -> Result<Self> {
        PathPlan::parse(json, location)?.path(location)
    }

    /// One camera per frame, at least one; `origin_world` is [`super::Scene::origin_world`].
    pub fn cameras(&self, origin_world: DVec3) -> Vec<Camera> {
        let frames = self.frames.iter().enumerate();
        let camera = |(frame, key): (usize, &Key)| {
            key.camera(
                format!("frame {}", frame + 1),
                origin_world,
                self.vertical_fov_rad,
            )
        };
        frames.map(camera).collect()
    }
}

/// Key of a frame, interpolated: the first frame is at the first key, the last one at the last.
fn at(keys: &[Key], frame: usize, frames: usize) -> Key {
    let spans = keys.len() - 1;
    let time = frame as f64 / (frames - 1).max(1) as f64 * spans as f64;
    let span = (time as usize).min(spans - 1);
    keys[span].lerp(keys[span + 1], time - span as f64)
}
