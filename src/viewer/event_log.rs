//! What the window did, one JSON object per line: for support, and for tests that cannot look inside.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use super::beside::Reference;
use super::controls::Control;
use super::exporting::ExportState;
use super::latency::Latencies;
use super::probe::Probed;
use super::worker::{BakedLevel, Worth};
use crate::error::{Error, Result};
use crate::eye_pass::renderer::Uploaded;
use crate::light_pass::sketch::Sketch;
use crate::scene::Edit;
use crate::settings::BakeSettings;

/// Something that happened.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// The window is open.
    Started {
        /// Scene in it.
        scene: &'a str,
        /// What draws it.
        adapter: &'a str,
    },
    /// A scene is being read.
    Opening(&'a str),
    /// Another scene is in the window.
    Opened {
        /// Its name.
        scene: &'a str,
        /// What was asked for.
        source: &'a str,
        /// Whether it is the same one, read again.
        again: bool,
    },
    /// A scene could not be read: the one before stays.
    NotOpened {
        /// What was asked for.
        source: &'a str,
        /// Why.
        sentence: &'a str,
    },
    /// What was kept of a scene is taken over.
    FoundAgain(&'a str),
    /// A bake was asked for.
    Baking {
        /// With what.
        settings: &'a BakeSettings,
    },
    /// Whole maps came on the way to what was asked for.
    Level {
        /// The maps.
        level: &'a BakedLevel,
        /// Whether the next picture shows them: false where better ones of the same light are there.
        shown: bool,
    },
    /// A bake is complete; its maps are in the next picture.
    Done(&'a BakedLevel),
    /// Maps or a scene went to the device.
    Uploaded {
        /// What of them had changed.
        uploaded: Uploaded,
        /// How long the window's thread took to find and send that [s].
        seconds: f64,
    },
    /// Controls of the panel are elsewhere than before.
    Controls(&'a [Control]),
    /// The scene was edited.
    Edited(&'a Edit),
    /// The last change was taken back: its name.
    Undone(&'a str),
    /// A change that was taken back was done again: its name.
    Redone(&'a str),
    /// What an effect is worth to the maps that are shown was found, or what failed.
    Compared(&'a Worth),
    /// The maps that are shown were held against others.
    Against(&'a Reference),
    /// How light runs was found.
    Sketched(&'a Sketch),
    /// What lights a point was found.
    Probe(&'a Probed),
    /// The picture shows the light, how far it may be off, or what an effect is worth.
    Shows(&'a str),
    /// The camera gets about in another way.
    Travel(&'a str),
    /// A view was kept, or gone to.
    Bookmark {
        /// From 0 on.
        number: usize,
        /// Kept now; gone to otherwise.
        kept: bool,
    },
    /// The bake was stopped.
    Cancelled,
    /// The bake failed.
    Failed(&'a str),
    /// A setting was changed in the panel.
    SettingsChanged(&'a BakeSettings),
    /// The picture was written to files.
    Saved(&'a [PathBuf]),
    /// The picture could not be written.
    NotSaved(&'a str),
    /// Maps were written to a file or folder, or could not be.
    Exported(&'a ExportState),
    /// Something was picked in the picture: its name.
    Picked(&'a str),
    /// The camera's path has other keys: how many.
    Recorded(usize),
    /// The camera's path began to be played, or ended.
    Played(bool),
    /// The exposure was measured [stops].
    Exposure(f64),
    /// Pictures since the start; written when the window comes to rest.
    AtRest {
        /// Pictures of the scene that were drawn.
        pictures: u64,
        /// Frames of the window that were shown.
        frames: u64,
        /// Position of the camera [m].
        position: [f64; 3],
        /// What the last timed picture took on the graphics device [ms]; `None` where it cannot tell.
        device_ms: Option<f64>,
    },
    /// How long events have waited for the frames that showed them: written when the window closes.
    Latency(&'a Latencies),
    /// The graphics device refused something.
    Fault(&'a str),
    /// The graphics device was lost.
    DeviceLost(&'a str),
    /// A new device took its place.
    DeviceRecovered,
    /// The window closes.
    Closing,
}

impl Event<'_> {
    fn to_json(&self) -> Value {
        match self {
            Self::Started { scene, adapter } => {
                json!({"event": "started", "scene": scene, "adapter": adapter})
            }
            Self::Opening(source) => json!({"event": "opening", "source": source}),
            Self::Opened { scene, source, again } => {
                json!({"event": "opened", "scene": scene, "source": source, "again": again})
            }
            Self::NotOpened { source, sentence } => {
                json!({"event": "not_opened", "source": source, "sentence": sentence})
            }
            Self::FoundAgain(source) => json!({"event": "found_again", "source": source}),
            Self::Baking { settings } => json!({"event": "baking", "settings": settings}),
            Self::Level { level, shown } => {
                let mut line = baked("level", level);
                line["shown"] = json!(shown);
                line
            }
            Self::Done(level) => baked("done", level),
            Self::Uploaded { uploaded, seconds } => {
                json!({
                    "event": "upload",
                    "tiles": uploaded.tiles,
                    "tile_bytes": uploaded.tile_bytes,
                    "other_bytes": uploaded.other_bytes,
                    "upload_s": seconds,
                })
            }
            Self::Controls(controls) => {
                let control = |c: &Control| json!({"role": c.role, "name": c.name, "rect_pixels": c.rect});
                json!({"event": "controls", "controls": controls.iter().map(control).collect::<Vec<_>>()})
            }
            Self::Sketched(sketch) => json!({
                "event": "sketched",
                "rays": sketch.rays,
                "landings": sketch.landings.len(),
                "patches": sketch.patches.len(),
            }),
            Self::Edited(edit) => json!({"event": "edit", "target": format!("{:?}", edit.target())}),
            Self::Undone(what) => json!({"event": "undone", "what": what}),
            Self::Redone(what) => json!({"event": "redone", "what": what}),
            Self::Compared(worth) => compared(worth),
            Self::Against(reference) => json!({
                "event": "against",
                "name": reference.name,
                "relative_rmse": reference.relative_rmse.as_ref().ok(),
            }),
            Self::Probe(probed) => probed.to_json(),
            Self::Shows(what) => json!({"event": "shows", "what": what}),
            Self::Travel(way) => json!({"event": "travel", "way": way}),
            Self::Bookmark { number, kept } => {
                json!({"event": "bookmark", "number": number + 1, "kept": kept})
            }
            Self::Cancelled => json!({"event": "cancelled"}),
            Self::Failed(sentence) => json!({"event": "failed", "sentence": sentence}),
            Self::SettingsChanged(settings) => json!({"event": "settings", "settings": settings}),
            Self::Saved(files) => json!({"event": "saved", "files": files}),
            Self::NotSaved(sentence) => json!({"event": "not_saved", "sentence": sentence}),
            Self::Exported(ExportState::Failed(sentence)) => {
                json!({"event": "not_exported", "sentence": sentence})
            }
            Self::Exported(ExportState::Done(path)) => json!({"event": "exported", "path": path}),
            Self::Exported(_) => json!({"event": "exporting"}),
            Self::Picked(name) => json!({"event": "picked", "name": name}),
            Self::Recorded(keys) => json!({"event": "recorded", "keys": keys}),
            Self::Played(plays) => json!({"event": if *plays { "plays" } else { "played" }}),
            Self::Exposure(stops) => json!({"event": "exposure", "stops": stops}),
            Self::AtRest {
                pictures,
                frames,
                position,
                device_ms,
            } => json!({
                "event": "rest",
                "pictures": pictures,
                "frames": frames,
                "position_m": position,
                "device_ms": device_ms,
            }),
            Self::Latency(latencies) => json!({
                "event": "latency",
                "while_baking": latencies.while_baking(),
                "otherwise": latencies.otherwise(),
            }),
            Self::Fault(sentence) => json!({"event": "fault", "sentence": sentence}),
            Self::DeviceLost(reason) => json!({"event": "device_lost", "reason": reason}),
            Self::DeviceRecovered => json!({"event": "device_recovered"}),
            Self::Closing => json!({"event": "closing"}),
        }
    }
}

fn compared(worth: &Worth) -> Value {
    let effect = worth.effect.name();
    match &worth.difference {
        Ok(found) => json!({
            "event": "compared",
            "effect": effect,
            "with_w": found.with_w,
            "without_w": found.without_w,
            "relative_rmse": found.relative_rmse,
        }),
        Err(sentence) => json!({"event": "compared", "effect": effect, "failed": sentence}),
    }
}

fn baked(event: &str, baked: &BakedLevel) -> Value {
    json!({
        "event": event,
        "request": baked.serial,
        "level": baked.level,
        "bake_s": baked.seconds,
        "error": baked.result.estimated_relative_rmse,
        "stop_reason": baked.result.stop_reason,
        "rays": baked.result.counts.rays,
        "splats": baked.result.counts.splats,
        "cells": baked.result.counts.cells,
        "maps": baked.result.maps.len(),
        "settings": baked.request.settings,
    })
}

/// The file, or nothing where none was asked for.
#[derive(Debug)]
pub struct EventLog {
    file: Option<File>,
    start: Instant,
}

impl EventLog {
    /// Opens the file anew; `None` keeps no log.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn open(path: Option<&Path>) -> Result<Self> {
        let create = |path: &Path| {
            File::create(path).map_err(|error| {
                Error::failure(
                    path.display().to_string(),
                    format!("the event log cannot be written: {error}"),
                    "name a file in a folder that you may write to",
                )
            })
        };
        Ok(Self {
            file: path.map(create).transpose()?,
            start: Instant::now(),
        })
    }

    /// Whether anything that is told is kept.
    pub fn is_kept(&self) -> bool {
        self.file.is_some()
    }

    /// Writes one line. A log that can no longer be written is given up with a warning: the window matters more.
    pub fn write(&mut self, event: &Event<'_>) {
        let Some(file) = &mut self.file else { return };
        let mut line = event.to_json();
        line["seconds"] = json!(self.start.elapsed().as_secs_f64());
        if let Err(error) = writeln!(file, "{line}") {
            log::warn!("the event log cannot be written any more: {error}");
            self.file = None;
        }
    }
}
