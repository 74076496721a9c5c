//! A scene with its maps as one `.glb`, taken apart by hand.

use std::f64::consts::FRAC_1_PI;

use nephroid::error::Result;
use nephroid::export::glb::{self, Bits, Carrier, GlbOptions, GlbReport, SceneLights};
use nephroid::export::map_set::MapSet;
use nephroid::export::{Quantity, uv_file};
use nephroid::scene::open_document;

use super::{Baked, LUMENS_PER_WATT, boxes, linear_of_srgb};
use crate::prelude::*;
use support::glb::{assembled, load_bytes, load_path, parts_of};

const LAYERS: [LayerKind; 2] = [LayerKind::Caustic, LayerKind::Direct];

/// Light maps of 16 bits with the scene's lights beside them; nothing is cut.
const WHOLE: GlbOptions = GlbOptions {
    carrier: Carrier::LightMap,
    quantity: Quantity::Illuminance,
    lights: SceneLights::Keep,
    bits: Bits::Sixteen,
    cut: 0.0,
    exposure_stops: 0.0,
};

fn encode(baked: &Baked, options: GlbOptions) -> Result<(Vec<u8>, GlbReport)> {
    let scene = &baked.scene;
    let maps = MapSet::open(baked.path("out"), scene)?.read_all()?;
    let opened = open_document(scene, &LoadOptions::default())?;
    glb::encode(scene, opened, &maps, options)
}

fn export(baked: &Baked, options: GlbOptions) -> (Exported, GlbReport) {
    let (bytes, report) = encode(baked, options).expect("it fits");
    (Exported::new(bytes), report)
}

struct Exported {
    json: Value,
    binary: Vec<u8>,
    scene: Scene,
}

impl Exported {
    fn new(bytes: Vec<u8>) -> Self {
        let (text, binary) = parts_of(&bytes).expect("it is whole");
        assert_eq!(assembled(text.to_vec(), binary.to_vec()), bytes);
        let json: Value = serde_json::from_slice(text).expect("it is JSON");
        let mut binary = binary.to_vec();
        let stated = json["buffers"][0]["byteLength"].as_u64().expect("a length") as usize;
        assert_eq!(stated.next_multiple_of(4), binary.len());
        binary.truncate(stated);
        let scene = load_bytes(&bytes, &LoadOptions::default()).expect("we read it ourselves");
        Self { json, binary, scene }
    }

    fn item(&self, list: &str, index: &Value) -> &Value {
        &self.json[list][index.as_u64().expect("an index") as usize]
    }

    fn view(&self, index: &Value) -> &[u8] {
        let view = self.item("bufferViews", index);
        let number = |name: &str| view[name].as_u64().unwrap_or(0) as usize;
        &self.binary[number("byteOffset")..number("byteOffset") + number("byteLength")]
    }

    fn floats(&self, accessor: &Value) -> Vec<f64> {
        let accessor = self.item("accessors", accessor);
        assert_eq!(accessor["componentType"], 5126);
        let words = self.view(&accessor["bufferView"]).as_chunks::<4>().0.iter();
        words.map(|word| f64::from(f32::from_le_bytes(*word))).collect()
    }

    fn primitive(&self, node: usize) -> &Value {
        &self.item("meshes", &self.json["nodes"][node]["mesh"])["primitives"][0]
    }

    fn material(&self, node: usize) -> &Value {
        self.item("materials", &self.primitive(node)["material"])
    }

    /// Texels and white of a node's light map.
    fn light_map(&self, node: usize) -> (Vec<[f64; 3]>, f64) {
        let texture = &self.material(node)["extensions"]["MOZ_lightmap"];
        let white = texture["intensity"].as_f64().expect("a number");
        (self.image(texture), white)
    }

    /// The texels of an image that a texture names [0, 1]; codes of eight bits are 257 times smaller.
    fn image(&self, texture: &Value) -> Vec<[f64; 3]> {
        let texture = self.item("textures", &texture["index"]);
        assert_eq!(
            self.item("samplers", &texture["sampler"])["wrapS"],
            33071,
            "clamped"
        );
        let image = self.item("images", &texture["source"]);
        let png = image::load_from_memory(self.view(&image["bufferView"])).expect("it is a PNG");
        let pixels = png.to_rgb16();
        pixels.pixels().map(|pixel| pixel.0.map(linear_of_srgb)).collect()
    }
}

