//! Every command once, from its arguments to its files; and `render`: pictures of maps that were baked before, or are baked
//! for it.

use nephroid::export::FloatImage;
use nephroid::eye_pass::{ToneMap, WhiteBalance, tone_mapping};
use strum::VariantArray;

use super::without_card;
use crate::export::boxes;
use crate::prelude::*;
use support::files;
use support::program::{Run, Sandbox, number};

const QUICK: &str = "--density 1e3 --map-resolution 32";

#[track_caller]
fn assert_keys(object: &Value, expected: &str) {
    let keys = object.as_object().expect("an object").keys();
    let mut keys: Vec<&str> = keys.map(String::as_str).collect();
    let mut expected: Vec<&str> = expected.split_whitespace().collect();
    keys.sort_unstable();
    expected.sort_unstable();
    assert_eq!(keys, expected);
}

/// A frame of a sequence is what is baked at its time alone, and the moment behind the last is the first.
#[test]
fn frames_are_the_moments_of_their_times() {
    let sandbox = Sandbox::new();
    let loops = format!("--frames 3 --fps 4 --loop {QUICK}");
    sandbox.succeed(&format!("bake builtin:pool -o all {loops}"));
    let manifest = sandbox.manifest("all");
    let frames = manifest["sequence"]["frames"].as_array().expect("frames");
    let times: Vec<f64> = frames.iter().map(|frame| number(&frame["time_s"])).collect();
    assert_eq!(times, [0.0, 0.25, 0.5]);
    assert!(frames[1]["geometry_hash"] != frames[0]["geometry_hash"]);
    let bytes = |file: &str| std::fs::read(sandbox.path(file)).expect("it was written");
    for (time_s, frame) in [(0.25, 2), (0.5, 3), (0.75, 1)] {
        sandbox.succeed(&format!("bake builtin:pool -o one --time {time_s} {loops}"));
        let file = format!("all/maps/0000_floor/{frame:04}.exr");
        assert!(bytes("one/maps/0000_floor.exr") == bytes(&file), "{time_s} s");
    }
    assert!(bytes("all/maps/0000_floor/0001.exr") != bytes("all/maps/0000_floor/0002.exr"));
    // A shorter one takes its place whole, and a still one that of both.
    sandbox.succeed(&format!("bake builtin:pool -o all --frames 2 {QUICK}"));
    assert!(!sandbox.path("all/maps/0000_floor/0003.exr").exists());
    sandbox.succeed(&format!("bake builtin:pool -o all {QUICK}"));
    assert!(!sandbox.path("all/maps/0000_floor/0001.exr").exists());
    let picture = "--size 32x24 --backend cpu";
    sandbox.succeed(&format!(
        "render builtin:pool -o pictures --frames 2 {QUICK} {picture}"
    ));
    assert!(sandbox.path("pictures/frame-00002.png").exists());
    for (refused, code, why) in [
        (
            format!("bake builtin:ring -o ring --time 1 {QUICK}"),
            1,
            "nothing in it moves",
        ),
        (
            "bake builtin:pool -o auto --frames 2".to_string(),
            2,
            "--map-resolution",
        ),
        (
            format!("bake builtin:pool -o off --time 1 --effects motion=off {QUICK}"),
            2,
            "motion=off",
        ),
    ] {
        sandbox.run(&refused).failed_in_one_sentence(code, &[why]);
    }
}

#[test]
fn programs_read_progress_line_by_line() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed("bake builtin:mirror -o out --density 1e4 --map-resolution 64 --progress json");
    let lines: Vec<Value> = run
        .stderr
        .lines()
        .map(|line| serde_json::from_str(line).expect("a line of JSON"))
        .collect();
    let last = lines.last().expect("progress of a bake");
    assert_eq!(last["stage"], "caustic");
    assert_eq!(last["done"], last["total"]);
}

