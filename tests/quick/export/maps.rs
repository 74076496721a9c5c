//! Folders of maps and of shards: what manifests and files say, every texel of every channel; that nothing is trusted when
//! it is read back, and what is taken up or replaced.

use std::path::{Path, PathBuf};

use nephroid::bake::{Baker, ShardSource as _};
use nephroid::error::Result;
use nephroid::export::exr::{MapValue, decode, encode_map, rgb_values};
use nephroid::export::frame_folder::FrameFolder;
use nephroid::export::map_folder::MapFolder;
use nephroid::export::map_set::MapSet;
use nephroid::export::shards::{SceneOrigin, ShardFolder, ShardManifest, ShardSet};
use nephroid::export::textures::TextureFolder;
use nephroid::illumination::tiles::TileLayout;
use nephroid::illumination::{Chart, Layer, Parametrisation, parametrise};
use nephroid::light_pass::shard_index::ShardIndex;
use nephroid::optics::glass::Glass;
use nephroid::settings::Wavelengths;

use super::{Baked, names, two_lamps};
use crate::prelude::*;
use support::program::{number, read_json};
use support::tools::{bake, energy_fault, photons, to};

#[test]
fn files_hold_the_watts_of_their_ledgers() {
    for scene in ["mirror", "slab", "ball"] {
        let settings = to(0.03, 32);
        let baked = Baked::new(built_in(scene), &settings);
        assert_eq!(energy_fault(&baked.result), None, "{scene}");
        let manifest = baked.manifest();
        let energy = &manifest["energy_w"];
        let sum = |names: &[&str]| names.iter().map(|name| number(&energy[name])).sum::<f64>();
        let emitted = sum(&["emitted"]);
        assert!(emitted > 0.1, "{scene}: {emitted} W");
        let booked = sum(&["deposited", "absorbed", "escaped", "truncated", "sampling"]);
        assert_close(booked, emitted, 1e-6, scene);
        let ledgers = manifest["ledgers"].as_array().expect("ledgers").iter();
        let by_light: f64 = ledgers.map(|ledger| number(&ledger["energy_w"]["emitted"])).sum();
        assert_close(by_light, emitted, 1e-9, scene);
        let flux = |map: usize| {
            let light = baked.file(map).luminance("caustic").expect("a layer");
            light.values.iter().sum::<f64>() * number(&manifest["maps"][map]["texel_area_m2"])
        };
        let held: f64 = (0..baked.result.maps.len()).map(flux).sum();
        assert_close(held, sum(&["deposited"]), 1e-5, scene);
    }
}

#[test]
fn map_files_are_what_other_readers_expect() {
    let layers = [LayerKind::Caustic, LayerKind::Direct];
    let baked = Baked::quick(built_in("mirror"), &layers);
    let bytes = std::fs::read(baked.path("out/maps/0000_floor.exr")).expect("there");
    let meta = exr::meta::MetaData::read_from_buffered(bytes.as_slice(), true).expect("sound");
    let [header] = &meta.headers[..] else {
        panic!("not a single part")
    };
    assert_eq!(header.compression, exr::compression::Compression::ZIP16);
    let channels = &header.channels.list;
    let is_float = |channel: &exr::meta::attribute::ChannelDescription| {
        channel.sample_type == exr::meta::attribute::SampleType::F32
    };
    assert!(channels.iter().all(is_float));
    let mut names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    names.sort_unstable();
    let expected = "B G R caustic.B caustic.G caustic.R direct.B direct.G direct.R error.Y";
    assert_eq!(names.join(" "), expected);
}

#[test]
fn bands_of_the_spectrum_have_channels() {
    let settings = BakeSettings {
        wavelengths: Wavelengths::Rainbow,
        keep_spectrum: true,
        ..photons(1e5, 32)
    };
    let mut scene = built_in("ball");
    let glass = Arc::new(Glass::parse("N-SF11").expect("a glass"));
    let specular = |material: &&mut Material| material.surface.is_specular();
    let clear = scene.materials.iter_mut().filter(specular);
    clear.for_each(|material| material.set_glass(glass.clone()));
    let baked = Baked::new(scene, &settings);
    let manifest = baked.manifest();
    let ledger = &manifest["ledgers"][0];
    let [emitted, deposited] = ["emitted_radiant_w", "deposited_radiant_w"].map(|key| number(&ledger[key]));
    assert!(0.0 < deposited && deposited < emitted, "{ledger}");
    let bands = manifest["maps"][0]["bands"].as_array().expect("bands");
    let edges = |key: &str| bands.iter().map(|band| number(&band[key])).collect::<Vec<f64>>();
    let (from, to) = (edges("from_nm"), edges("to_nm"));
    assert_eq!((from.len(), &from[1..]), (7, &to[..6]), "bands meet");
    let image = baked.file(0);
    for band in bands {
        let name = band["channel"].as_str().expect("a channel");
        let values = image.channel(name).unwrap_or_else(|| panic!("no {name}"));
        assert!(values.iter().any(|value| *value > 0.0), "{name} is dark");
    }
}

