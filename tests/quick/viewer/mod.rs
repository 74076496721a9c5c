//! The window: its parts without a display.

mod config;
mod files;
mod filming;
mod fixtures;
mod hands;
mod headless;
mod lights;
mod model;
mod navigation;
mod pace;
mod panel;
mod scene_edits;
#[allow(dead_code, reason = "full tests use the rest")]
mod scene_file;
mod views;
#[cfg(target_os = "linux")]
mod window;
mod worker;
mod worth;

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use egui::accesskit::Role;
use egui::{Key, Rect, pos2, vec2};
use egui_kittest::kittest::NodeT as _;
use nephroid::bake::StopReason;
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::export::FloatImage;
use nephroid::eye_pass::ToneMap;
use nephroid::eye_pass::renderer::GpuMs;
use nephroid::illumination::difference::Difference;
use nephroid::progress::Stage;
use nephroid::scene::changes::Change;
use nephroid::scene::load::save;
use nephroid::settings::{Estimator, MIN_MAX_ERROR, Sigma};
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::command::{Choices, Command, FilmCommand};
use nephroid::viewer::edits::EditedScene;
use nephroid::viewer::exporting::{Export, ExportState};
use nephroid::viewer::gizmo::GizmoTarget;
use nephroid::viewer::model::{Model, QUIET};
use nephroid::viewer::navigation::NavigationMode;
use nephroid::viewer::new_light::NewLight;
use nephroid::viewer::panel::{Display, LayerShown, Quantity};
use nephroid::viewer::worker::{BakeState, BakedLevel};

use crate::prelude::*;
use fixtures::{act, bake, change, chart, edited, events, folder, intensity, options, set, until, wait_for};
use headless::{Headless, finished, splats};
use support::scenes::map_of as caustic;