#[test]
fn bake_prints_the_manifest_that_it_writes() {
    let sandbox = Sandbox::new();
    let bake = "bake builtin:mirror -o out --density 1e6 --map-resolution 64x32 --layers direct,caustic";
    let run = sandbox.succeed(&format!("{bake} --json"));
    let manifest = sandbox.manifest("out");
    assert_eq!((run.json(), run.stderr.as_str()), (manifest.clone(), ""));
    assert_keys(
        &manifest,
        "schema program_version settings scene partial stop_reason warnings timings_s cpu_s counts effects \
         item_buffers forecast course energy_w ledgers error maps",
    );
    assert_eq!(manifest["schema"], 1);
    assert_eq!(manifest["program_version"], env!("CARGO_PKG_VERSION"));
    assert!(manifest["partial"] == false && manifest["stop_reason"] == "density");
    assert_eq!(manifest["scene"]["source"], "builtin:mirror");
    assert_eq!(number(&manifest["settings"]["density_per_sr"]), 1e6);
    let stages = ["load", "build", "plan", "trace", "deposit"];
    for clock in ["timings_s", "cpu_s"] {
        assert_keys(&manifest[clock], &format!("{} total", stages.join(" ")));
        let parts: f64 = stages.iter().map(|stage| number(&manifest[clock][stage])).sum();
        let total = number(&manifest[clock]["total"]);
        assert!(parts <= total * 1.001 + 1e-3, "{clock}: {parts} of {total}");
    }
    let counts = &manifest["counts"];
    assert_keys(
        counts,
        "rays item_buffer_rays item_buffer_tests segments shadow_rays gather_rays gather_segments bounces \
         receiver_queries splats cells",
    );
    assert!(number(&counts["rays"]) > 0.0 && number(&counts["shadow_rays"]) > 0.0);
    assert_keys(
        &manifest["energy_w"],
        "emitted deposited absorbed escaped truncated truncated_by_cause sampling",
    );
    let map = &manifest["maps"][0];
    assert_keys(
        map,
        "surface node primitive side file width height uv_set uv_file layers texel_area_m2 units \
         estimated_relative_rmse estimated_visible memory_bytes dense_bytes",
    );
    let error = number(&manifest["error"]["estimated_relative_rmse"]);
    assert!((1e-6..0.2).contains(&error), "an error of {error}");
    let of_map = number(&map["estimated_relative_rmse"]);
    assert!(of_map > 0.0 && of_map <= error * 1.000_001, "{of_map} of {error}");
    assert!(
        map["width"] == 64 && map["height"] == 32 && map["units"] == "W/m^2",
        "{map}"
    );
    assert_eq!(map["layers"], json!(["caustic", "direct"]));
    // Again for people, over the first one.
    let text = sandbox.succeed(bake).stdout;
    for word in [
        "maps/",
        "rays",
        "splats",
        "emitted",
        "deposited",
        "escaped",
        "seconds",
    ] {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
}

#[test]
fn merged_shards_are_the_bake_bit_by_bit() {
    let sandbox = Sandbox::new();
    sandbox.write("lamps.glb", files::mirror_under_lamps());
    let bake = "bake lamps.glb --density 4000 --map-resolution 24 --layers caustic,direct --per-light";
    sandbox.succeed(&format!("{bake} -o whole"));
    for number in [1, 2] {
        let shard = sandbox.succeed(&format!("{bake} --shard {number}/2 -o part{number} --json"));
        assert_eq!(shard.json()["shard"]["number"], number);
        assert_eq!(sandbox.files(format!("part{number}")), ["shard.json", "sums.bin"]);
    }
    // The scene was moved meanwhile.
    std::fs::rename(sandbox.path("lamps.glb"), sandbox.path("moved.glb")).expect("it can be moved");
    let gone = sandbox.run("merge part2 part1 -o merged");
    gone.failed_in_one_sentence(1, &["lamps.glb", "there is no such file"]);
    sandbox.succeed("merge part2 part1 -o merged --scene moved.glb");
    let [whole, merged] = ["whole", "merged"].map(|folder| sandbox.manifest(folder));
    for name in ["ledgers", "energy_w", "error"] {
        assert_eq!(whole[name], merged[name], "{name}");
    }
    let names = sandbox.files("whole/maps");
    assert!(!names.is_empty());
    assert_eq!(sandbox.files("merged/maps"), names);
    for name in names {
        let [whole, merged] = ["whole", "merged"].map(|folder| {
            std::fs::read(sandbox.path(folder).join("maps").join(&name)).expect("it is listed")
        });
        assert!(whole == merged, "{name}");
    }
    // A bit that turned on the disk.
    let mut sums = std::fs::read(sandbox.path("part2/sums.bin")).expect("written");
    let late = sums.len() - 40;
    sums[late] ^= 0x10;
    sandbox.write("part2/sums.bin", sums);
    let torn = sandbox.run("merge part2 part1 -o torn --scene moved.glb");
    torn.failed_in_one_sentence(1, &["part2", "damaged", "again"]);
}

#[test]
fn export_writes_a_scene_or_textures() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!(
        "bake builtin:mirror -o out --layers caustic,direct {QUICK}"
    ));
    // Direct light was baked: the lamps go, unless they are to stay.
    for (options, file, layers) in [
        ("", "out/mirror.glb", json!(["caustic", "direct"])),
        ("-o kept.glb --lights keep", "kept.glb", json!(["caustic"])),
    ] {
        let run = sandbox.succeed(&format!("export out {options} --json"));
        let report = run.json();
        assert_eq!((&report["file"], &report["layers"]), (&json!(file), &layers));
        let bytes = std::fs::read(sandbox.path(file)).expect("it was written");
        assert_eq!(report["bytes"], bytes.len());
        // What lies below the floor is no part of what is drawn.
        assert_eq!(run.stderr.matches("warning: ").count(), 1);
        assert!(run.stderr.contains("light on its back too"), "{}", run.stderr);
        assert!(bytes.starts_with(b"glTF"));
    }
    let unlit = sandbox.succeed("export out -o unlit.glb --as unlit --exposure 1.5 --json");
    assert_eq!(unlit.json()["options"]["exposure_stops"], 1.5);
    for (options, folder, file) in [
        ("--format exr --bits 32", "out/exr", "0000_floor.exr"),
        ("--format png --exposure 20", "out/png", "0000_floor.png"),
        ("--format hdr --layer direct -o t", "t", "0000_floor_direct.hdr"),
        ("--format ktx2 --mips --packing bc6h -o k", "k", "0000_floor.ktx2"),
        ("--format exr --units lux --atlas -o a", "a", "atlas0.exr"),
    ] {
        let report = sandbox.succeed(&format!("export out {options} --json")).json();
        assert!(
            report["folder"] == folder && report["textures"][0]["file"] == file,
            "{report}"
        );
        let written = sandbox.files(folder);
        assert!(
            ["index.json", file]
                .iter()
                .all(|name| written.iter().any(|known| known == name))
        );
    }
    let told = sandbox.succeed("export out --format png --exposure 20").stdout;
    assert!(
        told.contains("texels above white") && told.contains("2^20"),
        "{told}"
    );
}

