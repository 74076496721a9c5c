//! What a bake leaves: manifest and maps.

use nephroid::export::FloatImage;
use serde_json::Value;

use crate::program::Sandbox;

const QUICK: &str = "--density 1e4 --map-resolution 64x32";

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Whether an object has exactly these keys, in any order.
#[track_caller]
fn assert_keys(object: &Value, expected: &[&str]) {
    let mut keys: Vec<&str> = object
        .as_object()
        .expect("an object")
        .keys()
        .map(String::as_str)
        .collect();
    let mut expected = expected.to_vec();
    keys.sort_unstable();
    expected.sort_unstable();
    assert_eq!(keys, expected);
}

#[test]
fn the_manifest_has_every_field() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!(
        "bake builtin:slab -o out {QUICK} --layers direct,caustic"
    ));
    let manifest = sandbox.manifest("out");
    assert_keys(
        &manifest,
        &[
            "schema",
            "program_version",
            "settings",
            "scene",
            "partial",
            "stop_reason",
            "warnings",
            "timings_s",
            "cpu_s",
            "counts",
            "effects",
            "item_buffers",
            "forecast",
            "course",
            "energy_w",
            "ledgers",
            "error",
            "maps",
        ],
    );
    assert_eq!(manifest["schema"], 1);
    assert_eq!(manifest["program_version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(manifest["partial"], false);
    assert_eq!(manifest["stop_reason"], "density");
    assert_eq!(manifest["scene"]["source"], "builtin:slab");
    assert_eq!(number(&manifest["settings"]["density_per_sr"]), 1e4);
    for clock in ["timings_s", "cpu_s"] {
        assert_keys(
            &manifest[clock],
            &["load", "build", "plan", "trace", "deposit", "total"],
        );
        let parts: f64 = ["load", "build", "plan", "trace", "deposit"]
            .iter()
            .map(|stage| number(&manifest[clock][stage]))
            .sum();
        let total = number(&manifest[clock]["total"]);
        assert!(parts <= total * 1.001 + 1e-3, "{clock}: {parts} of {total}");
    }
    assert_keys(
        &manifest["counts"],
        &[
            "rays",
            "item_buffer_rays",
            "item_buffer_tests",
            "segments",
            "shadow_rays",
            "gather_rays",
            "gather_segments",
            "bounces",
            "receiver_queries",
            "splats",
            "cells",
        ],
    );
    assert!(number(&manifest["counts"]["rays"]) > 0.0);
    assert!(number(&manifest["counts"]["shadow_rays"]) > 0.0);
    let error = number(&manifest["error"]["estimated_relative_rmse"]);
    assert!((1e-6..0.2).contains(&error), "an error of {error}");
    let of_map = number(&manifest["maps"][0]["estimated_relative_rmse"]);
    assert!(of_map > 0.0 && of_map <= error * 1.000_001, "{of_map} of {error}");
    let map = &manifest["maps"][0];
    assert_keys(
        map,
        &[
            "surface",
            "node",
            "primitive",
            "side",
            "file",
            "width",
            "height",
            "uv_set",
            "uv_file",
            "layers",
            "texel_area_m2",
            "units",
            "estimated_relative_rmse",
            "memory_bytes",
            "dense_bytes",
        ],
    );
    assert_eq!((&map["width"], &map["height"]), (&64.into(), &32.into()));
    assert_eq!(map["units"], "W/m^2");
    assert_eq!(map["layers"], serde_json::json!(["caustic", "direct"]));
}

#[test]
fn the_ledger_closes_and_agrees_with_the_maps() {
    let sandbox = Sandbox::new();
    for scene in ["mirror", "slab", "ball"] {
        sandbox.succeed(&format!("bake builtin:{scene} -o out {QUICK}"));
        let manifest = sandbox.manifest("out");
        let energy = &manifest["energy_w"];
        assert_keys(
            energy,
            &[
                "emitted",
                "deposited",
                "absorbed",
                "escaped",
                "truncated",
                "truncated_by_cause",
            ],
        );
        let emitted = number(&energy["emitted"]);
        let accounts = ["deposited", "absorbed", "escaped", "truncated"];
        let sum: f64 = accounts.iter().map(|account| number(&energy[account])).sum();
        assert!(emitted > 0.1, "{scene}: {emitted} W");
        assert!(
            (emitted - sum).abs() < 1e-6 * emitted,
            "{scene}: {emitted} W, {sum} W"
        );
        let by_light: f64 = manifest["ledgers"]
            .as_array()
            .expect("ledgers")
            .iter()
            .map(|ledger| number(&ledger["energy_w"]["emitted"]))
            .sum();
        assert!((emitted - by_light).abs() < 1e-9 * emitted, "{scene}");

        // Maps in 32-bit floats hold the deposited watts.
        let flux: f64 = manifest["maps"]
            .as_array()
            .expect("maps")
            .iter()
            .map(|map| {
                let file = sandbox.path("out").join(map["file"].as_str().expect("a path"));
                let luminance = FloatImage::read(&file)
                    .expect("a map")
                    .luminance("caustic")
                    .expect("a layer");
                luminance.values.iter().sum::<f64>() * number(&map["texel_area_m2"])
            })
            .sum();
        let deposited = number(&energy["deposited"]);
        assert!(
            (flux - deposited).abs() < 1e-5 * deposited,
            "{scene}: {flux} W in maps, {deposited} W deposited"
        );
    }
}

#[test]
fn maps_are_read_back_channel_by_channel() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!(
        "bake builtin:mirror -o out {QUICK} --layers caustic,direct"
    ));
    let manifest = sandbox.manifest("out");
    let file = manifest["maps"][0]["file"].as_str().expect("a path");
    let image = FloatImage::read(&sandbox.path("out").join(file)).expect("a map");
    assert_eq!((image.width, image.height), (64, 32));
    let mut names: Vec<&str> = image
        .channels
        .iter()
        .map(|channel| channel.name.as_str())
        .collect();
    names.sort_unstable();
    assert_eq!(
        names,
        [
            "B",
            "G",
            "R",
            "caustic.B",
            "caustic.G",
            "caustic.R",
            "direct.B",
            "direct.G",
            "direct.R",
            "error.Y"
        ]
    );
    let (caustic, direct) = (
        image.rgb("caustic").expect("there"),
        image.rgb("direct").expect("there"),
    );
    for (texel, sum) in image.rgb("").expect("there").iter().enumerate() {
        for channel in 0..3 {
            let expected = caustic[texel][channel] + direct[texel][channel];
            assert!(
                (sum[channel] - expected).abs() <= 1e-6 * expected,
                "texel {texel}"
            );
        }
    }
    assert!(caustic.iter().flatten().any(|value| *value > 0.0));
    assert!(direct.iter().flatten().any(|value| *value > 0.0));
    // Another program's reader agrees on the form.
    let bytes = std::fs::read(sandbox.path("out").join(file)).expect("there");
    let meta = exr::meta::MetaData::read_from_buffered(bytes.as_slice(), true).expect("sound");
    assert_eq!(meta.headers.len(), 1, "single part");
    assert_eq!(meta.headers[0].compression, exr::compression::Compression::ZIP16);
    assert!(
        meta.headers[0]
            .channels
            .list
            .iter()
            .all(|channel| channel.sample_type == exr::meta::attribute::SampleType::F32)
    );
}