#[test]
fn files_are_as_large_as_asked_for() {
    let settings = BakeSettings {
        map_resolution: MapResolution::Fixed {
            width: 600,
            height: 500,
        },
        memory_bytes: 1 << 20,
        ..to(0.03, 1)
    };
    let baked = Baked::new(built_in("mirror"), &settings);
    let warnings = &baked.result.warnings;
    assert!(
        warnings.iter().any(|warning| warning.location == "--memory"),
        "{warnings:?}"
    );
    let map = &baked.manifest()["maps"][0];
    assert_eq!((&map["width"], &map["height"]), (&600.into(), &500.into()));
    let bytes = |name: &str| map[name].as_u64().expect("a number");
    assert!(bytes("memory_bytes") <= 1 << 20 && bytes("dense_bytes") == 600 * 500 * 56);
    let image = baked.file(0);
    assert_eq!((image.width, image.height), (600, 500));
}

#[test]
fn stored_maps_are_not_trusted() {
    let baked = Baked::quick(built_in("mirror"), &[LayerKind::Caustic]);
    let out = baked.path("out");
    let read = |folder: &Path, scene: &Scene| MapSet::open(folder, scene)?.read_all();
    let refuse = |scene: &Scene, words: &str| says(read(&out, scene).expect_err(words), words);
    refuse(&built_in("ring"), "builtin:mirror | builtin:ring | geometry");
    let missing = read(&baked.path("nowhere"), &baked.scene).expect_err("nowhere");
    says(missing, "nowhere | no such file");
    let sound = baked.manifest();
    let write = |manifest: &Value| {
        std::fs::write(out.join("manifest.json"), manifest.to_string()).expect("writable");
    };
    let map = &sound["maps"][0];
    for (place, value, words) in [
        ("/schema", json!(99), "version 99"),
        ("/maps/0/file", json!("../../secret.exr"), "secret"),
        ("/maps/0/file", json!("/etc/passwd"), "passwd"),
        ("/maps/0/file", json!("maps/gone.exr"), "gone.exr"),
        ("/maps/0/width", json!(63), "64x64 is not the manifest's 63x64"),
        ("/maps/0/node", json!(7777), "no surface"),
        ("/maps/0/layers", json!(["direct"]), "direct layer"),
        ("/maps/0/uv_set", json!("generated"), "texture coordinates"),
        ("/maps", json!([map, map]), "two maps"),
        ("", json!({}), "not a manifest"),
    ] {
        let mut manifest = sound.clone();
        *manifest.pointer_mut(place).expect("it is there") = value;
        write(&manifest);
        refuse(&baked.scene, words);
    }
    write(&sound);
    read(&out, &baked.scene).expect("it is whole again");
    let file = out.join(map["file"].as_str().expect("a name"));
    std::fs::write(file, "no image").expect("writable");
    refuse(&baked.scene, "neither an OpenEXR");
}

fn plane() -> Parametrisation {
    let mesh = shapes::rectangle(DVec3::ZERO, DVec3::X * 2.0, DVec3::Z);
    parametrise(0, &mesh).expect("a chart")
}

/// A value of its own for each texel of each channel of a part; its sums are exact.
fn value(part: usize, texel: usize, channel: usize) -> f32 {
    (1 + part + 4 * (channel + 3 * texel)) as f32
}

fn irradiance(part: usize, texels: usize) -> Vec<[f32; 3]> {
    let texel = |texel| [0, 1, 2].map(|channel| value(part, texel, channel));
    (0..texels).map(texel).collect()
}

