//! Maps as textures: what is in the files, read by others' readers.

use image::ImageDecoder as _;
use nephroid::error::ErrorKind;
use nephroid::export::FloatImage;
use nephroid::export::map_reader::MapReader;
use nephroid::export::textures::{self, Content, Encoding, Exposure, TextureFolder, TextureOptions};
use nephroid::export::{Quantity, map_reader};
use nephroid::progress::Control;
use nephroid::scene::{LoadOptions, load};
use serde_json::{Value, json};

use crate::export::boxes;
use crate::program::{Sandbox, read_json};

const QUICK: &str = "--density 1e3 --map-resolution 64";
const LUMENS_PER_WATT: f64 = 683.0;

/// Colours of the one map of a folder [W/m²].
fn baked(sandbox: &Sandbox, folder: &str, prefix: &str) -> Vec<[f32; 3]> {
    let manifest = sandbox.manifest(folder);
    let file = manifest["maps"][0]["file"].as_str().expect("a name");
    let image = FloatImage::read(&sandbox.path(folder).join(file)).expect("it can be read");
    image.rgb(prefix).expect("it has the layer")
}

fn index(sandbox: &Sandbox, folder: &str) -> Value {
    read_json(&sandbox.path(folder).join("index.json"))
}

/// The texels of a float file by the image crate, which knows nothing of ours.
fn floats(sandbox: &Sandbox, file: &str) -> Vec<[f32; 3]> {
    let image = image::open(sandbox.path(file))
        .expect("it is an image")
        .to_rgb32f();
    image.pixels().map(|pixel| pixel.0).collect()
}

fn is_near(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * a.abs().max(b.abs())
}

#[test]
fn float_files_hold_the_maps_and_the_index_says_what_they_are() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK}"));
    let wanted = baked(&sandbox, "out", "");
    let run = sandbox.succeed("export out --format exr --bits 32 --json");
    assert_eq!(floats(&sandbox, "out/exr/0000_floor.exr"), wanted, "bit by bit");
    let index = index(&sandbox, "out/exr");
    let told = run.json();
    assert_eq!(
        (told["folder"].as_str(), &told["textures"]),
        (Some("out/exr"), &index["textures"])
    );
    let texture = &index["textures"][0];
    let map = &sandbox.manifest("out")["maps"][0];
    assert_eq!(index["unit"], "W/m^2");
    assert_eq!(index["exposure_stops"], 0.0);
    assert_eq!(index["scene"], sandbox.manifest("out")["scene"]);
    assert_eq!((&texture["width"], &texture["height"]), (&json!(64), &json!(64)));
    assert_eq!(
        (&texture["layers"], &texture["light"]),
        (&json!(["caustic"]), &Value::Null)
    );
    for name in ["surface", "node", "primitive", "side", "uv_set", "uv_file"] {
        assert_eq!(texture["maps"][0][name], map[name], "{name}");
    }
    assert_eq!(
        texture["maps"][0]["rectangle"],
        json!({ "x": 0, "y": 0, "width": 64, "height": 64 })
    );
    assert_eq!(texture["lost"]["relative_rmse"], 0.0);

    // Halves in every unit, brighter and darker.
    for (units, factor) in [
        ("E", 1.0),
        ("E/pi", std::f64::consts::FRAC_1_PI),
        ("lux", LUMENS_PER_WATT),
        ("lux/pi", LUMENS_PER_WATT * std::f64::consts::FRAC_1_PI),
    ] {
        for stops in [-2.0, 1.5] {
            sandbox.succeed(&format!(
                "export out --format exr --units {units} --exposure {stops} -o h"
            ));
            let factor = factor * f64::exp2(stops);
            for (found, wanted) in floats(&sandbox, "h/0000_floor.exr").iter().zip(&wanted) {
                for (found, wanted) in found.iter().zip(wanted) {
                    let (found, wanted) = (f64::from(*found), f64::from(*wanted) * factor);
                    // Eleven bits, and steps of 2^-24 below 2^-14.
                    let bound = (wanted.abs() * f64::exp2(-11.0) * 1.0001).max(f64::exp2(-25.0));
                    assert!(
                        (found - wanted).abs() <= bound,
                        "{units} {stops}: {found} of {wanted}"
                    );
                }
            }
        }
    }
}

