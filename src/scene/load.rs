//! Loads a scene from a file or a built-in name.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::{Light, LightKind, Opened, Scene, builtin, contacts, dark, environment, gltf};
use crate::error::{Error, Result, Warning};
use crate::units::Irradiance;

/// Options for loading a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadOptions {
    /// Reads transmissive surfaces without a volume as solid glass if their mesh encloses space.
    pub solid_glass: bool,
    /// Adds a sun and a clear sky to a scene without light, with a warning.
    pub default_light: bool,
    /// Equirectangular image of radiance, .hdr or .exr, that surrounds and lights the scene.
    pub environment: Option<PathBuf>,
    /// Memory limit of the file, its geometry and its images together, and of the environment by itself [bytes].
    pub memory_limit_bytes: u64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            solid_glass: true,
            default_light: false,
            environment: None,
            memory_limit_bytes: 8 << 30,
        }
    }
}

impl Scene {
    /// Reads `builtin:NAME` or a `.glb` or `.gltf` file. Repairs and omissions are listed in `warnings`.
    ///
    /// # Errors
    /// An unknown built-in; a file that cannot be read, is not glTF 2.0, breaks its rules beyond obvious repair,
    /// requires an unsupported extension, or exceeds the memory limit; an environment that [`environment::read`]
    /// refuses.
    pub fn load(source: &str, options: &LoadOptions) -> Result<Self> {
        let mut scene = match source.strip_prefix("builtin:") {
            Some(name) => builtin::build(name).ok_or_else(|| unknown_builtin(source))?,
            None => load_file(source, options)?,
        };
        if let Some(path) = &options.environment {
            add_environment(&mut scene, path, options.memory_limit_bytes)?;
        }
        let dark = dark::warnings(&scene);
        scene.warnings.extend(dark);
        if options.default_light && scene.lights.is_empty() {
            add_default_light(&mut scene);
        }
        Ok(scene)
    }
}

/// Writes an edited scene as a `.glb`: its source file with only the edits applied, so that content unknown to the
/// program survives.
///
/// # Errors
/// A built-in scene, which has no file; a file that changed since it was loaded; an edit that no file can hold, such as
/// another shape, the brightness of an environment, or a glass without a name; a target that cannot be written.
pub fn save(target: &Path, loaded: &Scene, edited: &Scene, options: &LoadOptions) -> Result<()> {
    if loaded.source.starts_with("builtin:") {
        return Err(Error::failure(
            &loaded.source,
            "is built in and has no file that could be changed",
            "its edits are kept by the program; open a .glb or .gltf file to save one",
        ));
    }
    gltf::save(Path::new(&loaded.source), target, loaded, edited, options)
}

/// Document of a scene, to be modified and written elsewhere: its file with everything stored beside it or, for a
/// built-in, a document made for it, in which node `i` is object `i`.
///
/// # Errors
/// A file that can no longer be read, or to which nothing can be added.
pub fn open_document(scene: &Scene, options: &LoadOptions) -> Result<Opened> {
    gltf::open(scene, options.memory_limit_bytes)
}

/// Files that a scene is read from: the file itself and those it refers to, as far as these can be determined; none for
/// a built-in.
pub fn files_of(source: &str, options: &LoadOptions) -> Vec<PathBuf> {
    if source.starts_with("builtin:") {
        return Vec::new();
    }
    let mut files = gltf::files_of(Path::new(source), options.memory_limit_bytes);
    files.extend(options.environment.clone());
    files
}

/// Replaces meshes and images of a reloaded scene by equal ones of the previous scene, so that data derived from those
/// stay valid. Returns whether all objects have kept their shape.
pub fn share(before: &Scene, now: &mut Scene) -> bool {
    let mut is_same = before.objects.len() == now.objects.len();
    for (was, is) in before.objects.iter().zip(&mut now.objects) {
        let stands_alike = was.world_from_object() == is.world_from_object() && was.mesh() == is.mesh();
        if stands_alike || was.copy_in_scene() == is.copy_in_scene() {
            is.share(was);
        } else {
            is_same = false;
        }
    }
    for (was, is) in before.textures.iter().zip(&mut now.textures) {
        if was == is {
            *is = Arc::clone(was);
        }
    }
    is_same
}

/// Reads a file. Only there do surfaces meet without an order: those of built-in scenes are placed to have one.
fn load_file(source: &str, options: &LoadOptions) -> Result<Scene> {
    let mut scene = gltf::load(Path::new(source), options)?;
    let covering = contacts::set_apart(&mut scene, None);
    scene.warnings.extend(covering);
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
        scene
            .lights
            .push(Light::new("environment", LightKind::Environment { scale: 1.0 }));
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

/// Under both, a grey floor has a radiance of about 0.5 W/(m² sr): neither dark nor overexposed at exposure 0.
const DEFAULT_SUN: Irradiance = Irradiance(4.0);
/// Irradiance of level ground from the sky: a sixth of the sun's, as on a clear day.
const DEFAULT_SKY: Irradiance = Irradiance(DEFAULT_SUN.0 / 6.0);

/// Name of the sun that is added to scenes without light.
const DEFAULT_SUN_NAME: &str = "default sun";

/// Largest number of images that a warning suggests.
const MAX_BESIDE: usize = 3;

/// Whether a scene, as loaded, had no light of its own and was given a sun.
pub fn was_dark(loaded: &Scene) -> bool {
    loaded.lights.iter().any(|light| light.name == DEFAULT_SUN_NAME)
}

/// Adds a sun and, without an environment, a clear sky.
fn add_default_light(scene: &mut Scene) {
    let direction = DVec3::new(0.4, -0.8, -0.45).normalize();
    let normal_irradiance = DEFAULT_SUN;
    let sun = LightKind::Sun {
        direction,
        normal_irradiance,
    };
    scene.lights.push(Light::new(DEFAULT_SUN_NAME, sun));
    let mut added = format!(
        "a sun of {} W/m² was added, called `{DEFAULT_SUN_NAME}`",
        DEFAULT_SUN.0
    );
    if scene.environment.is_none() {
        let sky = environment::clear_sky(-direction, DEFAULT_SUN.0, DEFAULT_SKY.0);
        scene.environment = sky.map(Arc::new);
        let sky = LightKind::Environment { scale: 1.0 };
        scene.lights.push(Light::new("default sky", sky));
        added += ", and a clear sky, called `default sky`";
    }
    scene.warnings.push(Warning::new(
        scene.source.clone(),
        format!("the scene has no light, so {added}"),
        match &skies_beside(&scene.source)[..] {
            [] => "add a light to the scene, or surround it by an image with --environment".to_owned(),
            skies => format!("light it by an image that lies beside it: {}", skies.join(" or ")),
        },
    ));
}

/// Command-line options that surround a scene with the images beside its file.
pub fn skies_beside(source: &str) -> Vec<String> {
    let folder = Path::new(source)
        .parent()
        .filter(|_| !source.starts_with("builtin:"));
    let folder = folder.map(|folder| folder.join("."));
    let entries = folder.and_then(|folder| folder.read_dir().ok());
    let paths = entries.into_iter().flatten().flatten().map(|entry| entry.path());
    let is_sky = |path: &PathBuf| {
        path.extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("hdr"))
    };
    let mut skies: Vec<PathBuf> = paths.filter(is_sky).collect();
    skies.sort();
    let named = skies.iter().take(MAX_BESIDE).filter_map(|path| {
        let path = Path::new(source).with_file_name(path.file_name()?);
        Some(format!("--environment {}", path.display()))
    });
    named.collect()
}
