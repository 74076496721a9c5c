//! The JSON of a file as typed data, without the parts that are not read. Violations of the specification are reported
//! as warnings; those that affect what is read stop the loading where the faulty part is needed.

use std::fmt::Display;

use gltf::json::path::Path;
use gltf::json::validation::{Error as Fault, Validate};
use gltf::json::{Root, Value};
use serde::Deserialize;
use serde_json::Map;

use super::animation::Animations;
use super::context::LoadContext;
use super::extras::Extras;
use super::pose::Poses;
use super::{extensions, extras, glossiness, guard};
use crate::error::{Error, Result};

/// The typed JSON, with node transforms in double precision.
#[derive(Debug)]
pub struct Document {
    pub root: Root,
    /// One per node.
    pub transforms: Vec<NodeTransform>,
    pub extras: Extras,
    /// Morph targets and skins.
    pub poses: Poses,
    pub animations: Animations,
}

/// A node's local transform as stated in the file, unchecked.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct NodeTransform {
    /// Column-major.
    pub matrix: Option<[f64; 16]>,
    /// [m].
    pub translation: Option<[f64; 3]>,
    /// Quaternion x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

/// Reads the JSON text.
///
/// # Errors
/// Text that is not JSON, another version than glTF 2, an unsupported required extension, a value of the wrong type.
pub fn parse(json: &[u8], load: &mut LoadContext) -> Result<Document> {
    let mut value: Value = serde_json::from_slice(json).map_err(|error| broken_json(json, &error))?;
    let Some(file) = value.as_object_mut() else {
        return Err(unlike_gltf("its JSON is not an object"));
    };
    check_version(file, load)?;
    let required = strings(file, "extensionsRequired")?;
    extensions::check(&required, &strings(file, "extensionsUsed")?, load)?;
    let poses = Poses::of(file);
    let animations = Animations::of(file);
    prepare(file, load);
    make_glass_clear(file, load);
    let extras = Extras::of(&value);
    remove_extras(&mut value);

    let transforms = match value.get("nodes") {
        Some(nodes) => Vec::deserialize(nodes).map_err(unlike_gltf)?,
        None => Vec::new(),
    };
    let root: Root = serde_json::from_value(value).map_err(unlike_gltf)?;
    warn_of_faults(&root, load);
    Ok(Document {
        root,
        transforms,
        extras,
        poses,
        animations,
    })
}

fn broken_json(json: &[u8], error: &serde_json::Error) -> Error {
    match json.trim_ascii_start() {
        [b'{', ..] => Error::failure("JSON", format!("is broken ({error})"), REPAIR),
        _ => {
            let what = format!("this is not a glTF file ({error})");
            Error::failure("JSON", what, "name a .glb or .gltf file")
        }
    }
}

const REPAIR: &str = "repair it or export it again";

fn unlike_gltf(why: impl Display) -> Error {
    Error::failure("JSON", format!("does not follow glTF 2.0 ({why})"), REPAIR)
}

