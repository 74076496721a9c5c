//! Camera paths: recorded key by key, played, saved and filmed.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::files::free_names;
use crate::effect::{Effect, EffectSwitches};
use crate::error::Result;
use crate::export::frame_folder::FrameFolder;
use crate::eye_pass::View;
use crate::eye_pass::frame_times::{self, Walk};
use crate::files;
use crate::gpu::Gpu;
use crate::illumination::IlluminationMap;
use crate::optics::spectrum::xyz::Matrix3;
use crate::progress::{Control, Progress};
use crate::scene::camera_path::{Key, MAX_FRAMES, PathPlan};
use crate::scene::{Camera, CameraPath, Scene};

/// Frame rate of the playback [1/s].
pub const FRAMES_PER_S: f64 = 30.0;
/// Frames between two cameras of a tour: 4 s.
const FRAMES_OF_LEG: usize = 120;
/// Roll below this is rounding error [degrees].
const LEVEL_DEG: f64 = 1e-6;
/// Location in error messages.
const LOCATION: &str = "camera path";

/// A camera path, and how it is filmed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Film {
    /// In world coordinates; equal times between consecutive keys.
    pub keys: Vec<Key>,
    /// Frames of the whole path, or of one turn of a turntable.
    pub frames: usize,
    /// Vertical field of view of the camera that recorded the last key [degrees].
    pub vertical_fov_deg: f64,
    pub size: (u32, u32),
}

impl Default for Film {
    fn default() -> Self {
        Self {
            keys: Vec::new(),
            frames: 120,
            vertical_fov_deg: 45.0,
            size: (1280, 720),
        }
    }
}

/// Roll of a camera relative to a level one in the same direction, to the right [degrees].
fn lean_deg(level: &Key, camera: &Camera) -> f64 {
    let upright = level.camera(String::new(), DVec3::ZERO, camera.vertical_fov_rad);
    let lean_deg = camera
        .up
        .dot(upright.right())
        .atan2(camera.up.dot(upright.up))
        .to_degrees();
    if lean_deg.abs() < LEVEL_DEG { 0.0 } else { lean_deg }
}

impl Film {
    /// Records a camera: as a new key, or in place of a key. The target is `reach_m` ahead of the camera.
    pub fn record(&mut self, key: Option<usize>, camera: &Camera, origin_world: DVec3, reach_m: f64) {
        let position_m = camera.position + origin_world;
        let new = Key {
            position_m,
            target_m: position_m + camera.forward * reach_m,
            roll_deg: 0.0,
        };
        let new = Key {
            roll_deg: lean_deg(&new, camera),
            ..new
        };
        match key.map(|index| self.keys.get_mut(index)) {
            Some(Some(key)) => *key = new,
            Some(None) => return,
            None => self.keys.push(new),
        }
        self.vertical_fov_deg = camera.vertical_fov_rad.to_degrees();
    }

    /// A closed path through all cameras; the frame size stays.
    #[must_use]
    pub fn tour(&self, cameras: &[Camera], origin_world: DVec3, reach_m: f64) -> Self {
        let mut tour = Self {
            keys: Vec::new(),
            frames: (cameras.len() * FRAMES_OF_LEG).min(MAX_FRAMES),
            ..*self
        };
        for camera in cameras.iter().chain(cameras.first()) {
            tour.record(None, camera, origin_world, reach_m);
        }
        tour
    }

    /// Camera of a key, in scene coordinates.
    pub fn camera_at(&self, key: usize, origin_world: DVec3) -> Option<Camera> {
        let found = self.keys.get(key)?;
        let vertical_fov_rad = self.vertical_fov_deg.to_radians();
        Some(found.camera(format!("key {}", key + 1), origin_world, vertical_fov_rad))
    }

    /// Takes over a path read from a file; the frame size stays.
    pub fn take(&mut self, plan: PathPlan) {
        self.frames = plan.frames;
        self.vertical_fov_deg = plan.vertical_fov_deg;
        self.keys = plan.keys;
    }

    fn plan(&self) -> PathPlan {
        PathPlan {
            frames: self.frames,
            vertical_fov_deg: self.vertical_fov_deg,
            keys: self.keys.clone(),
        }
    }

    /// The path through all keys.
    ///
    /// # Errors
    /// As [`PathPlan::path`].
    pub fn path(&self) -> Result<CameraPath> {
        self.plan().path(LOCATION)
    }

    /// Writes the path to a new file in a folder; returns its path.
    ///
    /// # Errors
    /// As [`path`](Self::path); the file cannot be written; no number is free.
    pub fn save(&self, folder: &Path, scene: &str) -> Result<PathBuf> {
        self.path()?;
        let path = free_name(folder, scene, "path", ".json")?;
        self.plan().write(&path)?;
        Ok(path)
    }
}

/// State of a path's playback.
#[derive(Clone, Debug)]
pub struct Player {
    cameras: Vec<Camera>,
    seconds: f64,
}

impl Player {
    /// Starts at the first camera; `None` if there is none.
    pub fn new(cameras: Vec<Camera>) -> Option<Self> {
        (!cameras.is_empty()).then_some(Self {
            cameras,
            seconds: 0.0,
        })
    }

    /// Advances by a time [s, ≥ 0]; returns the camera to show and whether it is the last.
    pub fn advance(&mut self, seconds: f64) -> (&Camera, bool) {
        self.seconds += seconds;
        let last = self.cameras.len() - 1;
        let frame = ((self.seconds * FRAMES_PER_S) as usize).min(last);
        (&self.cameras[frame], frame == last)
    }
}

/// Everything needed to draw the frames of a film.
#[derive(Debug)]
pub struct FilmJob {
    pub scene: Arc<Scene>,
    pub maps: Vec<IlluminationMap>,
    /// One camera per frame.
    pub cameras: Vec<Camera>,
    /// Size, exposure and tone map of every frame.
    pub view: View,
    /// Switches of chains and dispersion.
    pub effects: EffectSwitches,
    /// Matrix applied to radiance before tone mapping.
    pub white_balance: Matrix3,
    /// Part of the frame folder's name: `frames` or `turntable`.
    pub name: &'static str,
}

impl FilmJob {
    /// Draws every frame on a device of its own and writes it to a new folder in `folder`; returns its path.
    ///
    /// # Errors
    /// No graphics adapter; a frame that does not fit on the device; a file that cannot be written; cancellation.
    pub fn shoot(&self, folder: &Path, progress: &dyn Progress, control: &Control) -> Result<PathBuf> {
        let gpu = Gpu::headless()?;
        let path = free_name(folder, &self.scene.name, self.name, "")?;
        let frames = FrameFolder::open(&path)?;
        let walk = Walk {
            scene: &self.scene,
            maps: &self.maps,
            view: self.view.clone(),
            cameras: &self.cameras,
            effects: &self.effects,
            white_balance: self.white_balance,
        };
        let size = (self.view.width, self.view.height);
        let mut write = |frame: usize, rgba: Vec<u8>| frames.write(frame, size, rgba);
        frame_times::measure(
            &gpu,
            &walk,
            &[self.effects.get(Effect::Chains)],
            Some(&mut write),
            progress,
            control,
        )?;
        Ok(path)
    }
}

fn free_name(folder: &Path, scene: &str, kind: &str, ending: &str) -> Result<PathBuf> {
    let stem = format!("nephroid-{}-{kind}", files::slug(scene, "scene"));
    let [path] = free_names(folder, |number| [format!("{stem}-{number}{ending}")])?;
    Ok(path)
}
