//! Files for other programs, read back by readers that are not ours.

mod glb;
mod maps;
mod textures;
#[cfg(feature = "gpu")]
mod web;

use std::path::PathBuf;

use nephroid::error::Error;
use nephroid::export::map_folder::MapFolder;
use nephroid::export::map_set::MapSet;
use nephroid::export::textures::{Content, Encoding, Exposure, TextureFolder, TextureOptions, TextureReport};
use nephroid::export::{FloatImage, Quantity};

use crate::prelude::*;
use support::program::{names, read_json};
use support::tools::{bake, to};

struct Baked {
    scene: Scene,
    result: Bake,
    around: tempfile::TempDir,
}

impl Baked {
    fn new(scene: Scene, settings: &BakeSettings) -> Self {
        let (result, around) = (bake(scene.clone(), settings), folder());
        let baked = Self {
            scene,
            result,
            around,
        };
        let folder = MapFolder::open(baked.path("out"), false).expect("it can be written");
        let written = folder.write(&baked.scene, settings, &baked.result);
        written.expect("it can be written");
        baked
    }

    /// Maps of 64 texels each way, of a light pass of milliseconds.
    fn quick(scene: Scene, layers: &[LayerKind]) -> Self {
        let mut settings = to(0.03, 64);
        settings.layers = layers.to_vec();
        Self::new(scene, &settings)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.around.path().join(name)
    }

    fn manifest(&self) -> Value {
        read_json(&self.path("out/manifest.json"))
    }

    fn file(&self, map: usize) -> FloatImage {
        let manifest = self.manifest();
        let name = manifest["maps"][map]["file"].as_str().expect("a name");
        FloatImage::read(&self.path("out").join(name)).expect("it can be read")
    }

    /// E of the first map [W/m²], of a layer or (without a name) of all.
    fn light(&self, layer: &str) -> Vec<[f32; 3]> {
        self.file(0).rgb(layer).expect("it has the layer")
    }

    fn textures(&self, options: TextureOptions, folder: &str) -> Result<TextureReport, Error> {
        let maps = self.path("out");
        let reader = MapSet::open(&maps, &self.scene)?;
        let folder = TextureFolder::open(&self.path(folder), false)?;
        nephroid::export::textures::write(&[reader], options, folder, &Control::default())
    }
}

/// All light as it is [W/m²], a file for each map.
fn as_it_is(encoding: Encoding) -> TextureOptions {
    TextureOptions {
        encoding,
        quantity: Quantity::Irradiance,
        content: Content::Sum,
        exposure: Exposure::Stops(0.0),
        atlas_side: None,
    }
}

/// Luminous efficacy that watts are counted by [lm/W].
const LUMENS_PER_WATT: f64 = 683.0;

/// IEC 61966-2-1.
fn linear_of_srgb(code: u16) -> f64 {
    let share = f64::from(code) / 65535.0;
    if share <= 0.040_45 {
        share / 12.92
    } else {
        ((share + 0.055) / 1.055).powf(2.4)
    }
}

/// Two boxes of one mesh, one of them mirrored, with colours at their vertices (position + 0.5), before a mirror.
pub fn boxes() -> Glb {
    let mut file = Glb::empty();
    let cube = shapes::cuboid(DVec3::splat(-0.3), DVec3::splat(0.3));
    let colours: Vec<DVec3> = cube.positions.iter().map(|place| *place + 0.5).collect();
    let attributes = json!({
        "POSITION": file.push_vectors(&cube.positions),
        "NORMAL": file.push_vectors(&cube.normals),
        "COLOR_0": file.push_vectors(&colours),
    });
    let indices = file.push_indices(cube.triangles.as_flattened());
    let plaster = json!({ "name": "plaster", "pbrMetallicRoughness": { "metallicFactor": 0.0 } });
    let plaster = file.push("materials", plaster);
    let mesh = file.push_mesh(json!({ "attributes": attributes, "indices": indices, "material": plaster }));
    file.push_root(json!({ "name": "box", "mesh": mesh, "translation": [0.0, 0.3, 0.0] }));
    let mut mirrored = parsed(
        r#"{"name": "mirrored box", "translation": [1.0, 0.3, 0.1], "scale": [-1.0, 1.5, 1.0],
            "rotation": [0.0, 0.38268343, 0.0, 0.92387953]}"#,
    );
    mirrored["mesh"] = json!(mesh);
    file.push_root(mirrored);
    let silver = parsed(
        r#"{"name": "silver", "doubleSided": true,
            "pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}}"#,
    );
    let silver = file.push("materials", silver);
    let corners = [-2.0, 0.0, -1.0, 3.0, 0.0, -1.0, 3.0, 2.0, -1.0, -2.0, 2.0, -1.0];
    let attributes = json!({ "POSITION": file.push_floats(&corners, 3) });
    let indices = file.push_indices(&[0, 1, 2, 0, 2, 3]);
    let wall = file.push_mesh(json!({ "attributes": attributes, "indices": indices, "material": silver }));
    file.push_root(json!({ "name": "wall", "mesh": wall }));
    file.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.json["extras"] = json!({ "note": "kept" });
    let lamp = json!({ "type": "point", "intensity": 683.0 });
    file.with_light_at("lamp", lamp, [0.4, 2.0, 1.5])
}

/// The same with a second lamp of the first one's name.
fn two_lamps() -> Glb {
    let warm = json!({ "type": "point", "intensity": 300.0, "color": [1.0, 0.5, 0.2] });
    boxes().with_light_at("lamp", warm, [-0.6, 1.7, 1.9])
}
