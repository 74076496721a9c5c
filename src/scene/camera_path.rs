//! A way for a camera through a scene, from a file: straight lines between keys, which are equally long in time.
//!
//! The file is JSON: `{"frames": N, "vertical_fov_deg": F, "keys": [{"position_m": [x, y, z], "target_m": [x, y, z]},
//! ...]}`, positions in the coordinates of the scene's file. Nothing else may stand in it.

use std::path::Path;

use glam::DVec3;
use serde::Deserialize;

use super::Camera;
use crate::error::{Error, Result};
use crate::files;

/// Most frames of a path, and most keys.
const MAX_FRAMES: usize = 10_000;
/// Largest file that is read: far beyond what so many keys take [bytes].
const MAX_BYTES: u64 = 8_000_000;
/// Farthest from the origin that a coordinate may lie [m].
const MAX_COORDINATE_M: f64 = 1e9;
/// Angles of view that make a picture [degrees].
const FOV_DEG: std::ops::RangeInclusive<f64> = 0.1..=170.0;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    frames: usize,
    vertical_fov_deg: f64,
    keys: Vec<Key>,
}

/// Where the eye is at some time, and what it looks at [m].
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Key {
    position_m: DVec3,
    target_m: DVec3,
}

impl Key {
    fn lerp(self, other: Self, share: f64) -> Self {
        Self {
            position_m: self.position_m.lerp(other.position_m, share),
            target_m: self.target_m.lerp(other.target_m, share),
        }
    }

    fn is_in_range(self) -> bool {
        let coordinates = [self.position_m, self.target_m].map(|point| point.to_array());
        // Not a number is in no range.
        let is_in_range = |coordinate: &f64| coordinate.abs() <= MAX_COORDINATE_M;
        coordinates.as_flattened().iter().all(is_in_range)
    }
}

/// A camera for each frame.
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
        let bytes = files::read_file(path, MAX_BYTES)?;
        Self::parse(&bytes, &path.display().to_string())
    }

    /// Reads the contents of a file; `location` is named in errors.
    ///
    /// # Errors
    /// No JSON of this form; fewer than 2 keys; frames, angle or coordinates out of range; an eye at its target.
    pub fn parse(json: &[u8], location: &str) -> Result<Self> {
        let refused = |what: String, remedy: &str| {
            Err(Error::failure(
                location,
                format!("is no camera path ({what})"),
                remedy,
            ))
        };
        let document: Document = match serde_json::from_slice(json) {
            Ok(document) => document,
            Err(error) => {
                return refused(
                    error.to_string(),
                    "give frames, vertical_fov_deg and keys with position_m and target_m, as README.md shows",
                );
            }
        };
        let Document {
            frames,
            vertical_fov_deg,
            keys,
        } = document;
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
                format!("key {} lies beyond 1e9 m", key + 1),
                "give coordinates in metres within the scene",
            );
        }
        let frames: Vec<Key> = (0..frames).map(|frame| at(&keys, frame, frames)).collect();
        if let Some(frame) = frames.iter().position(|key| key.position_m == key.target_m) {
            return refused(
                format!("in frame {} the eye is at its target", frame + 1),
                "move one of the two",
            );
        }
        Ok(Self {
            frames,
            vertical_fov_rad: vertical_fov_deg.to_radians(),
        })
    }

    /// A camera for each frame, at least one; `origin_world` is that of the scene: see [`super::Scene::origin_world`].
    pub fn cameras(&self, origin_world: DVec3) -> Vec<Camera> {
        let frames = self.frames.iter().enumerate();
        let camera = |(frame, key): (usize, &Key)| {
            Camera::look_at(
                format!("frame {}", frame + 1),
                key.position_m - origin_world,
                key.target_m - origin_world,
                self.vertical_fov_rad,
            )
        };
        frames.map(camera).collect()
    }
}

/// The eye in one of some frames: the first frame at the first key, the last at the last.
fn at(keys: &[Key], frame: usize, frames: usize) -> Key {
    let spans = keys.len() - 1;
    let time = frame as f64 / (frames - 1).max(1) as f64 * spans as f64;
    let span = (time as usize).min(spans - 1);
    keys[span].lerp(keys[span + 1], time - span as f64)
}
