//! A folder of maps: what its manifest and files say, and that nothing in it is trusted when it is read back.

use nephroid::export::map_reader;
use nephroid::optics::glass::Glass;
use nephroid::settings::Wavelengths;

use super::Baked;
use crate::prelude::*;
use support::program::number;
use support::tools::{at, energy_fault};

#[test]
fn files_hold_the_watts_of_their_ledgers() {
    for scene in ["mirror", "slab", "ball"] {
        let settings = at(1e3, 32);
        let baked = Baked::new(built_in(scene), &settings);
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
        ..at(3e3, 32)
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
        ..at(1e3, 1)
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
    let refuse = |scene: &Scene, words: &str| {
        says(map_reader::read(&out, scene).expect_err(words), words);
    };
    refuse(&built_in("ring"), "builtin:mirror | builtin:ring | geometry");
    let missing = map_reader::read(&baked.path("nowhere"), &baked.scene).expect_err("nowhere");
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
        ("", json!({}), "no manifest"),
    ] {
        let mut manifest = sound.clone();
        *manifest.pointer_mut(place).expect("it is there") = value;
        write(&manifest);
        refuse(&baked.scene, words);
    }
    write(&sound);
    map_reader::read(&out, &baked.scene).expect("it is whole again");
    let file = out.join(map["file"].as_str().expect("a name"));
    std::fs::write(file, "no image").expect("writable");
    refuse(&baked.scene, "neither an OpenEXR");
}