#[test]
fn stdout_is_one_json_document_the_manifest() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK} --json"));
    assert_eq!(run.json(), sandbox.manifest("out"));
    assert_eq!(run.stderr, "");
    let run = sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    for word in [
        "maps/",
        "rays",
        "splats",
        "emitted",
        "deposited",
        "escaped",
        "seconds",
    ] {
        assert!(run.stdout.contains(word), "no {word:?} in: {}", run.stdout);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let sandbox = Sandbox::new();
    for threads in ["1", "2", "4"] {
        sandbox.succeed(&format!(
            "bake builtin:ball -o {threads} {QUICK} --threads {threads} --layers caustic,direct"
        ));
        assert_eq!(sandbox.files("1/maps"), sandbox.files(format!("{threads}/maps")));
        for file in sandbox.files("1/maps") {
            let read =
                |folder: &str| std::fs::read(sandbox.path(folder).join("maps").join(&file)).expect("there");
            assert!(read("1") == read(threads), "{file} with {threads} threads");
        }
    }
}

#[test]
fn bands_of_the_spectrum_are_kept_where_asked_for() {
    let sandbox = Sandbox::new();
    sandbox.succeed(
        "bake builtin:prism -o out --density 1.2e7 --map-resolution 64 --wavelengths rainbow --keep-spectrum",
    );
    let manifest = sandbox.manifest("out");
    let ledger = &manifest["ledgers"][0];
    let [emitted, deposited] =
        ["emitted_radiant_w", "deposited_radiant_w"].map(|key| ledger[key].as_f64().expect("watts"));
    assert!(0.0 < deposited && deposited < emitted, "{ledger}");
    let maps = manifest["maps"].as_array().expect("maps");
    let wall = maps
        .iter()
        .find(|map| map["surface"] == "wall")
        .expect("the wall's");
    let bands = wall["bands"].as_array().expect("bands");
    assert_eq!(bands.len(), 7);
    let edges = |key: &str| {
        bands
            .iter()
            .map(|band| band[key].as_f64().expect("nm"))
            .collect::<Vec<_>>()
    };
    let (from, to) = (edges("from_nm"), edges("to_nm"));
    assert_eq!(from[1..], to[..6], "bands meet");
    let file = wall["file"].as_str().expect("a file");
    let image = FloatImage::read(&sandbox.path("out").join(file)).expect("a map");
    for band in bands {
        let name = band["channel"].as_str().expect("a channel");
        let channel = image.channels.iter().find(|channel| channel.name == name);
        let values = &channel.unwrap_or_else(|| panic!("no {name}")).values;
        assert!(values.iter().any(|value| *value > 0.0), "{name} is dark");
    }
    for (arguments, words) in [
        ("--keep-spectrum", "no bands to keep"),
        ("--wavelengths 0", "outside 1 to 1000"),
        ("--wavelengths many", "a number, `rainbow` or `continuous`"),
        ("--spectral-sampling split", "interpolated, not sampled"),
    ] {
        let run = sandbox.run(&format!("bake builtin:prism -o no {arguments}"));
        assert_eq!(run.code, 2, "{arguments}: {}", run.stderr);
        assert!(run.stderr.contains(words), "{}", run.stderr);
    }
}