#[test]
fn light_that_a_format_cannot_hold_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK}"));
    let peak = baked(&sandbox, "out", "")
        .as_flattened()
        .iter()
        .fold(0.0_f32, |a, b| a.max(*b));
    let stops = (65504.0 / peak).log2().ceil();
    let line = format!("export out --format exr --exposure {stops} -o t");
    let run = sandbox.run(&line);
    run.failed_in_one_sentence(1, &["0000_floor.exr", "65504", "--bits 32"]);
    assert_eq!(sandbox.files("."), ["out"], "nothing is left");
    // As it was advised.
    let advised = run.stderr.trim().rsplit(' ').next().expect("a number").to_owned();
    sandbox.succeed(&format!("export out --format exr --exposure {advised} -o t"));
    sandbox.succeed(&format!("{line} --bits 32"));
}

#[test]
fn a_png_says_its_exposure_and_what_is_lost() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:ring -o out {QUICK}"));
    let wanted = baked(&sandbox, "out", "");
    let decode = |share: f64, transfer: &str| match transfer {
        "linear" => share,
        _ if share <= 0.040_45 => share / 12.92,
        _ => ((share + 0.055) / 1.055).powf(2.4),
    };
    for (transfer, marks) in [("srgb", &b"sRGB"[..]), ("linear", b"gAMA\x00\x01\x86\xa0")] {
        sandbox.succeed(&format!(
            "export out --format png --transfer {transfer} --units lux -o t"
        ));
        let bytes = std::fs::read(sandbox.path("t/0000_floor.png")).expect("it is there");
        let has = |mark: &[u8]| bytes.windows(mark.len()).any(|window| window == mark);
        let index = index(&sandbox, "t");
        let stops = index["exposure_stops"].as_f64().expect("a number");
        assert!(
            has(marks) && has(format!("tEXtExposure\0{stops} stops").as_bytes()),
            "{stops}"
        );
        assert!(stops.fract() == 0.0 && has(b"tEXtUnit\0lx"));
        let png = image::load_from_memory(&bytes).expect("it is a PNG");
        assert_eq!(png.color(), image::ColorType::Rgb16);
        let (mut above, mut cut, mut all) = (0, 0.0, 0.0);
        for (pixel, wanted) in png.to_rgb16().pixels().zip(&wanted) {
            let wanted = wanted.map(|value| f64::from(value) * LUMENS_PER_WATT * stops.exp2());
            above += usize::from(wanted.iter().any(|value| *value > 1.0));
            for (code, wanted) in pixel.0.iter().zip(wanted) {
                (cut, all) = (cut + (wanted - 1.0).max(0.0), all + wanted);
                let found = decode(f64::from(*code) / 65535.0, transfer);
                assert!(
                    (found - wanted.clamp(0.0, 1.0)).abs() <= 2e-5,
                    "{found} of {wanted}"
                );
            }
        }
        let lost = &index["textures"][0]["lost"];
        assert_eq!(lost["above_texels"], above);
        assert!(is_near(
            lost["above_share"].as_f64().expect("a number"),
            cut / all,
            1e-3
        ));
        assert!(cut / all <= 0.005, "{}", cut / all);
    }
    // Nothing is cut where nothing may be; everything is where that is asked for, and told.
    let lost = |line: &str| sandbox.succeed(line).json()["textures"][0]["lost"].clone();
    assert_eq!(
        lost("export out --format png --cut 0 -o t --json")["above_texels"],
        0
    );
    assert!(lost("export out --format png --exposure 20 -o t --json")["above_share"].as_f64() > Some(0.9));
    let told = sandbox
        .succeed("export out --format png --exposure 20 -o t")
        .stdout;
    assert!(
        told.contains("texels above white") && told.contains("2^20"),
        "{told}"
    );
}

#[test]
fn a_radiance_file_holds_light_within_its_steps() {
    let sandbox = Sandbox::new();
    sandbox.succeed("bake builtin:ring -o out --density 1e3 --map-resolution 64x48");
    let wanted = baked(&sandbox, "out", "");
    for stops in [0.0, 3.0] {
        sandbox.succeed(&format!("export out --format hdr --exposure {stops} -o t"));
        let bytes = std::fs::read(sandbox.path("t/0000_floor.hdr")).expect("it is there");
        let decoder = image::codecs::hdr::HdrDecoder::new(&bytes[..]).expect("it is a Radiance file");
        assert_eq!(decoder.dimensions(), (64, 48));
        let stated = decoder.metadata().exposure.unwrap_or(1.0);
        assert_eq!(stated, f32::exp2(stops as f32));
        for (found, wanted) in floats(&sandbox, "t/0000_floor.hdr").iter().zip(&wanted) {
            let largest = wanted.iter().fold(0.0_f32, |a, b| a.max(*b));
            for (found, wanted) in found.iter().zip(wanted) {
                assert!(
                    (found / stated - wanted).abs() <= largest / 255.0,
                    "{found} of {wanted}"
                );
            }
        }
    }
}