fn check_version(file: &Map<String, Value>, load: &mut LoadContext) -> Result<()> {
    let asset = file.get("asset");
    let text = |key: &str| asset.and_then(|asset| asset.get(key)).and_then(Value::as_str);
    let Some(version) = text("version") else {
        return Err(unlike_gltf("it states no version in `asset`"));
    };
    let parts = |version: &str| {
        let (major, minor) = version.split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    let needed = text("minVersion").unwrap_or(version);
    match (parts(version), parts(needed)) {
        (Some((2, minor)), Some((2, needed_minor))) if text("minVersion").is_none() || needed_minor == 0 => {
            if minor > 0 {
                load.warn(
                    "asset",
                    format!("is of version 2.{minor}, read as 2.0"),
                    "check the picture",
                );
            }
            Ok(())
        }
        _ => Err(Error::failure(
            "asset",
            "is not of glTF version 2.0",
            "export the scene as glTF 2.0",
        )),
    }
}

fn strings(file: &Map<String, Value>, key: &str) -> Result<Vec<String>> {
    match file.get(key) {
        None => Ok(Vec::new()),
        Some(list) => {
            Vec::deserialize(list).map_err(|_| unlike_gltf(format!("`{key}` is not a list of names")))
        }
    }
}

/// Removes animations, skins and morph targets, so that faults in them cannot stop a scene; converts outdated
/// materials; and adds fields that the typed reader requires although glTF does not.
fn prepare(file: &mut Map<String, Value>, load: &mut LoadContext) {
    // The typed reader knows metallic-roughness alone.
    for (index, material) in objects(file.get_mut("materials")).enumerate() {
        let owner = owner(material, index);
        glossiness::convert(material, &owner, load);
    }

    // These parts have been read by themselves; the typed reader would refuse the whole file for one fault in them.
    file.remove("animations");
    let mut is_bent = file.remove("skins").is_some();
    for node in objects(file.get_mut("nodes")) {
        is_bent |= node.remove("skin").is_some();
        node.remove("weights");
    }
    for mesh in objects(file.get_mut("meshes")) {
        mesh.remove("weights");
        for primitive in objects(mesh.get_mut("primitives")) {
            is_bent |= primitive.remove("targets").is_some();
        }
    }
    if is_bent {
        load.warn(
            "skins and morph targets",
            "are read at rest",
            "pose the scene where it was made",
        );
    }

    // Every scene must have a list of nodes for the typed reader. Extensions of lights it keeps as raw text, which a
    // parsed value cannot give.
    name_variants(file, load);
    for scene in objects(file.get_mut("scenes")) {
        scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    let lights = file
        .get_mut("extensions")
        .and_then(|extensions| extensions.get_mut("KHR_lights_punctual"))
        .and_then(|punctual| punctual.get_mut("lights"));
    for light in objects(lights) {
        light.remove("extensions");
    }
}

fn name_variants(file: &Map<String, Value>, load: &mut LoadContext) {
    let extensions = file.get("extensions");
    let stated = extensions.and_then(|all| all.get(extensions::VARIANTS)?.get("variants")?.as_array());
    let variants = stated.into_iter().flatten().enumerate();
    let name = |(index, variant): (usize, &Value)| {
        extras::name(variant.get("name").and_then(Value::as_str), "variant", index)
    };
    let names: Vec<String> = variants.map(name).collect();
    if !names.is_empty() {
        load.warn(
            "materials",
            format!("have variants, which are left out ({})", names.join(", ")),
            "the default materials were read",
        );
    }
}

/// Reads a transmissive material without a metallic factor as a dielectric: glTF's default, metal, would block all
/// light.
fn make_glass_clear(file: &mut Map<String, Value>, load: &mut LoadContext) {
    for (index, material) in objects(file.get_mut("materials")).enumerate() {
        let extensions = material.get("extensions");
        let transmission = extensions.and_then(|all| all.get("KHR_materials_transmission"));
        let factor = transmission.and_then(|stated| stated.get("transmissionFactor"));
        let states = |pbr: &Map<String, Value>| {
            pbr.contains_key("metallicFactor") || pbr.contains_key("metallicRoughnessTexture")
        };
        let pbr = material.get("pbrMetallicRoughness").and_then(Value::as_object);
        if factor.and_then(Value::as_f64).is_none_or(|factor| factor <= 0.0) || pbr.is_some_and(states) {
            continue;
        }
        let owner = owner(material, index);
        let pbr = material
            .entry("pbrMetallicRoughness")
            .or_insert_with(|| Value::Object(Map::new()));
        if let Some(pbr) = pbr.as_object_mut() {
            pbr.insert("metallicFactor".into(), Value::from(0.0));
            load.warn(
                owner,
                "transmits light and states no metallic factor; it was read as glass",
                "state a metallic factor of 0",
            );
        }
    }
}

fn owner(material: &Map<String, Value>, index: usize) -> String {
    let name = material.get("name").and_then(Value::as_str);
    format!("material `{}`", extras::name(name, "material", index))
}

fn objects(list: Option<&mut Value>) -> impl Iterator<Item = &mut Map<String, Value>> {
    let items = list.and_then(Value::as_array_mut).map(|items| items.iter_mut());
    items.into_iter().flatten().filter_map(Value::as_object_mut)
}

/// Removes application data at any depth: they have been read already, and the typed reader does not accept raw text
/// everywhere.
fn remove_extras(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(remove_extras),
        Value::Object(fields) => {
            fields.remove("extras");
            fields.values_mut().for_each(remove_extras);
        }
        _ => {}
    }
}

/// Reports violations in the typed JSON.
fn warn_of_faults(root: &Root, load: &mut LoadContext) {
    let mut found = Vec::new();
    // Validation panics on some broken references.
    let finished = guard::without_panic(|| {
        root.validate(root, Path::new, &mut |path, error| {
            found.push((path().to_string(), error))
        });
    });
    for (path, error) in found {
        // Extensions have been checked already, against those that this program reads.
        if path.starts_with("extensionsRequired") {
            continue;
        }
        // Accessors may lack a buffer view (all zero), and textures a plain image (WebP).
        let may_miss = path.ends_with("bufferView") || path.ends_with("source");
        // Bounds are computed, whatever the file states.
        let unread = path.ends_with(".min") || path.ends_with(".max");
        if unread || error == Fault::Missing && may_miss {
            continue;
        }
        let what = match error {
            Fault::IndexOutOfBounds => "refers to something that does not exist",
            Fault::Invalid => "has a value that glTF does not allow",
            Fault::Missing => "is missing",
            Fault::Oversize => "is too large",
            Fault::Unsupported => "is not supported",
        };
        load.warn_damaged(path, what);
    }
    if finished.is_none() {
        load.warn_damaged("JSON", "has references that lead nowhere");
    }
}
