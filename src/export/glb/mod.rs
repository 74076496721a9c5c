//! Writes a scene with its illumination maps as one `.glb`: light-map coordinates as TEXCOORD_1 (generated ones
//! included) and the maps as images, for programs that support light maps (MOZ_lightmap), for those that do not
//! (emissive), and for viewing without any lighting (unlit).

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{DEFAULT_CUT, Quantity};
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::illumination::{IlluminationMap, Side};
use crate::scene::{Glb, LoadOptions, Opened, Scene, open_document};
use crate::settings::LayerKind;

mod geometry;
mod images;

/// How materials carry the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Carrier {
    /// MOZ_lightmap: irradiance, which the program multiplies by the albedo.
    LightMap,
    /// Light that the surface reflects, as its emission.
    Emissive,
    /// Light that the surface reflects, as the colour of a KHR_materials_unlit material.
    Unlit,
}

/// What becomes of the scene's own lights. With lights in the file and their direct light in the maps, it would be lit
/// twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SceneLights {
    /// Lights stay; maps hold only the caustic layer, which programs cannot compute.
    Keep,
    /// Lights are removed; maps hold every layer that was baked.
    Remove,
}

/// Bits per channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bits {
    /// What browsers read. Errors are diffused, so that means over some texels are right.
    #[serde(rename = "8")]
    Eight,
    /// Steps of 1/65535, for programs that read all 16 bits.
    #[serde(rename = "16")]
    Sixteen,
}

/// Options of the export.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GlbOptions {
    /// How materials carry the light.
    pub carrier: Carrier,
    /// Meaning of the maps' values. Emission is never E or lux, but either of them divided by π.
    pub quantity: Quantity,
    /// What becomes of the lights.
    pub lights: SceneLights,
    /// Bits per channel.
    pub bits: Bits,
    /// Share of a map's light that may clip in its brightest texels, for finer steps in dim ones, [0, 1).
    pub cut: f64,
    /// Unlit pictures are multiplied by 2 to this power [stops].
    pub exposure_stops: f64,
}

impl Default for GlbOptions {
    /// Light maps in lux, readable by browsers, instead of the scene's lights.
    fn default() -> Self {
        Self {
            carrier: Carrier::LightMap,
            quantity: Quantity::Illuminance,
            lights: SceneLights::Remove,
            bits: Bits::Eight,
            cut: DEFAULT_CUT,
            exposure_stops: 0.0,
        }
    }
}

/// One surface of an exported file.
#[derive(Clone, Debug, Serialize)]
pub struct ExportedMap {
    /// The node's name.
    pub surface: String,
    /// glTF index of the node in the file.
    pub node: usize,
    /// Index of the primitive within the node's mesh.
    pub primitive: usize,
    /// UV set of the map.
    pub tex_coord: usize,
    /// Value of the image's white, in the export's unit.
    pub intensity: f64,
    /// Texels with a channel above white.
    pub cut_texels: usize,
    /// Share of the map's light above white.
    pub cut_share: f64,
    /// Texels with a channel below 0 (colours outside of sRGB), which became 0.
    pub negative_texels: usize,
}

/// Report of an export.
#[derive(Clone, Debug, Serialize)]
pub struct GlbReport {
    /// Size of the file [bytes].
    pub bytes: usize,
    /// Options of the export.
    pub options: GlbOptions,
    /// Unit of the maps' values.
    pub unit: &'static str,
    /// Layers in the maps.
    pub layers: Vec<LayerKind>,
    /// One per surface.
    pub maps: Vec<ExportedMap>,
    /// What the file cannot hold.
    pub warnings: Vec<Warning>,
}

/// Writes a scene with its maps as one self-contained `.glb`.
///
/// # Errors
/// As [`encode`]; a scene whose file cannot be read again; output that cannot be written.
pub fn write(
    scene: &Scene,
    maps: &[IlluminationMap],
    options: GlbOptions,
    path: impl AsRef<Path>,
) -> Result<GlbReport> {
    let opened = open_document(scene, &LoadOptions::default())?;
    let (bytes, report) = encode(scene, opened, maps, options)?;
    files::write_atomically(path.as_ref(), |writer| writer.write_all(&bytes))?;
    Ok(report)
}

