//! Maps for other programs: what is in the files, read by hand.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec2, DVec3};
use nephroid::export::FloatImage;
use nephroid::scene::{LoadOptions, Scene, load};
use serde_json::{Value, json};

use crate::glb::Glb;
use crate::program::Sandbox;

const QUICK: &str = "--density 1e3 --map-resolution 64";

/// A `.glb` taken apart.
struct Exported {
    json: Value,
    binary: Vec<u8>,
}

impl Exported {
    fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("it was written");
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((&bytes[..4], word(8)), (&b"glTF"[..], bytes.len()));
        let json_end = 20 + word(12);
        assert_eq!(&bytes[json_end + 4..json_end + 8], b"BIN\0");
        let json: Value = serde_json::from_slice(&bytes[20..json_end]).expect("it is JSON");
        let mut binary = bytes[json_end + 8..].to_vec();
        let stated = json["buffers"][0]["byteLength"].as_u64().expect("a length") as usize;
        assert_eq!(stated.next_multiple_of(4), binary.len());
        binary.truncate(stated);
        Self { json, binary }
    }

    fn view(&self, index: &Value) -> &[u8] {
        let view = &self.json["bufferViews"][index.as_u64().expect("an index") as usize];
        let number = |name: &str| view[name].as_u64().unwrap_or(0) as usize;
        &self.binary[number("byteOffset")..number("byteOffset") + number("byteLength")]
    }

    /// The numbers of an accessor of floats.
    fn floats(&self, accessor: &Value) -> Vec<f64> {
        let accessor = &self.json["accessors"][accessor.as_u64().expect("an index") as usize];
        assert_eq!(accessor["componentType"], 5126);
        let bytes = self.view(&accessor["bufferView"]);
        bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|four| f64::from(f32::from_le_bytes(*four)))
            .collect()
    }

    fn primitive(&self, node: usize) -> &Value {
        let mesh = self.json["nodes"][node]["mesh"].as_u64().expect("it has a mesh");
        &self.json["meshes"][mesh as usize]["primitives"][0]
    }

    fn material(&self, node: usize) -> &Value {
        let material = self.primitive(node)["material"]
            .as_u64()
            .expect("it has a material");
        &self.json["materials"][material as usize]
    }

    /// The texels of an image that a texture names, sRGB-decoded [0, 1].
    fn image(&self, texture: &Value) -> Vec<[f64; 3]> {
        let texture = &self.json["textures"][texture["index"].as_u64().expect("an index") as usize];
        let image = &self.json["images"][texture["source"].as_u64().expect("an index") as usize];
        let png = image::load_from_memory(self.view(&image["bufferView"])).expect("it is a PNG");
        let linear = |code: u16| {
            let value = f64::from(code) / 65535.0;
            if value <= 0.040_45 {
                value / 12.92
            } else {
                ((value + 0.055) / 1.055).powf(2.4)
            }
        };
        // Of eight bits too, whose codes are 257 times smaller.
        png.to_rgb16().pixels().map(|pixel| pixel.0.map(linear)).collect()
    }
}

/// E of a layer of the one map of a node [W/m²].
fn baked(sandbox: &Sandbox, folder: &str, surface: &str, prefix: &str) -> Vec<[f32; 3]> {
    let manifest = sandbox.manifest(folder);
    let maps = manifest["maps"].as_array().expect("a list");
    let map = maps
        .iter()
        .find(|map| map["surface"] == surface)
        .expect("it has a map");
    let file = map["file"].as_str().expect("a name");
    let image = FloatImage::read(&sandbox.path(folder).join(file)).expect("it can be read");
    image.rgb(prefix).expect("it has the layer")
}

fn is_near(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * a.abs().max(b.abs())
}