#[test]
fn light_maps_hold_light_in_the_unit_asked() {
    let baked = Baked::quick(built_in("ring"), &[LayerKind::Caustic]);
    let light = baked.light("caustic");
    for (quantity, factor, cut) in [
        (Quantity::Irradiance, 1.0, 0.005),
        (Quantity::Illuminance, LUMENS_PER_WATT, 0.005),
        (Quantity::IrradianceByPi, FRAC_1_PI, 0.005),
        (Quantity::Irradiance, 1.0, 0.0),
    ] {
        let options = with(WHOLE, |it| (it.quantity, it.cut) = (quantity, cut));
        let (exported, report) = export(&baked, options);
        let used = exported.json["extensionsUsed"].as_array().expect("a list");
        assert!(used.contains(&json!("MOZ_lightmap")));
        let (texels, white) = exported.light_map(report.maps[0].node);
        let (mut lost, mut all) = (0.0, 0.0);
        for (value, wanted) in texels.as_flattened().iter().zip(light.as_flattened()) {
            let wanted = f64::from(*wanted) * factor;
            all += wanted.max(0.0);
            lost += (wanted - white).max(0.0);
            // A step of the code at most, whose width in linear light is largest at white: 2.3/65535.
            let off = (value * white - wanted.clamp(0.0, white)).abs();
            assert!(off <= white * 2e-5, "{quantity:?}: {value} {wanted}");
        }
        assert!(lost / all <= cut * (1.0 + 1e-9), "{}", lost / all);
        assert_close(report.maps[0].cut_share, lost / all, 1e-4, "share that is told");
        assert_eq!(report.maps[0].cut_texels == 0, cut == 0.0);
    }
}

#[test]
fn a_scene_is_lit_by_its_lights_or_its_maps() {
    let baked = Baked::quick(built_in("ball"), &LAYERS);
    let kept = with(WHOLE, |it| (it.bits, it.cut) = (Bits::Eight, 0.005));
    let removed = with(kept, |it| it.lights = SceneLights::Remove);
    let (exported, report) = export(&baked, removed);
    assert_eq!(report.layers, LAYERS);
    assert!(exported.scene.lights.is_empty());
    assert_eq!(exported.json.get("extensions"), None, "no list of lights is left");
    let (texels, white) = exported.light_map(0);
    let watts = texels.iter().map(|texel| texel[1] * white / LUMENS_PER_WATT);
    let total = baked.light("").iter().map(|texel| f64::from(texel[1])).sum();
    assert_close(watts.sum(), total, 0.006, "all light, in eight bits");

    let (exported, report) = export(&baked, kept);
    assert_eq!(report.layers, [LayerKind::Caustic], "what the lights do not give");
    assert_eq!(exported.scene.lights.len(), 1);
    let mut materials = exported.scene.materials.iter();
    assert!(materials.any(|material| material.ior == 1.5 && material.volume.is_some()));

    let baked = Baked::quick(built_in("mirror"), &[LayerKind::Direct]);
    let error = encode(&baked, kept).expect_err("there is nothing that lamps do not give");
    says(error, "builtin:mirror | --lights remove");
    export(&baked, removed);
}

