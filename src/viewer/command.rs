//! What the user chooses and requests. Panel, keys and handles push commands; the model and the window carry them out.

use std::path::PathBuf;

use super::exporting::Export;
use super::filming::Film;
use super::new_light::NewLight;
use super::panel::{Display, Selection};
use super::sketching::PreviewFlags;
use crate::effect::Effect;
use crate::scene::Edit;
use crate::settings::BakeSettings;

/// What the user has set.
#[derive(Clone, Debug, PartialEq)]
pub struct Choices {
    /// Of the next bake.
    pub settings: BakeSettings,
    /// Whether a change bakes by itself.
    pub automatic: bool,
    /// Of the picture.
    pub display: Display,
    /// The camera's path.
    pub film: Film,
    /// What is edited, and held by the mouse.
    pub selection: Selection,
    /// Whether a click on the picture asks what lights the surface there.
    pub probes: bool,
    /// What is drawn of the light's way.
    pub sketched: PreviewFlags,
    /// Whether the scene is read again when its files change.
    pub watches: bool,
}

impl Choices {
    /// These settings, everything else at its default.
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

/// What the user asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Set this.
    Choose(Box<Choices>),
    /// Change the scene.
    Edit(Edit),
    /// The next change is a step of its own: the mouse is up, and no number is being typed.
    Release,
    /// Take the last change back.
    Undo,
    /// Do again what was taken back last.
    Redo,
    /// Bake now.
    Rebake,
    /// Stop the bake.
    Cancel,
    /// Find what this effect is worth to the maps that are shown.
    EffectDifference(Effect),
    /// Compare, or stop comparing.
    Compare(CompareCommand),
    /// Record, play or film the camera's path.
    Film(FilmCommand),
    /// Let the scene's time go on, or choose a moment.
    Play(PlayCommand),
    /// Write maps to files.
    Export(Export),
    /// Forget the point that was asked about.
    ClearProbe,
    /// Go to the brightest spot, and ask about it.
    Brightest,
    /// Add a light before what is looked at.
    AddLight(NewLight),
    /// Open this scene: a path as it was typed, or `builtin:NAME`.
    Open(String),
    /// Of the window: choose a scene to open in the system's dialog.
    Browse,
    /// Of the window: choose a file for the edited scene.
    SaveScene,
    /// Of the window: write the picture to files.
    SavePicture,
    /// Of the window: choose the exposure from the picture.
    MeasureExposure,
}

/// What is to become of the comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CompareCommand {
    /// Hold what comes against the present maps.
    Keep,
    /// Hold the present maps against those of a folder.
    Load(PathBuf),
    End,
}

/// What is to become of the scene's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlayCommand {
    /// Go on, or stand still.
    Play(bool),
    /// Seconds of the scene in one second [1].
    Speed(f64),
    /// Stand at this moment [s].
    GoTo(f64),
}

/// What is to become of the camera's path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FilmCommand {
    /// Note the present camera: as a new key, or in the place of one.
    Record(Option<usize>),
    /// Go to a key.
    GoTo(usize),
    /// Play it, or end that.
    Play(bool),
    /// Make it one past the scene's cameras, and play that.
    Tour,
    /// Write it to a file.
    Save,
    /// Read it from a file.
    Load(PathBuf),
    /// Draw its frames, or those of a turn around the scene, and write them.
    Shoot {
        /// Around the scene.
        turns: bool,
    },
    /// Draw no more frames.
    Stop,
}
