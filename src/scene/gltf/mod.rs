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
mod glow;
pub(super) mod guard;
mod images;
mod light;
mod material;
mod names;
mod nodes;
mod numbers;
mod primitive;
mod rebase;
mod report;
mod shading;
mod sizes;
mod spectrum;
mod substance;
mod surface;
mod triangles;
mod uri;
mod viewpoint;
mod waves;

use std::path::Path;
use std::sync::Arc;

use super::{LoadOptions, Scene};
use crate::error::{Error, Result};
use crate::files;
use report::{Budget, Report};

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
    scene.lights = light::read_all(&document, &placed, folder, &mut report)?;
    area_light::add_all(&mut scene.lights, &document, &placed, folder, &mut report)?;
    glow::add_lights(&mut scene);
    scene.cameras = viewpoint::read_all(&document.root, &placed, &mut report);
    substance::warn_of_ranges(&scene, &mut report);
    rebase::rebase(&mut scene);
    scene.warnings = report.into_warnings();
    Ok(scene)
}
