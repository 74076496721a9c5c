//! A folder of maps: what its manifest and files say, and that nothing in it is trusted when it is read back.

use std::sync::Arc;

use nephroid::export::map_reader;
use nephroid::optics::glass::Glass;
use nephroid::scene::{Material, Scene};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution, Wavelengths};
use serde_json::{Value, json};

use support::assert_close;
use support::tools::{at, builtin_scene, energy_fault};

use super::{Baked, assert_says};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn files_hold_the_watts_of_their_ledgers() {
    for scene in ["mirror", "slab", "ball"] {
        let settings = at(1e3, 32);
        let baked = Baked::new(builtin_scene(scene), &settings);
        assert_eq!(energy_fault(&baked.result), None, "{scene}");
        let manifest = baked.manifest();
        let energy = &manifest["energy_w"];
        let sum = |names: &[&str]| names.iter().map(|name| number(&energy[name])).sum::<f64>();
        let emitted = sum(&["emitted"]);
        assert!(emitted > 0.1, "{scene}: {emitted} W");
        let booked = sum(&["deposited", "absorbed", "escaped", "truncated"]);
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
fn a_maps_file_is_what_other_readers_expect() {
    let baked = Baked::quick(builtin_scene("mirror"), &[LayerKind::Caustic, LayerKind::Direct]);
    let image = baked.file(0);
    let mut names: Vec<&str> = image
        .channels
        .iter()
        .map(|channel| channel.name.as_str())
        .collect();
    names.sort_unstable();
    assert_eq!(
        names.join(" "),
        "B G R caustic.B caustic.G caustic.R direct.B direct.G direct.R error.Y"
    );
    let file = baked.path("out/maps/0000_floor.exr");
    let bytes = std::fs::read(file).expect("there");
    let meta = exr::meta::MetaData::read_from_buffered(bytes.as_slice(), true).expect("sound");
    let [header] = &meta.headers[..] else {
        panic!("not a single part")
    };
    assert_eq!(header.compression, exr::compression::Compression::ZIP16);
    let mut channels = header.channels.list.iter();
    assert!(channels.all(|channel| channel.sample_type == exr::meta::attribute::SampleType::F32));
}

#[test]
fn bands_of_the_spectrum_have_channels() {
    let settings = BakeSettings {
        wavelengths: Wavelengths::Rainbow,
        keep_spectrum: true,
        ..at(3e3, 32)
    };
    let mut scene = builtin_scene("ball");
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
fn threads_change_no_byte() {
    let scene = builtin_scene("ball");
    let files = |threads| {
        let settings = BakeSettings {
            threads,
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..at(1e3, 32)
        };
        let baked = Baked::new(scene.clone(), &settings);
        let read = |name: &String| std::fs::read(baked.path("out/maps").join(name)).expect("it is listed");
        let names = super::names(&baked.path("out/maps"));
        names.iter().map(read).collect::<Vec<_>>()
    };
    let one = files(1);
    for threads in [2, 3] {
        assert!(files(threads) == one, "{threads} threads");
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
        ..at(1e3, 1)
    };
    let baked = Baked::new(builtin_scene("mirror"), &settings);
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
    let baked = Baked::quick(builtin_scene("mirror"), &[LayerKind::Caustic]);
    let out = baked.path("out");
    let refuse = |scene: &Scene, words: &[&str]| {
        let refused = map_reader::read(&out, scene).expect_err(words[0]);
        assert_says(&refused, words);
    };
    refuse(
        &builtin_scene("ring"),
        &["builtin:mirror", "builtin:ring", "geometry"],
    );
    let missing = map_reader::read(&baked.path("nowhere"), &baked.scene).expect_err("nowhere");
    assert_says(&missing, &["nowhere", "no such file"]);
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
        ("", json!({}), "no manifest"),
    ] {
        let mut manifest = sound.clone();
        *manifest.pointer_mut(place).expect("it is there") = value;
        write(&manifest);
        refuse(&baked.scene, &[words]);
    }
    write(&sound);
    assert_eq!(
        map_reader::read(&out, &baked.scene)
            .expect("it is whole again")
            .0
            .len(),
        1
    );
    let file = out.join(map["file"].as_str().expect("a name"));
    std::fs::write(file, "no image").expect("writable");
    refuse(&baked.scene, &["neither an OpenEXR"]);
}