#[test]
fn light_maps_hold_the_light_in_the_unit_that_was_asked_for() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK}"));
    let wanted = baked(&sandbox, "out", "floor", "caustic");
    for (units, factor) in [("E", 1.0), ("lux", 683.0), ("E/pi", 1.0 / std::f64::consts::PI)] {
        let run = sandbox.succeed(&format!("export out -o a.glb --bits 16 --units {units} --json"));
        let report = &run.json()["maps"][0];
        assert_eq!(report["surface"], "floor");
        let exported = Exported::read(&sandbox.path("a.glb"));
        assert_eq!(
            exported.json["extensionsUsed"]
                .as_array()
                .map(|used| used.contains(&json!("MOZ_lightmap"))),
            Some(true)
        );
        let node = report["node"].as_u64().expect("a node") as usize;
        let light = &exported.material(node)["extensions"]["MOZ_lightmap"];
        let intensity = light["intensity"].as_f64().expect("a number");
        let (mut cut, mut all) = (0.0, 0.0);
        for (texel, wanted) in exported.image(light).iter().zip(&wanted) {
            for (value, wanted) in texel.iter().zip(wanted) {
                let wanted = f64::from(*wanted) * factor;
                all += wanted.max(0.0);
                cut += (wanted - intensity).max(0.0);
                // A step of the code at most, whose width in linear light is largest at white: 2.3/65535.
                let bound = intensity * 2e-5;
                assert!(
                    (value * intensity - wanted.clamp(0.0, intensity)).abs() <= bound,
                    "{units}: {value} {wanted}"
                );
            }
        }
        let told = report["cut_share"].as_f64().expect("a number");
        assert!(
            cut / all <= 0.005 * (1.0 + 1e-9) && is_near(cut / all, told, 1e-4),
            "{told} of {}",
            cut / all
        );
    }
    // Nothing is cut where nothing may be.
    let run = sandbox.succeed("export out -o whole.glb --cut 0 --json");
    let report = &run.json()["maps"][0];
    assert_eq!(
        (report["cut_share"].as_f64(), report["cut_texels"].as_u64()),
        (Some(0.0), Some(0))
    );
}

#[test]
fn a_scene_is_lit_once_by_its_lights_or_by_its_maps() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!(
        "bake builtin:ball -o out --layers caustic,direct {QUICK}"
    ));
    let lights = |path: &str| {
        let source = sandbox.path(path);
        load(&source.to_string_lossy(), &LoadOptions::default())
            .expect("we read it ourselves")
            .lights
            .len()
    };
    // Direct light was baked: its lamps go.
    let run = sandbox.succeed("export out --json");
    assert_eq!(run.json()["layers"], json!(["caustic", "direct"]));
    assert_eq!(lights("out/ball.glb"), 0);
    let exported = Exported::read(&sandbox.path("out/ball.glb"));
    assert!(
        exported.json.get("extensions").is_none(),
        "no list of lights is left"
    );
    let total = baked(&sandbox, "out", "floor", "");
    let light = &exported.material(0)["extensions"]["MOZ_lightmap"];
    let intensity = light["intensity"].as_f64().expect("a number");
    let mean = |values: &[[f64; 3]]| values.iter().map(|texel| texel[1]).sum::<f64>() / values.len() as f64;
    let total: Vec<[f64; 3]> = total.iter().map(|texel| texel.map(f64::from)).collect();
    let found = mean(&exported.image(light)) * intensity / 683.0;
    assert!(is_near(found, mean(&total), 0.006), "{found} of {}", mean(&total));

    // Or they stay, and the map holds what they do not give.
    let run = sandbox.succeed("export out -o kept.glb --lights keep --json");
    assert_eq!(run.json()["layers"], json!(["caustic"]));
    assert_eq!(lights("kept.glb"), 1);
    // The ball is still of glass there.
    let kept = sandbox.path("kept.glb");
    let scene = load(&kept.to_string_lossy(), &LoadOptions::default()).expect("we read it ourselves");
    assert!(
        scene
            .materials
            .iter()
            .any(|material| material.ior == 1.5 && material.volume.is_some())
    );
}

#[test]
fn emission_is_what_the_surface_sends_on() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK}"));
    let wanted = baked(&sandbox, "out", "floor", "caustic");
    let albedo = 0.5;
    for (units, factor) in [("E", 1.0), ("lux", 683.0)] {
        sandbox.succeed(&format!(
            "export out -o a.glb --as emissive --lights remove --cut 0 --units {units}"
        ));
        let exported = Exported::read(&sandbox.path("a.glb"));
        let material = exported.material(0);
        let strength = &material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"];
        let strength = strength.as_f64().expect("a number");
        assert_eq!(
            material["pbrMetallicRoughness"]["baseColorFactor"],
            json!([0.0, 0.0, 0.0, 1.0])
        );
        for (texel, wanted) in exported.image(&material["emissiveTexture"]).iter().zip(&wanted) {
            let wanted = f64::from(wanted[1]) * factor * albedo / std::f64::consts::PI;
            assert!(
                (texel[1] * strength - wanted).abs() <= strength * 2e-5,
                "{} of {wanted}",
                texel[1] * strength
            );
        }
    }
    // Unlit: a picture, at an exposure that is told.
    let run = sandbox.succeed("export out -o b.glb --as unlit --bits 16 --exposure 1.5 --json");
    assert_eq!(run.json()["options"]["exposure_stops"], 1.5);
    let exported = Exported::read(&sandbox.path("b.glb"));
    let material = exported.material(0);
    assert_eq!(material["extensions"], json!({ "KHR_materials_unlit": {} }));
    let picture = exported.image(&material["pbrMetallicRoughness"]["baseColorTexture"]);
    for (texel, wanted) in picture.iter().zip(&wanted) {
        let wanted = f64::from(wanted[1]) * 1.5_f64.exp2() * albedo / std::f64::consts::PI;
        assert!((texel[1] - wanted.min(1.0)).abs() <= 2e-5);
    }
}