/// A map with a caustic layer (part 0), a direct one (part 1) and an error (part 3).
fn map(chart: Chart) -> IlluminationMap {
    let texels = chart.texel_count();
    let layer = |(part, kind)| Layer {
        kind,
        irradiance: irradiance(part, texels),
    };
    IlluminationMap {
        chart: Arc::new(chart),
        layers: [(0, LayerKind::Caustic), (1, LayerKind::Direct)]
            .map(layer)
            .into(),
        error: Some((0..texels).map(|texel| value(3, texel, 0)).collect()),
        estimated_relative_rmse: None,
        estimated_visible: None,
    }
}

/// Reads the map's file and fails unless each of its channels is what `texel_at` (column, row) says of it.
fn assert_file(map: &IlluminationMap, texel_at: impl Fn(usize, usize) -> usize) {
    let texels = map.chart.texel_count();
    let of_lamp = irradiance(2, texels);
    let band: Vec<f32> = (0..texels).map(|texel| value(2, texel, 1)).collect();
    let size = (map.width(), map.height());
    let band_value: MapValue = Box::new(|texel| band[texel]);
    let others = rgb_values("caustic.lamp", &of_lamp).chain([("caustic.550nm".into(), band_value)]);
    let bytes = encode_map(map, size, others.collect(), "", "a file").expect("it fits");
    let image = decode(&bytes, "a file").expect("an image");
    assert_eq!((image.width, image.height), size);
    let one = |name: &str, expected: &dyn Fn(usize) -> f32| {
        let values = image.channel(name).unwrap_or_else(|| panic!("no {name}"));
        for (place, value) in values.iter().enumerate() {
            let texel = texel_at(place % size.0, place / size.0);
            assert_eq!(*value, expected(texel), "{name} at {place}");
        }
    };
    for (channel, letter) in ["R", "G", "B"].into_iter().enumerate() {
        one(&format!("caustic.{letter}"), &|texel| value(0, texel, channel));
        one(&format!("direct.{letter}"), &|texel| value(1, texel, channel));
        one(&format!("caustic.lamp.{letter}"), &|texel| {
            value(2, texel, channel)
        });
        one(letter, &|texel| {
            value(0, texel, channel) + value(1, texel, channel)
        });
    }
    one("error.Y", &|texel| value(3, texel, 0));
    one("caustic.550nm", &|texel| value(2, texel, 1));
}

#[test]
fn channels_hold_their_values_row_by_row() {
    let map = map(plane().chart(7, 5));
    assert_file(&map, |column, row| row * 7 + column);
}

#[test]
fn tiles_hold_each_texel_where_it_reaches() {
    // 3 × 2 tiles, the last column and row of which are cut, of every level that fits them.
    let levels = [0, 1, 2, 3, 1, 1];
    let layout = Arc::new(TileLayout::new((152, 104), &levels, &levels));
    let map = map(plane().tiled_chart(&layout).expect("an even chart"));
    let tiles: Vec<_> = layout.tiles().collect();
    assert!(tiles.iter().any(|tile| tile.level > 1), "{tiles:?}");
    assert_file(&map, |column, row| {
        let tile = &tiles[row / 64 * 3 + column / 64];
        let [x, y] = [column - tile.origin.0, row - tile.origin.1].map(|finest| finest >> tile.level);
        tile.texels.start + y * tile.size.0 + x
    });
}

#[test]
fn a_larger_file_holds_the_same_light() {
    let map = map(plane().chart(4, 3));
    let (width, height) = (10, 7);
    let bytes = encode_map(&map, (width, height), Vec::new(), "", "a file").expect("it fits");
    let image = decode(&bytes, "a file").expect("an image");
    let values = image.channel("caustic.G").expect("there");
    let texels = || map.layers[0].irradiance.iter().map(|e| f64::from(e[1]));
    // Means over the same surface.
    let mean = values.iter().map(|value| f64::from(*value)).sum::<f64>() / (width * height) as f64;
    assert!((mean / (texels().sum::<f64>() / 12.0) - 1.0).abs() < 1e-6);
    // The first texel of the file lies within the first of the map.
    assert_eq!(values[0], map.layers[0].irradiance[0][1]);
    assert_eq!(values[width * height - 1], map.layers[0].irradiance[11][1]);
}

type Open = fn(&Path, bool) -> Result<()>;

const KINDS: [(&str, Open); 3] = [
    ("a bake", |path, force| MapFolder::open(path, force).map(drop)),
    ("an export of textures", |path, force| {
        TextureFolder::open(path, force).map(drop)
    }),
    ("this shard", |path, force| {
        let share = ShardIndex::new(1, 2).expect("a share");
        ShardFolder::open(path, share, force).map(drop)
    }),
];