#[test]
fn view_without_display_writes_files() {
    let sandbox = Sandbox::new();
    let picture = |line: &str, display: &str| {
        let mut command = without_card(&sandbox, &format!("{line} {QUICK} --size 64x48 --exposure 0"));
        if !display.is_empty() {
            command.env("DISPLAY", display);
        }
        let run = Run::from(command.output().expect("the program starts"));
        assert_eq!(
            (run.code, run.stdout.as_str()),
            (0, "./nephroid-out/\n"),
            "{}",
            run.stderr
        );
        assert_eq!(run.stderr.matches("no display").count(), 1, "{}", run.stderr);
        let files = sandbox.files("nephroid-out").join(" ");
        assert_eq!(files, "manifest.json maps picture.png");
        assert_eq!(sandbox.manifest("nephroid-out")["partial"], false);
        let picture = image::open(sandbox.path("nephroid-out/picture.png")).expect("a PNG");
        assert_eq!((picture.width(), picture.height()), (64, 48));
        picture.to_rgb8()
    };
    let shown = picture("builtin:mirror", "");
    // A display that is not there.
    assert_eq!(picture("view builtin:mirror", ":987"), shown);
    let black = |picture: &image::RgbImage| picture.pixels().filter(|pixel| pixel.0 == [0; 3]).count();
    let without_chains = picture("builtin:mirror --effects chains=off", "");
    assert!(shown.pixels().any(|pixel| pixel.0[1] > 64));
    assert!(black(&without_chains) > black(&shown) + 20, "the mirror is black");
}

#[test]
fn study_lists_and_runs() {
    let sandbox = Sandbox::new();
    let list = sandbox.succeed("study --list --json").json();
    let list = list.as_array().expect("studies");
    for name in [
        "convergence",
        "reference",
        "effects",
        "spectrum",
        "accuracy",
        "table1",
    ] {
        assert!(list.iter().any(|study| study["name"] == name), "{name}");
    }
    let run = sandbox.succeed(
        "study convergence builtin:mirror -o out --densities 1e2,1e3 --estimators splat --quick --map-resolution 16",
    );
    let files = "convergence-cpu.svg convergence-rays.svg convergence.csv convergence.md";
    assert_eq!(sandbox.files("out").join(" "), files);
    let csv = std::fs::read_to_string(sandbox.path("out/convergence.csv")).expect("a table");
    assert_eq!(csv.lines().count(), 3);
    assert!(csv.starts_with("estimator,density_per_sr,rays,"), "{csv}");
    assert!(run.stdout.contains("| splat |"), "{}", run.stdout);
}