/// Two boxes of one mesh, one of them mirrored, with colours at their vertices, and a mirror behind them.
pub fn boxes() -> Glb {
    let mut file = Glb::empty();
    let (mut positions, mut normals, mut colours, mut indices) = (vec![], vec![], vec![], vec![]);
    for axis in 0..3_usize {
        for sign in [-1.0_f32, 1.0] {
            let first = (positions.len() / 3) as u32;
            for (u, v) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut corner = [0.0_f32; 3];
                corner[axis] = 0.3 * sign;
                corner[(axis + 1) % 3] = 0.3 * u * sign;
                corner[(axis + 2) % 3] = 0.3 * v;
                let mut normal = [0.0; 3];
                normal[axis] = sign;
                positions.extend(corner);
                normals.extend(normal);
                colours.extend([u * 0.5 + 0.5, v * 0.5 + 0.5, sign * 0.5 + 0.5]);
            }
            indices.extend([0, 1, 2, 0, 2, 3].map(|corner: u32| first + corner));
        }
    }
    let attributes = json!({
        "POSITION": file.push_floats(&positions, 3),
        "NORMAL": file.push_floats(&normals, 3),
        "COLOR_0": file.push_floats(&colours, 3),
    });
    let indices = file.push_indices(&indices);
    let plaster = file.push(
        "materials",
        json!({ "name": "plaster", "pbrMetallicRoughness": { "metallicFactor": 0.0 } }),
    );
    let mesh = file.push_mesh(json!({ "attributes": attributes, "indices": indices, "material": plaster }));
    file.push_root(json!({ "name": "box", "mesh": mesh, "translation": [0.0, 0.3, 0.0] }));
    file.push_root(
        json!({ "name": "mirrored box", "mesh": mesh, "translation": [1.0, 0.3, 0.1],
        "scale": [-1.0, 1.5, 1.0], "rotation": [0.0, 0.38268343, 0.0, 0.92387953] }),
    );
    let silver = json!({ "name": "silver", "doubleSided": true,
        "pbrMetallicRoughness": { "metallicFactor": 1.0, "roughnessFactor": 0.0 } });
    let silver = file.push("materials", silver);
    let corners = [-2.0, 0.0, -1.0, 3.0, 0.0, -1.0, 3.0, 2.0, -1.0, -2.0, 2.0, -1.0];
    let positions = file.push_floats(&corners, 3);
    let indices = file.push_indices(&[0, 1, 2, 0, 2, 3]);
    let wall = json!({ "attributes": { "POSITION": positions }, "indices": indices, "material": silver });
    let wall = file.push_mesh(wall);
    file.push_root(json!({ "name": "wall", "mesh": wall }));
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.json["extras"] = json!({ "note": "kept" });
    let lamp = json!({ "type": "point", "intensity": 683.0 });
    file = file.with_light("lamp", lamp);
    let lamp = file.json["nodes"].as_array().expect("a list").len() - 1;
    file.json["nodes"][lamp]["translation"] = json!([0.4, 2.0, 1.5]);
    file
}

/// World corners of an object's triangles with the coordinates that their map is looked up by, whatever their order.
fn corners_of(scene: &Scene, object: usize, uvs: &[[DVec2; 3]]) -> HashMap<[i64; 9], [DVec2; 3]> {
    let mesh = &scene.objects[object].mesh;
    let key = |corners: [DVec3; 3]| {
        let rounded = corners.map(|corner| (corner * 1e4).round().to_array().map(|value| value as i64));
        rounded.as_flattened().try_into().expect("nine numbers")
    };
    let triangles = 0..mesh.triangles.len();
    triangles
        .map(|triangle| (key(mesh.corners(triangle)), uvs[triangle]))
        .collect()
}