/// Two boxes before a mirror, and a second lamp.
fn two_lamps() -> crate::glb::Glb {
    let mut file = boxes().with_light(
        "lamp",
        json!({ "type": "point", "intensity": 300.0, "color": [1.0, 0.5, 0.2] }),
    );
    let second = file.json["nodes"].as_array().expect("a list").len() - 1;
    file.json["nodes"][second]["translation"] = json!([-0.6, 1.7, 1.9]);
    file
}

#[test]
fn layers_and_lights_come_apart_and_add_up() {
    let sandbox = Sandbox::new();
    sandbox.write("boxes.glb", two_lamps().bytes());
    sandbox.succeed(&format!(
        "bake boxes.glb -o out --layers caustic,direct --per-light {QUICK}"
    ));
    sandbox.succeed("export out --format exr --bits 32 -o sum");
    sandbox.succeed("export out --format exr --bits 32 --layer each -o layers");
    let run = sandbox.succeed("export out --format exr --bits 32 --layer lights -o lights");
    assert_eq!(run.stderr, "");
    let entries = |folder: &str| {
        index(&sandbox, folder)["textures"]
            .as_array()
            .expect("a list")
            .clone()
    };
    let of_map = |folder: &str, node: &Value| -> Vec<Value> {
        let mut entries = entries(folder);
        entries.retain(|entry| &entry["maps"][0]["node"] == node);
        entries
    };
    let read = |folder: &str, entry: &Value| {
        floats(
            &sandbox,
            &format!("{folder}/{}", entry["file"].as_str().expect("a name")),
        )
    };
    assert_eq!(entries("sum").len(), 2);
    for whole in entries("sum") {
        let wanted = read("sum", &whole);
        assert!(wanted.as_flattened().iter().any(|value| *value > 0.0));
        for folder in ["layers", "lights"] {
            let parts = of_map(folder, &whole["maps"][0]["node"]);
            assert_eq!(parts.len(), 2, "{folder}");
            let images: Vec<_> = parts.iter().map(|entry| read(folder, entry)).collect();
            assert_ne!(images[0], images[1]);
            for (texel, wanted) in wanted.iter().enumerate() {
                for channel in 0..3 {
                    let sum: f32 = images.iter().map(|image| image[texel][channel]).sum();
                    let bound = 1e-5 * wanted[channel].abs() + 1e-9;
                    assert!(
                        (sum - wanted[channel]).abs() <= bound,
                        "{folder}: {sum} of {wanted:?}"
                    );
                }
            }
        }
        let lights = of_map("lights", &whole["maps"][0]["node"]);
        assert!(
            lights.iter().all(|entry| entry["light"] == "lamp"),
            "of one name, told apart"
        );
        // Its own coordinates come along.
        let uv_file = whole["maps"][0]["uv_file"].as_str().expect("they were generated");
        let original = std::fs::read(sandbox.path("out/maps").join(uv_file));
        assert_eq!(
            std::fs::read(sandbox.path("sum").join(uv_file)).ok(),
            original.ok()
        );
    }
    // One layer has the same files as each of them.
    sandbox.succeed("export out --format exr --bits 32 --layer direct -o one");
    for entry in entries("one") {
        assert_eq!(entry["layers"], json!(["direct"]));
        assert_eq!(read("one", &entry), read("layers", &entry));
    }
    let refused = |line: &str, words: &[&str]| sandbox.run(line).failed_in_one_sentence(1, words);
    refused(
        "export out --format exr --layer indirect",
        &["indirect", "--layers"],
    );
    sandbox.succeed(&format!("bake boxes.glb -o plain {QUICK}"));
    refused("export plain --format exr --layer lights", &["--per-light"]);
}