/// Encodes a scene with its maps as `.glb`, with a report.
///
/// # Errors
/// Maps without any layer to write; a scene whose file cannot be extended; more than 4 GiB.
pub fn encode(
    scene: &Scene,
    opened: Opened,
    maps: &[IlluminationMap],
    options: GlbOptions,
) -> Result<(Vec<u8>, GlbReport)> {
    // Lamps that stay light the scene by themselves: the maps then hold the caustics alone.
    let layers = layers_of(scene, maps, options)?;
    let Opened {
        mut glb,
        world_from_node,
        warnings,
    } = opened;
    let mut report = GlbReport {
        bytes: 0,
        options,
        unit: options.quantity.unit(),
        layers: layers.clone(),
        maps: Vec::new(),
        warnings,
    };

    // Nodes that share a mesh are lit differently: each gets a mesh of its own, and with it a material.
    let objects = maps.iter().map(|map| &scene.objects[map.chart.object()]);
    glb.push_own_meshes(objects.map(|object| object.node).collect());

    // Every front gets its coordinates and its image; tiles are made dense, since an image has one resolution.
    for map in front_maps(maps, scene, &mut report.warnings) {
        let object = &scene.objects[map.chart.object()];
        let dense = map.dense();
        let world_from_node = world_from_node.get(&object.node);
        let Some(tex_coord) = world_from_node.and_then(|transform| {
            geometry::write(&mut glb, scene, &dense.chart, transform, &mut report.warnings)
        }) else {
            report.warnings.push(Warning::new(
                format!("surface `{}`", object.name),
                "stands at a node that is scaled to nothing; its map was left out",
                "give the node a size",
            ));
            continue;
        };
        let exported = add_map(&mut glb, scene, &dense, &layers, tex_coord, options)?;
        report.maps.push(exported);
    }

    // Lamps whose light is in the maps would shine twice. The file states what its maps hold.
    if options.lights == SceneLights::Remove {
        remove_lights(&mut glb);
    }
    let about = json!({
        "unit": report.unit,
        "layers": report.layers,
        "carrier": options.carrier,
        "lights": options.lights,
    });
    glb.set("/asset/extras/nephroid", about);

    let bytes = glb.into_bytes()?;
    report.bytes = bytes.len();
    Ok((bytes, report))
}

/// The layers to write, in order.
fn layers_of(scene: &Scene, maps: &[IlluminationMap], options: GlbOptions) -> Result<Vec<LayerKind>> {
    let mut kinds: Vec<LayerKind> = maps
        .iter()
        .flat_map(|map| map.layers.iter().map(|layer| layer.kind))
        .collect();
    kinds.sort_unstable();
    kinds.dedup();
    if options.lights == SceneLights::Keep {
        kinds.retain(|kind| *kind == LayerKind::Caustic);
    }
    if kinds.is_empty() {
        return Err(Error::failure(
            &scene.source,
            "has no maps with light that its own lights do not give",
            "bake its caustic layer, or let its lights be removed (--lights remove)",
        ));
    }
    Ok(kinds)
}

/// The maps that materials can carry, those of front sides; warns about the others.
fn front_maps<'a>(
    maps: &'a [IlluminationMap],
    scene: &Scene,
    warnings: &mut Vec<Warning>,
) -> Vec<&'a IlluminationMap> {
    let (front, back): (Vec<_>, Vec<_>) = maps
        .iter()
        .partition(|map| map.chart.receiver.side() == Side::Front);
    for map in back {
        warnings.push(Warning::new(
            format!("surface `{}`", scene.objects[map.chart.object()].name),
            "has light on its back too, which a glTF material cannot carry; it was left out",
            "give the surface a thickness",
        ));
    }
    front
}

fn add_map(
    glb: &mut Glb,
    scene: &Scene,
    map: &IlluminationMap,
    layers: &[LayerKind],
    tex_coord: usize,
    options: GlbOptions,
) -> Result<ExportedMap> {
    let object = &scene.objects[map.chart.object()];
    let mut exported = ExportedMap {
        surface: object.name.clone(),
        node: object.node,
        primitive: object.primitive,
        tex_coord,
        intensity: 1.0,
        cut_texels: 0,
        cut_share: 0.0,
        negative_texels: 0,
    };

    // The image holds the light relative to its white, which becomes the intensity of the material.
    let light = images::light_of(map, layers, scene, options);
    let png = images::encode(&light, (map.width(), map.height()), options, &mut exported)?;
    let image_index = glb.push_png(&format!("{} light", object.name), &png);

    // Linear without mip levels and clamped: charts lie close, and smaller levels would mix them.
    let sampler = glb.push(
        "/samplers",
        json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 }),
    );
    let texture = glb.push("/textures", json!({ "source": image_index, "sampler": sampler }));
    let texture = json!({ "index": texture, "texCoord": tex_coord });
    give(
        glb,
        (object.node, object.primitive),
        texture,
        exported.intensity,
        options,
    );
    Ok(exported)
}