#[test]
fn others_folders_are_taken_only_by_force() {
    let around = folder();
    let photos = around.path().join("photos");
    std::fs::create_dir(&photos).expect("writable");
    std::fs::write(photos.join("cat.jpg"), "a cat").expect("writable");
    // Files of our names do not make it ours.
    for foreign in ["manifest.json", "index.json", "shard.json"] {
        for (kind, open) in KINDS {
            let refused = open(&photos, false).expect_err("it is not ours");
            says(refused, &format!("photos | not from {kind} | --force"));
            open(&photos, true).expect("by force");
        }
        std::fs::write(photos.join(foreign), r#"{"name": "an app"}"#).expect("writable");
    }
    let refused = FrameFolder::open(&photos).expect_err("it is not ours");
    says(refused, "photos | not frames");
    assert_eq!(
        names(&photos),
        ["cat.jpg", "index.json", "manifest.json", "shard.json"]
    );
    std::fs::write(photos.join("frame-00001.png"), "").expect("writable");
    FrameFolder::open(&photos).expect("frames of an earlier time are replaced");
}

#[test]
fn folders_are_made_for_a_result_alone() {
    let around = folder();
    let deep = around.path().join("x/y");
    for (kind, open) in KINDS {
        open(&deep, false).expect("writable");
        assert_eq!(names(around.path()), [""; 0], "{kind}: nothing was written");
    }
    let file = around.path().join("file");
    std::fs::write(&file, "kept").expect("writable");
    for (_, open) in KINDS {
        for place in [&file, &file.join("below")] {
            says(open(place, true).expect_err("a file"), "file");
        }
    }
    assert_eq!(std::fs::read(&file).expect("there"), b"kept");
}

#[test]
fn maps_are_replaced_file_by_file() {
    let baked = Baked::quick(built_in("mirror"), &[LayerKind::Caustic]);
    let out = baked.path("out");
    std::fs::write(out.join("notes.txt"), "keep me").expect("writable");
    std::fs::write(out.join("maps/other.exr"), "not ours").expect("writable");
    let first = names(&out.join("maps"));
    // Another scene: other surfaces receive light, with coordinates of their own.
    let (scene, settings) = (two_lamps().scene(), to(0.03, 16));
    let result = bake(scene.clone(), &settings);
    let folder = MapFolder::open(&out, false).expect("it is ours");
    let manifest = folder.write(&scene, &settings, &result).expect("writable");
    let written = manifest
        .maps
        .iter()
        .flat_map(|map| [Some(&map.file), map.uv_file.as_ref()]);
    let own = written.filter_map(|file| file?.strip_prefix("maps/").map(str::to_string));
    let mut expected: Vec<String> = own.chain(["other.exr".to_string()]).collect();
    expected.sort();
    assert_eq!(names(&out.join("maps")), expected);
    assert_ne!(first, expected);
    assert_eq!(names(&out), ["manifest.json", "maps", "notes.txt"]);
}

struct Shards(tempfile::TempDir);

impl Shards {
    fn new() -> Self {
        Self(folder())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Bakes shard `number` of `count` to a folder of that name.
    fn bake(&self, name: &str, scene: &Scene, settings: &BakeSettings, (number, count): (u32, u32)) {
        let share = ShardIndex::new(number, count).expect("a share");
        let folder = ShardFolder::open(&self.path(name), share, false).expect("writable");
        let mut session = Baker::new(Arc::new(scene.clone())).expect("a session");
        let sums = session.bake_shard(settings, share, &(), &Control::default());
        let sums = sums.expect("a shard");
        let origin = SceneOrigin {
            source: scene.source.clone(),
            default_light: false,
            solid_glass: false,
            environment: None,
        };
        let manifest = ShardManifest::new(scene, origin, settings, share, &sums);
        folder.write(&manifest, &sums).expect("writable");
    }

    fn open(&self, names: &str) -> Result<ShardSet> {
        let folders: Vec<PathBuf> = names.split(' ').map(|name| self.path(name)).collect();
        ShardSet::open(&folders)
    }

    #[track_caller]
    fn refuse(&self, names: &str, words: &str) {
        says(self.open(names).expect_err(names), words);
    }
}

#[test]
fn shards_of_different_bakes_are_refused() {
    let (scene, settings) = (built_in("mirror"), photons(1e3, 16));
    let shards = Shards::new();
    for (name, share) in [("two1", (1, 2)), ("two2", (2, 2)), ("three2", (2, 3))] {
        shards.bake(name, &scene, &settings, share);
    }
    shards.bake("denser2", &scene, &photons(5e3, 16), (2, 2));
    shards.bake("other2", &built_in("ring"), &settings, (2, 2));
    std::fs::create_dir(shards.path("newer")).expect("made");
    let mut newer = read_json(&shards.path("two2/shard.json"));
    newer["program_version"] = "99.0.0".into();
    std::fs::write(shards.path("newer/shard.json"), newer.to_string()).expect("writable");
    std::fs::copy(shards.path("two2/sums.bin"), shards.path("newer/sums.bin")).expect("writable");
    for (names, words) in rows(
        "two1 => two1 | missing: 2
         three2 => three2 | missing: 1, 3
         two1 two1 => two1 | is shard 1, and so is
         two1 two2 two2 => two2 | is shard 2, and so is
         two1 three2 => three2 | 3 shards and not 2 | two1
         two1 denser2 => denser2 | density per sr | 5000 | 1000 | two1
         two1 other2 => other2 | another scene | two1
         two1 newer => newer | 99.0.0 | two1
         two1 nowhere => nowhere | no such file
         two1 . => holds no shard | --shard",
    ) {
        shards.refuse(names, words);
    }
    let set = shards.open("two2 two1").expect("in any order");
    set.check_scene(&scene).expect("it is of this scene");
    let other = set.check_scene(&built_in("ring")).expect_err("another scene");
    says(other, "builtin:ring | not the scene | two2");
}

#[test]
fn torn_shards_are_refused_by_name() {
    let shards = Shards::new();
    for number in [1, 2] {
        let name = format!("s{number}");
        shards.bake(&name, &built_in("mirror"), &photons(1e3, 16), (number, 2));
    }
    let [sums, json] = ["s2/sums.bin", "s2/shard.json"].map(|file| shards.path(file));
    let whole = std::fs::read(&sums).expect("written");
    for (bytes, word) in [
        (&whole[..whole.len() - 1], "ends before it should"),
        (&whole[..50], "ends before it should"),
        (&whole[..3], "ends before it should"),
        (b"", "ends before it should"),
        (&[&whole[..], b"x"].concat(), "longer than it should be"),
        (&[0; 100], "ends before it should"),
    ] {
        std::fs::write(&sums, bytes).expect("writable");
        shards.refuse("s1 s2", &format!("s2 | {word} | again"));
    }
    let others = std::fs::read(shards.path("s1/sums.bin")).expect("written");
    let others = [&others[..], &whole[..]].concat();
    std::fs::write(&sums, &others[..whole.len()]).expect("writable");
    let set = shards.open("s1 s2").expect("its length is right");
    says(
        set.pass(1, 0).expect_err("another's"),
        "s2 | damaged | shard.json | again",
    );
    std::fs::write(&sums, &whole).expect("writable");
    set.pass(1, 0).expect("they are its own again");
    let whole = std::fs::read(&json).expect("written");
    for bytes in [&whole[..whole.len() / 2], b"{}", b"[1]", b"", b"\xff"] {
        std::fs::write(&json, bytes).expect("writable");
        shards.refuse("s1 s2", "s2 | shard.json");
    }
    std::fs::write(&json, &whole).expect("writable");
    shards.open("s1 s2").expect("they are whole again");
}

#[test]
fn shards_do_not_take_each_others_folders() {
    let shards = Shards::new();
    let (scene, settings) = (built_in("mirror"), photons(1e3, 16));
    shards.bake("a", &scene, &settings, (1, 2));
    let first = std::fs::read(shards.path("a/sums.bin")).expect("written");
    let open = |number, force| {
        let share = ShardIndex::new(number, 2).expect("a share");
        ShardFolder::open(&shards.path("a"), share, force)
    };
    let refused = open(2, false).expect_err("it is shard 1's");
    says(refused, "a | holds shard 1 of 2 | --force");
    open(2, true).expect("by force");
    assert_eq!(std::fs::read(shards.path("a/sums.bin")).expect("there"), first);
    shards.bake("a", &scene, &settings, (1, 2));
}