#[test]
fn nothing_black_lies_beside_a_surface() {
    let sandbox = Sandbox::new();
    sandbox.write("boxes.glb", two_lamps().bytes());
    sandbox.succeed(&format!("bake boxes.glb -o out {QUICK}"));
    sandbox.succeed("export out --format exr --bits 32 -o t");
    let source = sandbox.path("boxes.glb");
    let scene = load(&source.to_string_lossy(), &LoadOptions::default()).expect("it can be read");
    let (maps, _) = map_reader::read(&sandbox.path("out"), &scene).expect("we wrote it");
    let mut outside = 0;
    for (map, entry) in maps
        .iter()
        .zip(index(&sandbox, "t")["textures"].as_array().expect("a list"))
    {
        let (chart, total) = (&map.chart, map.total());
        let texture = floats(
            &sandbox,
            &format!("t/{}", entry["file"].as_str().expect("a name")),
        );
        let is_covered = |texel: &usize| chart.texel_area_m2(*texel) > 0.0;
        for texel in (0..chart.texel_count()).filter(is_covered) {
            assert_eq!(texture[texel], total[texel], "light on the surface stays");
        }
        // What lies outside holds values between those that are there, and their mean is no darker by half.
        let brightest = total.iter().fold(0.0_f32, |a, b| a.max(b[1]));
        let mean = |of: &mut dyn Iterator<Item = f32>| {
            let (sum, count) = of.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
            sum / count.max(1) as f32
        };
        let free: Vec<usize> = (0..chart.texel_count())
            .filter(|texel| !is_covered(texel))
            .collect();
        outside += free.len();
        assert!(
            free.iter()
                .all(|texel| (0.0..=brightest).contains(&texture[*texel][1]))
        );
        let inside = mean(
            &mut (0..chart.texel_count())
                .filter(is_covered)
                .map(|texel| total[texel][1]),
        );
        let beside = mean(&mut free.iter().map(|texel| texture[*texel][1]));
        assert!(beside > 0.5 * inside, "{beside} beside {inside}");
    }
    assert!(outside > 100, "{outside}: the charts leave room");
}

#[test]
fn an_export_replaces_its_own_and_nothing_else() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    sandbox.succeed("export out --format exr --layer each -o t");
    assert_eq!(sandbox.files("t"), ["0000_floor_caustic.exr", "index.json"]);
    sandbox.succeed("export out --format png -o t");
    assert_eq!(
        sandbox.files("t"),
        ["0000_floor.png", "index.json"],
        "what was there more is gone"
    );
    // Other people's files.
    std::fs::create_dir(sandbox.path("theirs")).expect("it can be made");
    sandbox.write("theirs/index.json", "{}");
    let refused = |line: &str, code: i32, words: &[&str]| {
        sandbox.run(line).failed_in_one_sentence(code, words);
    };
    refused("export out --format exr -o theirs", 1, &["theirs", "--force"]);
    refused("export out --format exr -o out", 1, &["--force"]);
    assert_eq!(
        std::fs::read(sandbox.path("theirs/index.json")).expect("there"),
        b"{}"
    );
    sandbox.write("theirs/letter.txt", "kept");
    sandbox.succeed("export out --format exr -o theirs --force");
    assert_eq!(
        sandbox.files("theirs"),
        ["0000_floor.exr", "index.json", "letter.txt"]
    );
    refused("export out --format exr -o theirs/letter.txt", 1, &["letter.txt"]);
    std::fs::create_dir(sandbox.path("t/0000_floor.hdr")).expect("it can be made");
    refused("export out --format hdr -o t", 1, &["0000_floor.hdr", "folder"]);
    assert_eq!(
        sandbox.files("t"),
        ["0000_floor.hdr", "0000_floor.png", "index.json"]
    );
    for (line, word) in [
        ("export out --format exr --bits 8", "--bits"),
        ("export out --format png --bits 32", "--bits"),
        ("export out --format hdr --bits 16", "--bits"),
        ("export out --format exr --cut 1%", "--cut"),
        ("export out --format exr --as unlit", "--as"),
        ("export out --format exr --lights keep", "--lights"),
        ("export out --format hdr --transfer linear", "--transfer"),
        ("export out --format png --cut 1% --exposure 1", "--cut"),
        ("export out --format png --exposure 65", "--exposure"),
        ("export out --layer sum", "--layer"),
        ("export out --bits 32", "--bits"),
        ("export out --force", "--force"),
        ("export out --transfer srgb", "--transfer"),
        ("export out --format bmp", "--format"),
    ] {
        refused(line, 2, &[word]);
    }
}