impl Glb {
    /// Gives each of these nodes a mesh of its own if others share it, because their light differs.
    fn push_own_meshes(&mut self, nodes: BTreeSet<usize>) {
        let mut users: BTreeMap<u64, usize> = BTreeMap::new();
        for node in self.json["nodes"].as_array().into_iter().flatten() {
            if let Some(mesh) = node["mesh"].as_u64() {
                *users.entry(mesh).or_default() += 1;
            }
        }
        for node in nodes {
            let Some(mesh) = self.json["nodes"][node]["mesh"].as_u64() else {
                continue;
            };
            let count = users.entry(mesh).or_default();
            if *count > 1 {
                *count -= 1;
                let copy = self.json["meshes"][mesh as usize].clone();
                let copy = self.push("/meshes", copy);
                self.json["nodes"][node]["mesh"] = json!(copy);
            }
        }
    }

    /// A primitive of a node's mesh.
    fn primitive(&mut self, (node, primitive): (usize, usize)) -> &mut Value {
        let mesh = self.json["nodes"][node]["mesh"].as_u64().unwrap_or(0);
        &mut self.json["meshes"][mesh as usize]["primitives"][primitive]
    }
}

const LISTS: [&str; 2] = ["KHR_lights_punctual", "EXT_lights_area"];

/// Removes all lights at nodes, and their lists. Emissive surfaces stay, because they are visible.
fn remove_lights(glb: &mut Glb) {
    let nodes = glb.json["nodes"].as_array().map_or(0, Vec::len);
    let nodes = (0..nodes).map(|node| format!("/nodes/{node}/extensions"));
    for extensions in nodes.chain(["/extensions".into()]) {
        for list in LISTS {
            glb.remove(&format!("{extensions}/{list}"));
        }
        remove_empty(glb, &extensions);
    }
    for list in ["/extensionsUsed", "/extensionsRequired"] {
        if let Some(Value::Array(names)) = glb.json.pointer_mut(list) {
            names.retain(|name| !LISTS.iter().any(|list| name == list));
        }
        remove_empty(glb, list);
    }
}

/// Removes an empty list or object, which glTF does not allow.
fn remove_empty(glb: &mut Glb, pointer: &str) {
    let found = glb.json.pointer(pointer);
    if found.is_some_and(|found| *found == json!({}) || *found == json!([])) {
        glb.remove(pointer);
    }
}

const LIGHT_MAP: &str = "MOZ_lightmap";
const STRENGTH: &str = "KHR_materials_emissive_strength";
const UNLIT: &str = "KHR_materials_unlit";

/// Gives a primitive a material of its own that carries the light of a texture. Colours and textures of its old
/// material stay, unless they are part of the texture. `intensity`: value of the texture's white, in the export's unit.
fn give(glb: &mut Glb, place: (usize, usize), mut texture: Value, intensity: f64, options: GlbOptions) {
    // The old material is copied: primitives without a map keep it.
    let index = glb.primitive(place)["material"].as_u64();
    let mut material = index.map_or(json!({}), |index| glb.json["materials"][index as usize].clone());
    if let Some(name) = material["name"].as_str() {
        material["name"] = json!(format!("{name}, lit"));
    }

    let black = json!([0.0, 0.0, 0.0, 1.0]);
    match options.carrier {
        Carrier::LightMap => {
            texture["intensity"] = json!(intensity);
            material["extensions"][LIGHT_MAP] = texture;
        }
        Carrier::Emissive => {
            material["emissiveTexture"] = texture;
            material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
            material["extensions"][STRENGTH] = json!({ "emissiveStrength": intensity });
            if options.lights == SceneLights::Remove {
                // Lamps that a program adds would light the surface twice.
                material["pbrMetallicRoughness"] =
                    json!({ "baseColorFactor": black, "metallicFactor": 0.0, "roughnessFactor": 1.0 });
            }
        }
        Carrier::Unlit => {
            material["pbrMetallicRoughness"] =
                json!({ "baseColorTexture": texture, "metallicFactor": 0.0, "roughnessFactor": 1.0 });
            material["extensions"] = json!({ UNLIT: {} });
            // Vertex colours are part of the texture already.
            if let Some(attributes) = glb.primitive(place)["attributes"].as_object_mut() {
                attributes.shift_remove("COLOR_0");
            }
        }
    }

    let material = glb.push("/materials", material);
    glb.primitive(place)["material"] = json!(material);
}
