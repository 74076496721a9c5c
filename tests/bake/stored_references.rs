//! Maps by brute force that are kept with the tests, since tracing them takes minutes, and how they are made again.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use nephroid::export::manifest::SceneSummary;
use nephroid::export::pfm;
use nephroid::illumination::parametrisation::DEFAULT_NOMINAL_SIDE;
use nephroid::illumination::{IlluminationMap, Layer, parametrise};
use nephroid::scene::Scene;
use nephroid::settings::LayerKind;
use nephroid::study::agreement::caustic_luminance;
use nephroid::study::brute_force::relative_noise;
use serde::{Deserialize, Serialize};

use crate::brute_force::brute;
use crate::support::project_file;
use crate::tools::settings;

/// Texels across and down.
pub const SIDE: usize = 64;

const FOLDER: &str = "tests/goldens/brute_force";
const INDEX: &str = "index.json";

/// Maps of one scene.
#[derive(Clone, Debug)]
pub struct StoredReference {
    pub maps: Vec<IlluminationMap>,
    /// Standard error over the mean, over all maps.
    pub noise: f64,
}

/// What the index says of one scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Entry {
    geometry_hash: String,
    rays: u64,
    noise: f64,
    /// File by surface.
    maps: BTreeMap<String, String>,
}

type Index = BTreeMap<String, Entry>;

/// The maps of a scene of that name and shape; fails where there are none.
pub fn stored(scene: &Scene) -> StoredReference {
    let index = read_index();
    let entry = index
        .get(&scene.name)
        .unwrap_or_else(|| panic!("no reference of {}: make it as write_references says", scene.name));
    assert_eq!(
        entry.geometry_hash,
        SceneSummary::of(scene).geometry_hash,
        "{} has changed since its reference was made: make it again as write_references says",
        scene.name
    );
    let map = |(surface, file): (&String, &String)| read_map(scene, surface, file);
    StoredReference {
        maps: entry.maps.iter().map(map).collect(),
        noise: entry.noise,
    }
}

/// Traces a scene and keeps its maps.
pub fn store(scene: &Scene, rays: u64) {
    let result = brute(scene, &settings(1.0, SIDE), rays);
    let folder = project_file(FOLDER);
    let mut maps = BTreeMap::new();
    for map in &result.maps {
        let surface = &scene.objects[map.chart.object()].name;
        let file = format!("{}_{}.pfm", scene.name, surface.replace(' ', "_"));
        let mut bytes = format!("Pf\n{SIDE} {SIDE}\n-1.0\n").into_bytes();
        for value in caustic_luminance(map) {
            bytes.extend((value as f32).to_le_bytes());
        }
        std::fs::write(folder.join(&file), bytes).expect("a writable folder");
        maps.insert(surface.clone(), file);
    }
    let entry = Entry {
        geometry_hash: SceneSummary::of(scene).geometry_hash,
        rays: result.counts.rays,
        noise: relative_noise(&result.maps).expect("light"),
        maps,
    };
    let mut index = read_index();
    index.insert(scene.name.clone(), entry);
    let json = serde_json::to_vec_pretty(&index).expect("JSON");
    std::fs::write(folder.join(INDEX), json).expect("a writable folder");
}

/// Noise of the stored maps of a scene, if there are some that fit it.
pub fn stored_noise(scene: &Scene) -> Option<f64> {
    let index = read_index();
    let entry = index.get(&scene.name)?;
    (entry.geometry_hash == SceneSummary::of(scene).geometry_hash).then_some(entry.noise)
}

fn read_index() -> Index {
    match std::fs::read(project_file(FOLDER).join(INDEX)) {
        Ok(bytes) => serde_json::from_slice(&bytes).expect("a sound index"),
        Err(_) => Index::new(),
    }
}

fn read_map(scene: &Scene, surface: &str, file: &str) -> IlluminationMap {
    let path: PathBuf = project_file(FOLDER).join(file);
    let bytes = std::fs::read(&path).expect("a map beside its index");
    let grid = pfm::decode(&bytes, file)
        .expect("a sound map")
        .luminance("")
        .expect("one channel");
    let object = scene
        .objects
        .iter()
        .position(|object| object.name == surface)
        .expect("a surface of the scene");
    let parametrisation =
        parametrise(object, &scene.objects[object].mesh, DEFAULT_NOMINAL_SIDE).expect("an area");
    IlluminationMap {
        chart: Arc::new(parametrisation.chart(grid.width, grid.height)),
        layers: vec![Layer {
            kind: LayerKind::Caustic,
            irradiance: grid.values.iter().map(|value| [*value as f32; 3]).collect(),
        }],
        error: None,
        estimated_relative_rmse: None,
    }
}
