//! The scene that a command works on.

use std::path::PathBuf;

use nephroid::error::{Error, Result};
use nephroid::scene::{self, LoadOptions, Scene};

/// What to do with a scene without light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissingLight {
    /// Refuse, and name the flag that adds one.
    Fail,
    /// Leave it dark.
    Keep,
    /// Add a sun, with a warning.
    Add,
}

/// A scene as the user named it.
#[derive(Clone, Debug)]
pub struct SceneInput {
    /// A path, or `builtin:NAME`.
    pub source: String,
    pub missing_light: MissingLight,
    pub solid_glass: bool,
    /// Image that lies around the scene.
    pub environment: Option<PathBuf>,
}

impl SceneInput {
    /// How its file is read.
    pub fn load_options(&self) -> LoadOptions {
        LoadOptions {
            solid_glass: self.solid_glass,
            default_light: self.missing_light == MissingLight::Add,
            environment: self.environment.clone(),
            ..LoadOptions::default()
        }
    }

    /// The scene, with a light where one was missing and is to be added.
    ///
    /// # Errors
    /// A scene that cannot be read, is unknown, or has no light where one is needed.
    pub fn load(&self) -> Result<Scene> {
        let scene = scene::load(&self.source, &self.load_options())?;
        if scene.lights.is_empty() && self.missing_light == MissingLight::Fail {
            return Err(Error::failure(
                &self.source,
                "the scene has no light",
                "add one to the file, a sun with --default-light or a sky with --environment",
            ));
        }
        Ok(scene)
    }
}