const SMALL: &str = "--density 1e3 --map-resolution 32 --size 40x30";

fn radiance(sandbox: &Sandbox, file: &str) -> Picture {
    let image = FloatImage::read(&sandbox.path(file)).expect("a picture");
    Picture {
        width: image.width as u32,
        height: image.height as u32,
        radiance: image.rgb("").expect("R, G, B"),
    }
}

#[test]
fn stored_maps_look_as_those_baked_for_it() {
    let sandbox = Sandbox::new();
    // Their coordinates are made by the bake.
    sandbox.write("boxes.glb", boxes().bytes());
    sandbox.succeed(&format!("render boxes.glb -o fresh.exr --backend cpu {SMALL}"));
    sandbox
        .succeed("bake boxes.glb -o maps --density 1e3 --map-resolution 32 --layers caustic,direct,indirect");
    sandbox.succeed("render boxes.glb -o stored.exr --size 40x30 --backend cpu --maps maps");
    let [fresh, stored] = ["fresh.exr", "stored.exr"].map(|file| radiance(&sandbox, file));
    assert_eq!((fresh.width, fresh.height), (40, 30));
    assert!(fresh.radiance == stored.radiance);
    assert!(fresh.radiance.as_flattened().iter().any(|value| *value > 0.0));
}

#[test]
fn a_png_shows_radiance_as_its_options_say() {
    let sandbox = Sandbox::new();
    sandbox.succeed("bake builtin:mirror -o maps --max-error 5% --map-resolution 32 --layers caustic,direct");
    let render = |file: &str, options: &str| {
        let line = "render builtin:mirror --size 40x30 --backend cpu --maps maps --json --camera 0";
        sandbox.succeed(&format!("{line} -o {file} {options}")).json()
    };
    let report = render("radiance.exr", "");
    assert!(
        report["picture"] == "radiance.exr" && report["made_by"] == "cpu",
        "{report}"
    );
    assert!(report["width"] == 40 && report["height"] == 30, "{report}");
    let seen = radiance(&sandbox, "radiance.exr");
    let shown = |options: &str| {
        let report = render("a.png", options);
        let picture = image::open(sandbox.path("a.png")).expect("a PNG").to_rgba8();
        (
            picture.into_raw(),
            report["exposure_stops"].as_f64().expect("a number"),
        )
    };
    let (auto, stops) = shown("");
    // Numbers that are read from JSON may be off by their last digit.
    let expected = seen.auto_exposure_stops();
    assert!((stops - expected).abs() < 1e-12, "{stops} for {expected}");
    assert!(auto == tone_mapping::display_rgba8(&seen, stops, ToneMap::default()));
    let mut all = vec![auto];
    for (name, tone_map) in ["none", "neutral", "agx", "aces", "soft"]
        .into_iter()
        .zip(ToneMap::VARIANTS)
    {
        let (picture, stops) = shown(&format!("--exposure 1 --tone-map {name}"));
        assert!(
            picture == tone_mapping::display_rgba8(&seen, 1.0, *tone_map),
            "{name}"
        );
        assert!(
            stops == 1.0 && !all.contains(&picture),
            "{name} shows what another one shows"
        );
        all.push(picture);
    }
    let plain = shown("--exposure 1").0;
    // Its lamp is white.
    assert!(shown("--exposure 1 --white-balance lamps").0 == plain);
    for white in ["3000", "0.4,0.38"] {
        let picture = shown(&format!("--exposure 1 --white-balance {white}")).0;
        let of: WhiteBalance = white.parse().expect("a white");
        let balanced = seen.clone().white_balanced(&of.matrix(&Scene::default()));
        let expected = tone_mapping::display_rgba8(&balanced, 1.0, ToneMap::default());
        assert!(picture == expected && picture != plain, "{white}");
    }
}

#[test]
fn a_missing_card_fails_only_when_asked_for() {
    let sandbox = Sandbox::new();
    let run = |options: &str| {
        let line = format!("render builtin:mirror -o a.png {SMALL} {options}");
        Run::from(
            without_card(&sandbox, &line)
                .output()
                .expect("the program starts"),
        )
    };
    run("--backend gpu").failed_in_one_sentence(1, &["adapter"]);
    let fallback = run("--json");
    assert_eq!(fallback.code, 0, "{}", fallback.stderr);
    assert_eq!(fallback.json()["made_by"], "cpu");
    assert!(fallback.stderr.contains("CPU"), "{}", fallback.stderr);
}
