//! A scene from what the user named: a file or a built-in.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::{Light, LightKind, LightSize, Scene, builtin, contact, environment, gltf};
use crate::error::{Error, Result, Warning};
use crate::optics::LinearSrgb;
use crate::units::Irradiance;

/// How a scene is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Reads transmitting surfaces without a volume as solid glass where their mesh is closed.
    pub solid_glass: bool,
    /// Adds a sun to a scene that has no light, with a warning.
    pub default_light: bool,
    /// An equirectangular image of radiance, .hdr or .exr, that lies around the scene and lights it.
    pub environment: Option<PathBuf>,
    /// The most memory that the file, its geometry and its images may take together, and the environment by itself
    /// [bytes].
    pub memory_limit_bytes: u64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            solid_glass: false,
            default_light: false,
            environment: None,
            memory_limit_bytes: 8 << 30,
        }
    }
}

/// Reads `builtin:NAME` or a `.glb` or `.gltf` file. What was repaired or left out stands in `Scene::warnings`.
///
/// # Errors
/// An unknown built-in; a file that cannot be read, is no glTF 2.0, breaks its rules where no repair is plain, requires
/// an extension that is not supported, or does not fit the memory limit. An environment as [`environment::read`].
pub fn load(source: &str, options: &LoadOptions) -> Result<Scene> {
    let mut scene = match source.strip_prefix("builtin:") {
        Some(name) => builtin::build(name).ok_or_else(|| unknown_builtin(source))?,
        None => gltf::load(Path::new(source), options)?,
    };
    if let Some(path) = &options.environment {
        add_environment(&mut scene, path, options.memory_limit_bytes)?;
    }
    let touching = contact::warnings(&scene);
    scene.warnings.extend(touching);
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

fn add_environment(scene: &mut Scene, path: &Path, memory_limit_bytes: u64) -> Result<()> {
    let environment = environment::read(path, memory_limit_bytes)?;
    if environment.total_w_per_m2() > 0.0 {
        scene.lights.push(Light {
            name: "environment".into(),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind: LightKind::Environment { scale: 1.0 },
            size: LightSize::None,
        });
    } else {
        scene.warnings.push(Warning::new(
            path.display().to_string(),
            "the environment is black, so that it gives no light",
            "use another image to light the scene",
        ));
    }
    scene.environment = Some(Arc::new(environment));
    Ok(())
}

/// A grey floor then sends a radiance of about 0.5 W/(m² sr): neither dark nor overexposed at exposure 0.
const DEFAULT_SUN: Irradiance = Irradiance(4.0);

fn add_default_light(scene: &mut Scene) {
    scene.lights.push(Light {
        name: "default sun".into(),
        colour: LinearSrgb::WHITE,
        spectrum: None,
        kind: LightKind::Sun {
            direction: DVec3::new(0.4, -0.8, -0.45).normalize(),
            normal_irradiance: DEFAULT_SUN,
        },
        size: LightSize::None,
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
