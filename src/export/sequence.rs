//! Maps of a moving scene: `maps/NNNN_slug/0001.exr` and on, and one manifest with the time of each frame.

use std::path::Path;

use super::manifest::{ErrorEstimate, FrameEntry, Manifest, SceneSummary, Sequence};
use super::map_folder::MapFolder;
use crate::bake::Bake;
use crate::error::Result;
use crate::scene::Scene;
use crate::settings::BakeSettings;

/// Equally spaced moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTimes {
    /// Number of frames, at least 1.
    pub frames: usize,
    /// Frames per second, > 0.
    pub fps: f64,
    /// Whether the first frame follows the last.
    pub is_loop: bool,
}

impl FrameTimes {
    /// Time from the first frame to the one after the last [s].
    pub fn duration_s(&self) -> f64 {
        self.frames as f64 / self.fps
    }

    /// Time of a frame, counted from 0 [s].
    pub fn time_s(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }

    /// The scene that the frames show; for a loop, one that repeats with them.
    pub fn scene(&self, scene: &Scene) -> Scene {
        if self.is_loop {
            scene.looped(self.duration_s())
        } else {
            scene.clone()
        }
    }

    /// A moment [s] as it is shown; wrapped into the duration of a loop.
    pub fn within(&self, time_s: f64) -> f64 {
        if self.is_loop {
            time_s % self.duration_s()
        } else {
            time_s
        }
    }
}

/// An output folder that takes one frame after another.
#[derive(Debug)]
pub struct SequenceFolder {
    folder: MapFolder,
    first: Option<Manifest>,
    times: FrameTimes,
    frames: Vec<FrameEntry>,
}

impl SequenceFolder {
    /// As [`MapFolder::open`].
    ///
    /// # Errors
    /// As [`MapFolder::open`].
    pub fn open(path: &Path, force: bool, times: FrameTimes) -> Result<Self> {
        Ok(Self {
            folder: MapFolder::open(path, force)?,
            first: None,
            times,
            frames: Vec::new(),
        })
    }

    /// Writes the maps of the scene at the time of a frame, counted from 0.
    ///
    /// # Errors
    /// A full disk; a place that can no longer be written.
    pub fn write(
        &mut self,
        frame: usize,
        scene: &Scene,
        settings: &BakeSettings,
        result: &Bake,
    ) -> Result<&FrameEntry> {
        let maps = self.folder.write_maps(scene, settings, result, Some(frame + 1))?;
        self.first
            .get_or_insert_with(|| Manifest::new(scene, settings, result, maps.clone()));
        self.frames.push(FrameEntry {
            frame: frame + 1,
            time_s: self.times.time_s(frame),
            geometry_hash: SceneSummary::of(scene).geometry_hash,
            stop_reason: result.stop_reason,
            error: ErrorEstimate {
                estimated_relative_rmse: result.estimated_relative_rmse,
                estimated_visible: result.estimated_visible,
            },
            rays: result.counts.rays,
            energy_w: result.ledgers.iter().map(|ledger| &ledger.energy_w).sum(),
            cpu_s: result.cpu_s.total,
            maps,
        });
        Ok(&self.frames[self.frames.len() - 1])
    }

    /// Writes the manifest; `None` if there were no frames.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn finish(self) -> Result<Option<Manifest>> {
        let Some(mut manifest) = self.first else {
            return Ok(None);
        };
        manifest.sequence = Some(Sequence {
            fps: self.times.fps,
            is_loop: self.times.is_loop,
            frames: self.frames,
        });
        self.folder.finish(manifest).map(Some)
    }
}
