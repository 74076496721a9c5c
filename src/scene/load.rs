//! A scene from what the user named: a file or a built-in.

use std::path::Path;

use glam::DVec3;

use super::{Light, LightKind, Scene, builtin, gltf};
use crate::error::{Error, Result, Warning};
use crate::optics::LinearSrgb;
use crate::units::Irradiance;

/// How a scene is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Reads transmitting surfaces without a volume as solid glass where their mesh is closed.
    pub solid_glass: bool,
    /// Adds a sun to a scene that has no light, with a warning.
    pub default_light: bool,
    /// The most memory that the file, its geometry and its images may take together [bytes].
    pub memory_limit_bytes: u64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            solid_glass: false,
            default_light: false,
            memory_limit_bytes: 8 << 30,
        }
    }
}

/// Reads `builtin:NAME` or a `.glb` or `.gltf` file. What was repaired or left out stands in `Scene::warnings`.
///
/// # Errors
/// An unknown built-in; a file that cannot be read, is no glTF 2.0, breaks its rules where no repair is plain, requires
/// an extension that is not supported, or does not fit the memory limit.
pub fn load(source: &str, options: &LoadOptions) -> Result<Scene> {
    let mut scene = match source.strip_prefix("builtin:") {
        Some(name) => builtin::build(name).ok_or_else(|| unknown_builtin(source))?,
        None => gltf::load(Path::new(source), options)?,
    };
    if options.default_light && scene.lights.is_empty() {
        add_default_light(&mut scene);
    }
    Ok(scene)
}

fn unknown_builtin(source: &str) -> Error {
    Error::failure(
        source,
        "there is no such built-in scene",
        format!("choose one of {}", builtin::NAMES.join(", ")),
    )
}

/// A grey floor then sends a radiance of about 0.5 W/(m² sr): neither dark nor overexposed at exposure 0.
const DEFAULT_SUN: Irradiance = Irradiance(4.0);

fn add_default_light(scene: &mut Scene) {
    scene.lights.push(Light {
        name: "default sun".into(),
        colour: LinearSrgb::WHITE,
        kind: LightKind::Sun {
            direction: DVec3::new(0.4, -0.8, -0.45).normalize(),
            normal_irradiance: DEFAULT_SUN,
        },
        size: crate::scene::LightSize::None,
    });
    scene.warnings.push(Warning::new(
        scene.source.clone(),
        format!(
            "the scene has no light, so a sun of {} W/m² was added, called `default sun`",
            DEFAULT_SUN.0
        ),
        "add a light to the scene to choose your own",
    ));
}
