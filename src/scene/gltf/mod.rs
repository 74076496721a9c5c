//! Reads glTF 2.0 from untrusted files: every index, count and number is checked before it is used.
//!
//! The `gltf` crate gives the typed JSON; its accessors are not used, since they panic on what its own validation
//! lets pass.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use context::{LoadContext, damaged};
use glam::DAffine3;
use gltf::json::Value;

use super::{LoadOptions, Scene};
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::scene::{Clip, Glow, Light, LightKind, LightSize};
use crate::units::Radiance;

mod accessor;
mod animation;
mod area_light;
mod bodies;
mod buffers;
mod coat;
mod container;
mod context;
mod document;
mod draco;
mod extensions;
mod extras;
mod factors;
mod glb;
mod glossiness;
pub(super) mod guard;
mod images;
mod instancing;
mod light;
mod material;
mod material_textures;
mod meshopt;
mod nodes;
mod pose;
mod primitive;
mod save;
mod spectrum;
mod substance;
mod surface;
mod uri;
mod waves;
mod write;

pub use glb::Glb;
pub(super) use save::save;

/// Reads a `.glb` or `.gltf` file with the buffers and images beside it.
///
/// # Errors
/// Those of [`super::load`].
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

/// Reads a file that is part of the program.
///
/// # Panics
/// Where the file has a fault.
pub(super) fn embedded(bytes: &[u8]) -> Scene {
    let read = read_scene(bytes, Path::new(""), &LoadOptions::default());
    read.unwrap_or_else(|error| panic!("{error}"))
}

/// The file, and all files that its text may refer to: every string in it that names an existing file beside it.
pub(super) fn files_of(path: &Path, most_bytes: u64) -> Vec<PathBuf> {
    let mut found = vec![path.to_path_buf()];
    let folder = path.parent().unwrap_or(Path::new(""));
    let Ok(bytes) = files::read_file(path, most_bytes) else {
        return found;
    };
    let container = container::split(&bytes, &mut LoadContext::default());
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
    // The file itself, its buffers and all that is made of them count against one budget.
    let mut load = LoadContext::new(options.memory_limit_bytes);
    load.take(bytes.len() as u64, "the file")?;
    let container = container::split(bytes, &mut load)?;
    let mut document = document::parse(container.json, &mut load)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let views = document.root.buffer_views.clone();
    let buffers = buffers::Buffers::resolve(
        &document.root.buffers,
        &views,
        container.binary,
        folder,
        &mut load,
    )?;

    // Instances become nodes of their own, so that all else knows only nodes.
    let instanced = instancing::read(&document.root, &buffers, &mut load)?;
    instancing::expand_instances(&mut document, &instanced);

    // Materials precede meshes: only diffuse surfaces keep their colours per vertex.
    let mut images = images::Images::new(&document.root, &buffers, folder);
    let materials = material::read_all(&document, folder, &mut images, &mut load)?;
    let mut materials = surface::Materials::new(materials);
    let placed = nodes::place(&document, &mut load)?;

    // Skins place meshes by the world transforms of other nodes.
    let stands = placed
        .iter()
        .map(|placed| (placed.node, placed.world_from_node))
        .collect();

    let mut scene = Scene::default();
    let reader = accessor::Reader {
        root: &document.root,
        buffers: &buffers,
    };
    surface::add_objects(
        &mut scene,
        primitive::PrimitiveSource {
            reader,
            poses: &document.poses,
            stands: &stands,
        },
        &placed,
        options.solid_glass,
        &mut materials,
        &mut load,
    )?;
    materials.warn_of_thin_walls(options.solid_glass, &mut load);
    scene.materials = materials.into_all();
    scene.textures = images.into_textures().into_iter().map(Arc::new).collect();

    // Lights of nodes come before those of glowing objects: the clip carries the first ones, in this order.
    let lights = light::all(&document, &placed, folder, &mut load)?;
    let light_nodes = lights.iter().map(|(_, origin)| origin.node).collect();
    scene.lights = lights.into_iter().map(|(light, _)| light).collect();
    add_lights(&mut scene);

    // Objects name their node; for lights and cameras the clip lists the nodes that carry them.
    let (cameras, camera_nodes) = nodes::read_all(&document.root, &placed, &mut load);
    scene.cameras = cameras;
    let animations = &document.animations;
    let clip = animations.read(&document, &placed, reader, &mut load);
    scene.clip = clip.map(|clip| {
        Arc::new(Clip {
            light_nodes,
            camera_nodes,
            ..clip
        })
    });

    // Waves lift vertices in the final coordinates of the scene, after the origin of a far one was moved.
    substance::warn_of_ranges(&scene, &mut load);
    rebase(&mut scene);
    waves::displace(&mut scene, &document.extras.nodes, &mut load);
    scene.warnings = load.into_warnings();
    Ok(scene)
}

