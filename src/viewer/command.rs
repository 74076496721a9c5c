//! What the user chooses and requests. Panel, keys and handles push commands; the model and the window carry them out.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::exporting::Export;
use super::filming::Film;
use super::new_light::NewLight;
use super::panel::{Display, Selection};
use super::sketching::PreviewFlags;
use crate::effect::Effect;
use crate::scene::Edit;
use crate::settings::BakeSettings;

/// The user's present choices. What is serialised can be undone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choices {
    /// Settings of the next bake.
    pub settings: BakeSettings,
    /// Whether changes are baked automatically.
    pub automatic: bool,
    /// How the picture is shown.
    pub display: Display,
    pub film: Film,
    /// What is edited in the panel and has handles in the picture.
    #[serde(skip)]
    pub selection: Selection,
    /// Whether a click on the picture probes the surface.
    #[serde(skip)]
    pub probes: bool,
    /// What the path preview draws.
    #[serde(skip)]
    pub sketched: PreviewFlags,
    /// Whether the scene is reloaded when its files change.
    #[serde(skip)]
    pub watches: bool,
}

impl Choices {
    /// Choices with these settings, and defaults for everything else.
    pub fn new(settings: BakeSettings) -> Self {
        Self {
            settings,
            automatic: true,
            display: Display::default(),
            film: Film::default(),
            selection: Selection::default(),
            probes: false,
            sketched: PreviewFlags::default(),
            watches: false,
        }
    }
}

/// A request by the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Replace the choices.
    Choose(Box<Choices>),
    /// Edit the scene.
    Edit(Edit),
    /// Close the undo step: the mouse is up and no number is being typed.
    Release,
    /// Undo the last change.
    Undo,
    /// Redo the last undone change.
    Redo,
    /// Bake now.
    Rebake,
    /// Cancel the bake.
    Cancel,
    /// Compute the contribution of this effect to the maps shown.
    EffectDifference(Effect),
    /// Begin or end a comparison.
    Compare(CompareCommand),
    /// Record, play or film the camera path.
    Film(FilmCommand),
    /// Control the scene's time.
    Play(PlayCommand),
    /// Write maps to files.
    Export(Export),
    /// Clear the probe.
    ClearProbe,
    /// Go to the brightest spot and probe it.
    Brightest,
    /// Add a light near what the camera looks at.
    AddLight(NewLight),
    /// Open this scene: a path as typed, or `builtin:NAME`.
    Open(String),
    /// For the window: choose a scene in the system's file dialog.
    Browse,
    /// For the window: choose a file for the edited scene.
    SaveScene,
    /// For the window: write the picture to files.
    SavePicture,
    /// For the window: measure the exposure of the picture.
    MeasureExposure,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CompareCommand {
    /// Keep the present maps as the reference.
    Keep,
    /// Load the reference from a folder of maps.
    Load(PathBuf),
    End,
}

/// Control of the scene's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlayCommand {
    /// Start or stop the playback.
    Play(bool),
    /// Scene seconds per second [1].
    Speed(f64),
    /// Go to this time [s].
    GoTo(f64),
}

/// Command of the section *Camera path*.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FilmCommand {
    /// Record the present camera: as a new key, or in place of the key with this index.
    Record(Option<usize>),
    /// Move the camera to the key with this index.
    GoTo(usize),
    /// Start or stop the playback.
    Play(bool),
    /// Replace the path by a tour of the scene's cameras, and play it.
    Tour,
    /// Write the path to a file.
    Save,
    /// Read the path from a file.
    Load(PathBuf),
    /// Draw and write the frames of the path, or of a turntable.
    Shoot {
        /// Film a turntable around the scene instead of the path.
        turns: bool,
    },
    /// Stop drawing frames.
    Stop,
}
