//! The scene that a command works on.

use std::path::Path;

use glam::DVec3;
use nephroid::error::{Error, Result, Warning};
use nephroid::optics::LinearSrgb;
use nephroid::scene::{Light, LightKind, Scene, builtin};
use nephroid::units::{Irradiance, LUMENS_PER_WATT};

/// What to do with a scene without light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissingLight {
    /// Refuse, and name the flag that adds one.
    Fail,
    /// Leave it dark.
    Keep,
    /// Add a sun.
    Add,
    /// Add a sun and warn.
    AddAndSay,
}

/// A scene as the user named it.
#[derive(Clone, Debug)]
pub struct SceneInput {
    /// A path, or `builtin:NAME`.
    pub source: String,
    pub missing_light: MissingLight,
    pub solid_glass: bool,
}

/// What built-in scenes are named by.
const BUILTIN_PREFIX: &str = "builtin:";

impl SceneInput {
    /// The scene, with a light where one was missing and is to be added.
    ///
    /// # Errors
    /// A scene that cannot be read, is unknown, or has no light where one is needed.
    pub fn load(&self) -> Result<Scene> {
        let mut scene = match self.source.strip_prefix(BUILTIN_PREFIX) {
            Some(name) => builtin::build(name).ok_or_else(|| self.unknown_builtin())?,
            None => load_gltf(Path::new(&self.source), self.solid_glass)?,
        };
        if scene.lights.is_empty() {
            self.light_up(&mut scene)?;
        }
        Ok(scene)
    }

    fn unknown_builtin(&self) -> Error {
        Error::failure(
            &self.source,
            "there is no built-in scene of this name",
            format!("choose one of {}", builtin::NAMES.join(", ")),
        )
    }

    fn light_up(&self, scene: &mut Scene) -> Result<()> {
        match self.missing_light {
            MissingLight::Keep => {}
            MissingLight::Fail => {
                return Err(Error::failure(
                    &self.source,
                    "the scene has no light",
                    "add one to the file or add a sun with --default-light",
                ));
            }
            MissingLight::Add => scene.lights.push(default_sun()),
            MissingLight::AddAndSay => {
                scene.lights.push(default_sun());
                scene.warnings.push(Warning::new(
                    &self.source,
                    "the scene has no light; a sun was added",
                    "add a light to the file, or --default-light to say that this is meant",
                ));
            }
        }
        Ok(())
    }
}

/// Illuminance of direct sunlight on a clear day [lx].
const SUN_LUX: f64 = 100_000.0;

/// A high sun from the front left.
fn default_sun() -> Light {
    Light {
        name: "default sun".into(),
        colour: LinearSrgb::WHITE,
        kind: LightKind::Sun {
            direction: DVec3::new(0.35, -1.0, -0.45).normalize(),
            normal_irradiance: Irradiance(SUN_LUX / LUMENS_PER_WATT),
        },
    }
}

fn load_gltf(path: &Path, _: bool) -> Result<Scene> {
    Err(Error::failure(
        path.display().to_string(),
        "glTF files cannot be read yet",
        "name a builtin: scene",
    ))
}
