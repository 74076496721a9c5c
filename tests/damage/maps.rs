//! Folders of maps and single maps, as `--maps` and `compare` read them.

use std::path::{Path, PathBuf};

use nephroid::export::map_folder::MapFolder;
use nephroid::export::{FloatImage, map_reader};
use nephroid::illumination::IlluminationMap;
use nephroid::scene::Scene;
use nephroid::settings::{BakeSettings, LayerKind};

use crate::mutate::{Damage, effort};
use crate::tools::{at, bake, builtin_scene};
use crate::watch::Tally;

/// Memory that reading so small a folder may take [bytes].
const MOST_BYTES: usize = 32 << 20;

/// The files of a bake's folder, and what was baked.
struct Folder {
    scene: Scene,
    path: tempfile::TempDir,
    files: Vec<(PathBuf, Vec<u8>)>,
}

impl Folder {
    fn of(scene: &str) -> Self {
        let scene = builtin_scene(scene);
        let path = tempfile::tempdir().expect("temporary folder");
        let settings = BakeSettings {
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..at(500.0, 16)
        };
        let result = bake(scene.clone(), &settings);
        let folder = MapFolder::open(path.path(), false).expect("writable");
        folder.write(&scene, &settings, &result).expect("writable");
        let mut names = vec![PathBuf::from("manifest.json")];
        let maps = std::fs::read_dir(path.path().join("maps")).expect("it was made");
        names.extend(maps.map(|entry| Path::new("maps").join(entry.expect("listed").file_name())));
        names.sort();
        let read = |name: &Path| std::fs::read(path.path().join(name)).expect("it was written");
        let files = names
            .into_iter()
            .map(|name| (name.clone(), read(&name)))
            .collect();
        Self { scene, path, files }
    }

    fn read(&self) -> nephroid::error::Result<Vec<IlluminationMap>> {
        map_reader::read(self.path.path(), &self.scene).map(|(maps, _)| maps)
    }
}

/// Where a map that was read is none.
fn map_fault(map: &IlluminationMap, scene: &Scene) -> Option<String> {
    let texels = map.chart.texel_count();
    let is_light = |value: &f32| value.is_finite() && *value >= 0.0;
    let is_whole = |values: &[[f32; 3]]| values.len() == texels && values.as_flattened().iter().all(is_light);
    let layers = map.layers.iter().all(|layer| is_whole(&layer.irradiance));
    let error = map.error.as_ref();
    let errors = error.is_none_or(|error| error.len() == texels && error.iter().all(is_light));
    let estimate = map
        .estimated_relative_rmse
        .is_none_or(|error| error.is_finite() && error >= 0.0);
    let object = map.chart.object() < scene.objects.len();
    (!(layers && errors && estimate && object))
        .then(|| format!("layers {layers}, errors {errors}, estimate {estimate}, object {object}"))
}

#[test]
fn folders_of_maps() {
    let _alone = crate::watch::alone();
    let tally = Tally::default();
    for name in ["mirror", "showroom"] {
        let folder = Folder::of(name);
        let maps = folder.read().expect("nothing is damaged yet");
        assert!(!maps.is_empty() && maps.iter().all(|map| map_fault(map, &folder.scene).is_none()));
        for number in 0..40 * effort() {
            let mut damage = Damage::to(name, number);
            // The manifest leads to everything else.
            let hit = if damage.below(2) == 0 {
                0
            } else {
                damage.below(folder.files.len())
            };
            let (file, whole) = &folder.files[hit];
            let mut bytes = whole.clone();
            match serde_json::from_slice::<serde_json::Value>(whole) {
                Ok(mut manifest) if damage.below(4) > 0 => {
                    // What maps are read by is a small part of it.
                    let maps = damage.below(2) == 0;
                    damage.json(if maps {
                        &mut manifest["maps"]
                    } else {
                        &mut manifest
                    });
                    bytes = manifest.to_string().into_bytes();
                }
                _ => damage.bytes(&mut bytes),
            }
            let place = folder.path.path().join(file);
            std::fs::write(&place, &bytes).expect("can be written");
            let kept = format!("{number}-{name}-{}", file.display()).replace('/', "-");
            if let Some(maps) = tally.watch((&kept, &bytes), MOST_BYTES, || folder.read()) {
                let fault = maps.iter().find_map(|map| map_fault(map, &folder.scene));
                assert_eq!(fault, None, "{kept}");
            }
            std::fs::write(&place, whole).expect("can be written");
        }
    }
    println!("folders of maps: {tally:?}");
    assert!(tally.taken.get() > 3 && tally.refused.get() > 3, "{tally:?}");
}

#[test]
fn single_maps() {
    let _alone = crate::watch::alone();
    let folder = Folder::of("mirror");
    let exr = folder
        .files
        .iter()
        .find(|(name, _)| name.extension().is_some_and(|e| e == "exr"));
    let mut pfm = b"PF\n16 16\n-1.0\n".to_vec();
    pfm.extend((0..16 * 16 * 3).flat_map(|value| (value as f32).to_le_bytes()));
    let tally = Tally::default();
    let path = folder.path.path().join("map");
    for (name, whole) in [("a.exr", &exr.expect("a map").1), ("a.pfm", &pfm)] {
        for number in 0..1_500 * effort() {
            let mut damage = Damage::to(name, number);
            let mut bytes = whole.clone();
            // Most of what can be wrong stands at the beginning.
            let head = bytes.len().min(400);
            if damage.below(2) == 0 {
                let mut header = bytes[..head].to_vec();
                damage.bytes(&mut header);
                bytes.splice(..head, header);
            } else {
                damage.bytes(&mut bytes);
            }
            std::fs::write(&path, &bytes).expect("can be written");
            let read = || FloatImage::read(&path);
            if let Some(image) = tally.watch((&format!("{number}-{name}"), &bytes), MOST_BYTES, read) {
                let texels = image.width * image.height;
                assert!(
                    image
                        .channels
                        .iter()
                        .all(|channel| channel.values.len() == texels)
                );
            }
        }
    }
    println!("single maps: {tally:?}");
    assert!(tally.taken.get() > 50 && tally.refused.get() > 50, "{tally:?}");
}

/// A header of some hundred bytes that claims gigabytes.
#[test]
fn stated_sizes_take_no_memory() {
    let _alone = crate::watch::alone();
    let channel = |name: String| nephroid::export::float_image::Channel {
        name,
        values: vec![1.0; 64],
    };
    let image = FloatImage {
        width: 8,
        height: 8,
        channels: (0..40)
            .map(|number| channel(format!("layer{number}.Y")))
            .collect(),
    };
    let small = nephroid::export::exr::encode(image, "", "a.exr").expect("an image");
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("map");
    let tally = Tally::default();
    for side in [100_i32, 2048, 16384, 16385, i32::MAX] {
        let mut exr = small.clone();
        for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
            let at = exr
                .windows(window.len())
                .position(|bytes| bytes == window)
                .expect("it has one");
            let corner = at + window.len() + 4 + 8;
            for coordinate in [corner, corner + 4] {
                exr[coordinate..coordinate + 4].copy_from_slice(&(side - 1).to_le_bytes());
            }
        }
        let pfm = format!("PF\n{side} {side}\n-1.0\nabcd").into_bytes();
        for (kind, bytes) in [("exr", exr), ("pfm", pfm)] {
            std::fs::write(&path, &bytes).expect("can be written");
            tally.watch((&format!("{side}.{kind}"), &bytes), MOST_BYTES, || {
                FloatImage::read(&path)
            });
        }
    }
    assert_eq!(tally.refused.get(), 10, "{tally:?}");
}