#[test]
fn a_cancelled_export_leaves_nothing() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    let scene = load("builtin:mirror", &LoadOptions::default()).expect("it is built in");
    let maps = sandbox.path("out");
    let reader = MapReader::open(&maps, &scene).expect("we wrote it");
    let options = TextureOptions {
        encoding: Encoding::Half,
        quantity: Quantity::Irradiance,
        content: Content::Sum,
        exposure: Exposure::Stops(0.0),
        atlas_side: None,
    };
    let export = |control: &Control| {
        let folder = TextureFolder::open(&sandbox.path("t"), false).expect("it can be written");
        textures::write(&reader, options, folder, control)
    };
    let control = Control::default();
    control.cancel();
    let error = export(&control).expect_err("it was cancelled");
    assert_eq!(error.kind, ErrorKind::Cancelled);
    assert_eq!(sandbox.files("."), ["out"]);
    export(&Control::default()).expect("nobody cancels this one");
    assert_eq!(sandbox.files("t"), ["0000_floor.exr", "index.json"]);
}

#[test]
fn an_atlas_holds_all_maps_where_its_index_says() {
    let sandbox = Sandbox::new();
    sandbox.write("boxes.glb", two_lamps().bytes());
    sandbox.succeed(&format!(
        "bake boxes.glb -o out --layers caustic,direct --per-light {QUICK}"
    ));
    for (layer, options) in [("sum", ""), ("each", "--bits 32"), ("lights", "")] {
        let line = format!("export out --format exr {options} --layer {layer}");
        sandbox.succeed(&format!("{line} -o apart"));
        sandbox.succeed(&format!("{line} --atlas -o together"));
        let apart = index(&sandbox, "apart")["textures"]
            .as_array()
            .expect("a list")
            .clone();
        let together = index(&sandbox, "together")["textures"]
            .as_array()
            .expect("a list")
            .clone();
        assert_eq!(2 * together.len(), apart.len(), "two maps in each");
        for single in &apart {
            let map = &single["maps"][0];
            let holds = |entry: &&Value| {
                let same = ["layers", "light"].iter().all(|name| entry[name] == single[name]);
                same && single_key(single) == single_key(entry)
            };
            let entry = together.iter().find(holds).expect("it is in one");
            let maps = entry["maps"].as_array().expect("a list");
            let placed = maps
                .iter()
                .find(|placed| placed["node"] == map["node"])
                .expect("it is there");
            let number = |name: &str| placed["rectangle"][name].as_u64().expect("a number") as usize;
            let (x, y, width, height) = (number("x"), number("y"), number("width"), number("height"));
            assert_eq!(
                (single["width"].as_u64(), single["height"].as_u64()),
                (Some(width as u64), Some(height as u64))
            );
            let wide = entry["width"].as_u64().expect("a number") as usize;
            let file =
                |folder: &str, entry: &Value| format!("{folder}/{}", entry["file"].as_str().expect("a name"));
            let own = floats(&sandbox, &file("apart", single));
            let all = floats(&sandbox, &file("together", entry));
            for row in 0..height + 4 {
                for column in 0..width + 4 {
                    // Two texels around it go on with those at its border.
                    let inside = |at: usize, side: usize| at.saturating_sub(2).min(side - 1);
                    let wanted = own[inside(row, height) * width + inside(column, width)];
                    assert_eq!(all[(y + row - 2) * wide + x + column - 2], wanted, "{layer}");
                }
            }
            let uv_file = placed["uv_file"].as_str().expect("they were generated");
            assert!(sandbox.files("together").iter().any(|file| file == uv_file));
        }
    }
    // Smaller ones hold fewer; too small ones none.
    sandbox.succeed("export out --format png --atlas 70 -o small");
    assert_eq!(
        sandbox
            .files("small")
            .iter()
            .filter(|file| file.ends_with(".png"))
            .count(),
        2
    );
    let refused = |line: &str, code: i32, words: &[&str]| {
        sandbox.run(line).failed_in_one_sentence(code, words);
    };
    refused(
        "export out --format png --atlas 67 -o none",
        1,
        &["the map of", "64x64", "--atlas"],
    );
    refused("export out --format png --atlas 5 -o none", 2, &["--atlas"]);
    refused("export out --format ktx2 --atlas --mips -o none", 2, &["--mips"]);
    refused("export out --atlas", 2, &["--atlas"]);
    assert!(!sandbox.path("none").exists());
}

/// What the end of a texture's name says of its content.
fn single_key(entry: &Value) -> String {
    let name = entry["file"].as_str().expect("a name").trim_end_matches(".exr");
    let ends = ["caustic", "direct", "lamp", "lamp-0", "lamp-1"];
    let end = name.rsplit('_').next().unwrap_or_default();
    ends.iter()
        .find(|known| **known == end)
        .map_or(String::new(), |end| (*end).to_owned())
}