#[test]
fn emission_and_pictures_hold_light_sent_on() {
    let baked = Baked::quick(built_in("ring"), &[LayerKind::Caustic]);
    // The floor's albedo is a half.
    let sent = |e: &[f32; 3]| f64::from(e[1]) * 0.5 / PI;
    let sent: Vec<f64> = baked.light("").iter().map(sent).collect();
    let removed = with(WHOLE, |it| it.lights = SceneLights::Remove);
    for (quantity, factor) in [
        (Quantity::Irradiance, 1.0),
        (Quantity::Illuminance, LUMENS_PER_WATT),
    ] {
        let options = GlbOptions {
            carrier: Carrier::Emissive,
            quantity,
            ..removed
        };
        let (exported, _) = export(&baked, options);
        let material = exported.material(0);
        let strength = &material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"];
        let strength = strength.as_f64().expect("a number");
        let base = &material["pbrMetallicRoughness"]["baseColorFactor"];
        assert_eq!(*base, json!([0.0, 0.0, 0.0, 1.0]));
        for (texel, sent) in exported.image(&material["emissiveTexture"]).iter().zip(&sent) {
            let (found, wanted) = (texel[1] * strength, sent * factor);
            assert!((found - wanted).abs() <= strength * 2e-5, "{found} of {wanted}");
        }
    }
    let unlit = GlbOptions {
        carrier: Carrier::Unlit,
        exposure_stops: 1.5,
        ..removed
    };
    let (exported, _) = export(&baked, unlit);
    let material = exported.material(0);
    assert_eq!(material["extensions"], json!({ "KHR_materials_unlit": {} }));
    let picture = exported.image(&material["pbrMetallicRoughness"]["baseColorTexture"]);
    for (texel, sent) in picture.iter().zip(&sent) {
        assert!((texel[1] - (sent * 1.5_f64.exp2()).min(1.0)).abs() <= 2e-5);
    }
}

fn mesh_at(scene: &Scene, node: usize) -> &Mesh {
    let found = scene.objects.iter().find(|object| object.node == node);
    found.expect("it is there").mesh_in_scene()
}

#[test]
fn nodes_of_one_mesh_get_their_own_maps() {
    let around = folder();
    let file = around.path().join("boxes.glb");
    std::fs::write(&file, boxes().bytes()).expect("it can be written");
    let scene = load_path(&file, &LoadOptions::default()).expect("it can be read");
    let baked = Baked::quick(scene, &[LayerKind::Caustic]);
    let (exported, report) = export(&baked, WHOLE);
    assert_eq!(report.maps.len(), 2, "both boxes see the wall");
    assert_eq!(report.warnings, []);
    let json = &exported.json;
    assert_eq!(json["extras"]["note"], "kept");
    assert_ne!(json["nodes"][0]["mesh"], json["nodes"][1]["mesh"]);
    let [a, b] = [0, 1].map(|node| exported.primitive(node)["material"].as_u64());
    assert_ne!(a, b);
    for map in baked.manifest()["maps"].as_array().expect("a list") {
        let node = map["node"].as_u64().expect("a node") as usize;
        let [before, after] = [&baked.scene, &exported.scene].map(|scene| mesh_at(scene, node));
        let triangles = 0..before.triangles.len();
        let uv_file = baked.path("out").join(map["uv_file"].as_str().expect("a name"));
        let bytes = std::fs::read(uv_file).expect("it is there");
        let uvs = uv_file::decode(&bytes, triangles.len(), "uv").expect("it can be read");
        // As anybody reads the file: TEXCOORD_1 of the same corners, in the same order of turn.
        let second = after.uv1.as_ref().expect("it has a second set");
        assert_eq!(after.triangles.len(), triangles.len());
        for triangle in triangles.clone() {
            let corners = after.corners(triangle);
            let lies_there = |other: &usize| {
                let mut pairs = before.corners(*other).into_iter().zip(corners);
                pairs.all(|(a, b)| a.distance(b) < 1e-4)
            };
            let same = triangles.clone().find(lies_there).expect("the same triangle");
            let found = after.triangles[triangle].map(|vertex| second[vertex as usize]);
            for (wanted, found) in uvs[same].iter().zip(found) {
                near(found, *wanted, 1e-6, triangle);
            }
            let outward = after.corner_normals(triangle)[0];
            assert!(after.face_normal(triangle).dot(outward) > 0.9, "normals look out");
        }
        // Colours at vertices went with them.
        let attributes = &exported.primitive(node)["attributes"];
        let [colours, places] = ["COLOR_0", "POSITION"].map(|name| exported.floats(&attributes[name]));
        assert_eq!(colours.len(), places.len());
        for (colour, place) in colours.iter().zip(&places) {
            near(*colour, place + 0.5, 3e-6, "colour");
        }
    }
}