/// Distance of the centre from the origin, in scene extents, beyond which coordinates would lose precision.
const FAR_IN_EXTENTS: f64 = 16.0;

/// Moves the origin of a far scene to its centre; leaves other scenes alone.
pub fn rebase(scene: &mut Scene) {
    let Some((low, high)) = scene.bounds() else {
        return;
    };
    let centre = 0.5 * (low + high);
    if centre.length() <= FAR_IN_EXTENTS * (high - low).length() {
        return;
    }
    scene.origin_world = centre;
    for object in &mut scene.objects {
        object.place(DAffine3::from_translation(-centre) * *object.world_from_object());
    }
    for light in &mut scene.lights {
        light.kind = light.kind.moved(-centre);
    }
    for material in &mut scene.materials {
        material.waves = material.waves.as_ref().map(|waves| waves.with_origin(centre));
    }
    for camera in &mut scene.cameras {
        camera.position -= centre;
    }
}

/// Adds a light for every object with an emissive material, in object order. Its radiance is the luminance of the
/// emission, its colour has luminance 1, and its spectrum is the material's.
pub fn add_lights(scene: &mut Scene) {
    for object in 0..scene.objects.len() {
        let mesh = scene.objects[object].in_scene();
        let image = scene.material_of(object).emission_texture.as_ref();
        let glow = image.and_then(|image| Glow::new(mesh, image, &scene.textures[image.texture]));
        scene.glows.extend(glow.map(|glow| (object, Arc::new(glow))));
        let emitted = scene.emitted_radiance(object);
        let luminance = emitted.luminance();
        let part = &scene.objects[object];
        if luminance > 0.0 && part.in_scene().area_m2() > 0.0 {
            scene.lights.push(Light {
                name: part.name.clone(),
                colour: emitted / luminance,
                spectrum: scene.material_of(object).emission_spectrum.clone(),
                kind: LightKind::Surface {
                    object,
                    radiance: Radiance(luminance),
                },
                size: LightSize::None,
            });
        }
    }
}

/// A document with all the data it needs.
#[derive(Debug)]
pub struct Opened {
    /// The document with its data.
    pub glb: Glb,
    /// Transform from each node to the world, by glTF index; nodes outside the scene are missing.
    pub world_from_node: BTreeMap<usize, DAffine3>,
    /// Content of the scene that the document cannot hold.
    pub warnings: Vec<Warning>,
}

/// Document of a scene: its file as it is, or a new document for a built-in.
///
/// # Errors
/// A file that can no longer be read, or whose first buffer lies where nothing can be added.
pub fn open(scene: &Scene, most_bytes: u64) -> Result<Opened> {
    if scene.source.starts_with("builtin:") {
        let (glb, warnings) = write::document(scene)?;
        let world_from_node = (0..scene.objects.len())
            .map(|node| (node, DAffine3::IDENTITY))
            .collect();
        return Ok(Opened {
            glb,
            world_from_node,
            warnings,
        });
    }
    let file = File::read(Path::new(&scene.source), most_bytes)?;
    if !file.glb.owns_first_buffer() {
        return Err(damaged(
            &scene.source,
            "has its first buffer within its text, where nothing can be added",
        ));
    }
    let placed = file.placed.into_iter();
    Ok(Opened {
        glb: file.glb,
        world_from_node: placed
            .map(|placed| (placed.node, placed.world_from_node))
            .collect(),
        warnings: Vec::new(),
    })
}

/// A file to be modified: its content as stored and as parsed.
struct File {
    bytes: Vec<u8>,
    is_binary: bool,
    folder: PathBuf,
    glb: Glb,
    document: document::Document,
    placed: Vec<nodes::PlacedNode>,
}

impl File {
    fn read(path: &Path, most_bytes: u64) -> Result<Self> {
        let bytes = files::read_file(path, most_bytes)?;
        let mut load = LoadContext::default();
        let split = container::split(&bytes, &mut load)?;
        let mut document = document::parse(split.json, &mut load)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut glb = Glb::of(&split, &folder, most_bytes)?;
        if instancing::is_used(&document.root) {
            let mut load = LoadContext::new(most_bytes);
            let root = &document.root;
            let (all, views) = (&root.buffers, &root.buffer_views);
            let buffers = buffers::Buffers::resolve(all, views, split.binary, &folder, &mut load)?;
            let instanced = instancing::read(root, &buffers, &mut load)?;
            instancing::expand_instances(&mut document, &instanced);
            glb.expand_instances(&instanced);
        }
        let placed = nodes::place(&document, &mut load)?;
        Ok(Self {
            glb,
            is_binary: split.is_binary,
            bytes,
            folder,
            document,
            placed,
        })
    }
}