#[test]
fn generated_coordinates_come_with_the_surface_also_where_nodes_share_it_or_mirror_it() {
    let sandbox = Sandbox::new();
    sandbox.write("boxes.glb", boxes().bytes());
    sandbox.succeed(&format!("bake boxes.glb -o out {QUICK}"));
    let run = sandbox.succeed("export out -o lit.glb --json");
    assert_eq!(run.stderr, "");
    let report = run.json();
    let manifest = sandbox.manifest("out");
    let maps = manifest["maps"].as_array().expect("a list");
    assert_eq!(maps.len(), 2, "both boxes see the wall");
    assert_eq!(report["maps"].as_array().map(Vec::len), Some(2));

    let open = |name: &str| {
        load(&sandbox.path(name).to_string_lossy(), &LoadOptions::default()).expect("it can be read")
    };
    let (before, after) = (open("boxes.glb"), open("lit.glb"));
    let exported = Exported::read(&sandbox.path("lit.glb"));
    assert_eq!(exported.json["extras"]["note"], "kept");
    for map in maps {
        assert_eq!(map["uv_set"], "generated");
        let node = map["node"].as_u64().expect("a node") as usize;
        let object = |scene: &Scene| {
            let mut objects = scene.objects.iter();
            objects
                .position(|object| object.node == node)
                .expect("it is there")
        };
        let (was, is) = (object(&before), object(&after));
        let triangles = before.objects[was].mesh.triangles.len();
        let bytes = std::fs::read(sandbox.path("out").join(map["uv_file"].as_str().expect("a name")));
        let uvs = nephroid::export::uv_file::decode(&bytes.expect("it is there"), triangles, "uv");
        let wanted = corners_of(&before, was, &uvs.expect("it can be read"));
        // As anybody reads the file: TEXCOORD_1 of the same corners, in the same order of turn.
        let mesh = &after.objects[is].mesh;
        let second = mesh.uv1.as_ref().expect("it has a second set");
        let uvs: Vec<[DVec2; 3]> = mesh
            .triangles
            .iter()
            .map(|corners| corners.map(|vertex| second[vertex as usize]))
            .collect();
        let found = corners_of(&after, is, &uvs);
        assert_eq!(wanted.len(), found.len());
        for (corners, wanted) in &wanted {
            let found = found.get(corners).expect("the same triangle");
            for (a, b) in wanted.iter().zip(found) {
                assert!(a.distance(*b) < 1e-6, "{a}, {b}");
            }
        }
        for triangle in 0..triangles {
            let facet = mesh.face_normal(triangle);
            let outward = mesh.corner_normals(triangle)[0];
            assert!(facet.dot(outward) > 0.9, "normals look out");
        }
        // Colours at vertices went with them.
        let attributes = &exported.primitive(node)["attributes"];
        let (colours, places) = (
            exported.floats(&attributes["COLOR_0"]),
            exported.floats(&attributes["POSITION"]),
        );
        assert_eq!(colours.len(), places.len());
        for (colour, place) in colours.as_chunks::<3>().0.iter().zip(places.as_chunks::<3>().0) {
            // The third channel tells the sign of the side, which no corner of the cube contradicts on all axes.
            let sign = if colour[2] > 0.5 { 1.0 } else { -1.0 };
            assert!(
                place.iter().any(|value| is_near(*value, 0.3 * sign, 1e-5)),
                "{place:?} {colour:?}"
            );
        }
    }
    assert_ne!(
        exported.json["nodes"][0]["mesh"],
        exported.json["nodes"][1]["mesh"]
    );
    assert_ne!(
        exported.primitive(0)["material"],
        exported.primitive(1)["material"]
    );
}

#[test]
fn nothing_is_lost_where_an_export_cannot_be() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    let refused = |line: &str, code: i32, words: &[&str]| {
        sandbox.run(line).failed_in_one_sentence(code, words);
    };
    refused("export nowhere", 1, &["nowhere"]);
    refused("export out -o missing/a.glb", 1, &["missing"]);
    refused("export out --cut 100%", 2, &["--cut", "share"]);
    refused("export out --cut nan", 2, &["--cut"]);
    refused("export out --exposure 1", 2, &["--exposure", "unlit"]);
    refused("export out --as unlit --lights keep", 2, &["--lights keep"]);
    refused("export out --as unlit --exposure nan", 2, &["--exposure"]);
    refused("export out --scene builtin:ring", 1, &["geometry"]);
    // The scene is not written over, by whatever name.
    std::fs::create_dir(sandbox.path("sub")).expect("it can be made");
    let scene = sandbox.write("boxes.glb", boxes().bytes());
    sandbox.succeed(&format!("bake boxes.glb -o own {QUICK}"));
    refused("export own -o sub/../boxes.glb", 2, &["scene itself"]);
    assert_eq!(std::fs::read(scene).ok(), Some(boxes().bytes()));
    // Only direct light was baked: there is nothing that lamps do not give.
    sandbox.succeed(&format!("bake builtin:mirror -o direct --layers direct {QUICK}"));
    refused("export direct --lights keep", 1, &["--lights remove"]);
    sandbox.succeed("export direct");
}
