//! glTF 2.0 from a file that is not trusted: every index, count and number is checked before it is used.
//!
//! The `gltf` crate gives the typed JSON; its accessors are not used, since they panic on what its own validation
//! lets pass.

mod accessor;
mod area_light;
mod base64;
mod buffers;
mod coat;
mod container;
mod document;
mod extensions;
mod extras;
mod faults;
mod glb;
mod glow;
pub(super) mod guard;
mod images;
mod light;
mod material;
mod names;
mod nodes;
mod numbers;
mod opened;
mod primitive;
mod rebase;
mod report;
mod save;
mod shading;
mod sizes;
mod spectrum;
mod substance;
mod surface;
mod triangles;
mod uri;
mod viewpoint;
mod waves;
mod write;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use gltf::json::Value;

use super::{LoadOptions, Scene};
use crate::error::{Error, Result};
use crate::files;
pub use glb::Glb;
pub use opened::Opened;
pub(super) use opened::open;
use report::{Budget, Report};
pub(super) use save::save;

/// Reads a `.glb` or `.gltf` file with the buffers and images beside it.
///
/// # Errors
/// As [`super::load`].
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene> {
    let bytes = files::read_file(path, options.memory_limit_bytes)?;
    let in_file = |error: Error| Error {
        location: format!("{}: {}", path.display(), error.location),
        ..error
    };
    let read = || read_scene(&bytes, path, options);
    let mut scene = guard::without_panic(read)
        .unwrap_or_else(|| Err(crashed()))
        .map_err(in_file)?;
    scene.name = path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    scene.source = path.display().to_string();
    Ok(scene)
}

/// The file and those that its text may refer to: every text in it that names a file beside it.
pub(super) fn files_of(path: &Path, most_bytes: u64) -> Vec<PathBuf> {
    let mut found = vec![path.to_path_buf()];
    let folder = path.parent().unwrap_or(Path::new(""));
    let Ok(bytes) = files::read_file(path, most_bytes) else {
        return found;
    };
    let container = container::split(&bytes, &mut Report::default());
    let value = container
        .ok()
        .and_then(|container| serde_json::from_slice(container.json).ok());
    let mut waiting: Vec<Value> = value.into_iter().collect();
    while let Some(value) = waiting.pop() {
        match value {
            Value::Array(items) => waiting.extend(items),
            Value::Object(fields) => waiting.extend(fields.into_iter().map(|(_, value)| value)),
            Value::String(text) => found.extend(uri::file(&text, folder).filter(|file| file.is_file())),
            _ => {}
        }
    }
    found.sort();
    found.dedup();
    found
}

fn crashed() -> Error {
    Error::failure(
        "glTF",
        "its contents cannot be understood",
        "repair it or export it again",
    )
}

fn read_scene(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Scene> {
    let mut report = Report::default();
    let mut budget = Budget::new(options.memory_limit_bytes);
    budget.take(bytes.len() as u64, "the file")?;
    let container = container::split(bytes, &mut report)?;
    let document = document::parse(container.json, &mut report)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let buffers =
        buffers::Buffers::resolve(&document.root, container.binary, folder, &mut budget, &mut report)?;

    let mut images = images::Images::new(&document.root, &buffers, folder);
    let materials = material::read_all(&document, folder, &mut images, &mut budget, &mut report)?;
    let mut materials = surface::Materials::new(materials);
    let placed = nodes::place(&document, &mut report)?;

    let mut scene = Scene::default();
    surface::add_objects(
        &mut scene,
        surface::Source {
            root: &document.root,
            buffers: &buffers,
            placed: &placed,
            solid_glass: options.solid_glass,
        },
        &mut materials,
        &mut budget,
        &mut report,
    )?;
    scene.materials = materials.into_all();
    scene.textures = images.into_textures().into_iter().map(Arc::new).collect();
    let mut lights = light::read_all(&document, &placed, folder, &mut report)?;
    area_light::add_all(&mut lights, &document, &placed, folder, &mut report)?;
    scene.lights = lights.into_iter().map(|(light, _)| light).collect();
    glow::add_lights(&mut scene);
    scene.cameras = viewpoint::read_all(&document.root, &placed, &mut report);
    substance::warn_of_ranges(&scene, &mut report);
    rebase::rebase(&mut scene);
    scene.warnings = report.into_warnings();
    Ok(scene)
}
