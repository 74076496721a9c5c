//! Changes of the window's state as JSON lines, for support and for tests.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};

use super::exporting::ExportState;
use super::worker::{BakedLevel, EffectDifference};
use crate::error::{Error, Result};

/// Figures of a level.
pub(super) fn baked(baked: &BakedLevel) -> Value {
    json!({
        "request": baked.serial,
        "level": baked.level,
        "bake_s": baked.seconds,
        "error": baked.result.estimated_error(baked.request.settings.error_metric),
        "stop_reason": baked.result.stop_reason,
        "rays": baked.result.counts.rays,
        "splats": baked.result.counts.splats,
        "cells": baked.result.counts.cells,
        "maps": baked.result.maps.len(),
        "settings": baked.request.settings,
    })
}

/// Figures of the contribution of an effect.
pub(super) fn compared(worth: &EffectDifference) -> Value {
    let effect = worth.effect.name();
    match &worth.difference {
        Ok(found) => json!({
            "effect": effect,
            "with_w": found.with_w,
            "without_w": found.without_w,
            "relative_rmse": found.relative_rmse,
        }),
        Err(sentence) => json!({"effect": effect, "failed": sentence}),
    }
}

/// Writes events to a file, if one was requested.
#[derive(Debug)]
pub struct EventLog {
    file: Option<File>,
    start: Instant,
}

impl EventLog {
    /// Creates or truncates the file; `None` writes no log.
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

    pub fn is_kept(&self) -> bool {
        self.file.is_some()
    }

    /// Writes one line: the event's name and further fields. If the log cannot be written any more, logging ends with
    /// a warning; the window stays open.
    pub fn write(&mut self, event: &str, more: Value) {
        let Some(file) = &mut self.file else { return };
        let mut line = json!({"event": event});
        if let (Some(line), Value::Object(more)) = (line.as_object_mut(), more) {
            line.extend(more);
        }
        line["seconds"] = json!(self.start.elapsed().as_secs_f64());
        if let Err(error) = writeln!(file, "{line}") {
            log::warn!("the event log cannot be written any more: {error}");
            self.file = None;
        }
    }

    /// Writes the state of an export.
    pub(super) fn write_export(&mut self, state: &ExportState) {
        match state {
            ExportState::Failed(sentence) => self.write("not_exported", json!({"sentence": sentence})),
            ExportState::Done(path) => self.write("exported", json!({"path": path})),
            _ => self.write("exporting", Value::Null),
        }
    }
}
