//! Frames of a camera's path: timed, and kept as pictures.
#![cfg(feature = "gpu")]

use serde_json::{Value, json};

use crate::program::{Run, Sandbox};
use crate::skip::skip;
use nephroid::scene::builtin;

const QUICK: &str = "--density 1e4 --map-resolution 64 --size 48x32";

/// `None`, counted, where there is no graphics card at all.
fn run(sandbox: &Sandbox, test: &str, line: &str) -> Option<Run> {
    let run = sandbox.run(line);
    if run.stderr.contains("adapter") {
        skip(test, &run.stderr);
        return None;
    }
    assert_eq!(run.code, 0, "{line}: {}", run.stderr);
    Some(run)
}

/// Along the showroom's own path, with fewer frames.
fn showroom(frames: usize) -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/paths/showroom.json");
    let text = std::fs::read_to_string(file).expect("it is there");
    let mut document: Value = serde_json::from_str(&text).expect("it is JSON");
    document["frames"] = frames.into();
    document.to_string()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// Median, 95 % and largest, in order.
fn check_spread(spread: &Value) {
    let [median, p95, max] = ["median", "p95", "max"].map(|name| number(&spread[name]));
    assert!(
        0.0 <= median && median <= p95 && p95 <= max && max.is_finite(),
        "{spread}"
    );
}

#[test]
fn every_frame_is_timed_with_and_without_chains() {
    let sandbox = Sandbox::new();
    sandbox.write("walk.json", showroom(6));
    let line = format!("render builtin:showroom --path walk.json --stats --json {QUICK}");
    let Some(run) = run(&sandbox, "frame times", &line) else {
        return;
    };
    let report = run.json();
    assert_eq!(
        (&report["frames"], &report["samples_per_pixel"]),
        (&6.into(), &4.into())
    );
    assert_eq!((&report["width"], &report["height"]), (&48.into(), &32.into()));
    assert!(report["folder"].is_null() && !report["adapter"].as_str().expect("a name").is_empty());
    let [alone, chains] = ["raster_alone", "with_chains"].map(|name| &report["stats"][name]);
    assert_eq!(
        (&alone["chains"], &chains["chains"]),
        (&"off".into(), &"auto".into())
    );
    let tells = !alone["device_ms"].is_null();
    for times in [alone, chains] {
        assert_eq!(times["frames"], 6, "each frame once");
        check_spread(&times["wall_ms"]);
        assert!(number(&times["wall_ms"]["median"]) > 0.0);
        let objects = &times["drawn_objects"];
        assert!(
            number(&objects["median"]) > 3.0 && number(&objects["max"]) < 40.0,
            "{objects}"
        );
        let warm_up = times["warm_up"].as_array().expect("a list");
        assert_eq!(warm_up[0]["frame"], 1, "the first look is counted apart");
        assert_eq!(times["device_ms"].is_null(), !tells);
        for pass in ["opaque", "specular", "tone_mapping", "sum"]
            .iter()
            .filter(|_| tells)
        {
            check_spread(&times["device_ms"][pass]);
        }
    }
    assert_eq!(alone["specular_pipelines"], 0);
    assert_eq!(number(&alone["drawn_specular"]["max"]), 0.0);
    assert!(number(&chains["specular_pipelines"]) > 0.0 && number(&chains["drawn_specular"]["max"]) > 0.0);
    assert!(number(&chains["pipelines"]) > number(&alone["pipelines"]));
    let ratio = &report["stats"]["with_chains_over_raster_alone"];
    let of_medians = number(&chains["wall_ms"]["median"]) / number(&alone["wall_ms"]["median"]);
    assert!((number(&ratio["wall"]) / of_medians - 1.0).abs() < 1e-9);
    if tells {
        assert_eq!(number(&alone["device_ms"]["specular"]["max"]), 0.0);
        assert!(number(&chains["device_ms"]["specular"]["max"]) > 0.0);
        assert!(number(&ratio["device"]) > 0.0);
    }
    assert_eq!(sandbox.files("."), ["walk.json"], "nothing is kept");
}

#[test]
fn pipelines_that_come_on_the_way_are_counted_apart() {
    let sandbox = Sandbox::new();
    // First the right wall alone, from near by, then the ring.
    let key = |position: [f64; 3], target: [f64; 3]| json!({"position_m": position, "target_m": target});
    let path = json!({"frames": 2, "vertical_fov_deg": 40, "keys": [
        key([2.6, 0.8, 0.2], [3.2, 0.8, 0.2]),
        key([-1.6, 1.0, 1.6], [-1.0, 0.05, 0.25]),
    ]});
    sandbox.write("walk.json", path.to_string());
    sandbox
        .succeed("bake builtin:showroom -o maps --density 1e4 --map-resolution 64 --layers caustic,direct");
    let line = "render builtin:showroom --path walk.json --stats --maps maps --size 48x32";
    let Some(text) = run(&sandbox, "pipelines on the way", line) else {
        return;
    };
    for told in [
        "raster alone",
        "with chains",
        "warm-up",
        "95 %",
        "device",
        "2 frames",
    ] {
        assert!(text.stdout.contains(told), "{told} in {}", text.stdout);
    }
    let report = sandbox.succeed(&format!("{line} --json")).json();
    let frames = |name: &str| -> Vec<u64> {
        let warm_up = report["stats"][name]["warm_up"].as_array().expect("a list");
        warm_up
            .iter()
            .filter_map(|drawing| drawing["frame"].as_u64())
            .collect()
    };
    assert_eq!(frames("raster_alone")[0], 1);
    let with_chains = frames("with_chains");
    assert!(
        with_chains.contains(&1) && with_chains.contains(&2),
        "{with_chains:?}"
    );
    assert_eq!(report["stats"]["with_chains"]["frames"], 2);
}

#[test]
fn frames_are_kept_as_the_pictures_that_render_makes() {
    let sandbox = Sandbox::new();
    let camera = builtin::build("mirror").expect("it is listed").cameras[0].clone();
    let position = camera.position.to_array();
    let target = (camera.position + camera.forward).to_array();
    let key = json!({"position_m": position, "target_m": target});
    let fov = camera.vertical_fov_rad.to_degrees();
    let path = json!({"frames": 3, "vertical_fov_deg": fov, "keys": [key, key]});
    sandbox.write("still.json", path.to_string());
    let shown = format!("{QUICK} --exposure 1 --tone-map agx");
    let line = format!("render builtin:mirror --path still.json -o frames {shown} --json");
    let Some(made) = run(&sandbox, "frames that are kept", &line) else {
        return;
    };
    assert!(made.json()["stats"].is_null(), "nothing was timed");
    let names = ["frame-00001.png", "frame-00002.png", "frame-00003.png"];
    assert_eq!(sandbox.files("frames"), names);
    sandbox.succeed(&format!(
        "render builtin:mirror -o one.png --backend gpu --camera 0 {shown}"
    ));
    let codes = |file: &str| {
        image::open(sandbox.path(file))
            .expect("a PNG")
            .to_rgb8()
            .into_raw()
    };
    let one = codes("one.png");
    for name in names {
        let frame = codes(&format!("frames/{name}"));
        let off = frame
            .iter()
            .zip(&one)
            .filter(|(a, b)| a.abs_diff(**b) > 1)
            .count();
        // `render` takes the mean of several such pictures, which shows at edges and in mirrors.
        assert!(
            off * 20 < one.len(),
            "{off} of {} codes of {name} differ",
            one.len()
        );
    }
    // Again, into the same folder; but not among other people's files.
    sandbox.succeed(&line);
    std::fs::create_dir(sandbox.path("taken")).expect("it is made");
    sandbox.write("taken/letter.txt", "dear");
    sandbox
        .run(&format!(
            "render builtin:mirror --path still.json -o taken {shown}"
        ))
        .failed_in_one_sentence(1, &["taken", "not frames"]);
}

#[test]
fn a_turntable_goes_around_the_scene_in_equal_steps() {
    let sandbox = Sandbox::new();
    let turn = |frames: usize, folder: &str| {
        format!("render builtin:mirror --turntable {frames} -o {folder} {QUICK} --exposure 1 --json")
    };
    let Some(four) = run(&sandbox, "turntable", &turn(4, "four")) else {
        return;
    };
    assert_eq!(
        (&four.json()["frames"], &four.json()["path"]),
        (&4.into(), &"turntable".into())
    );
    sandbox.succeed(&turn(2, "two"));
    assert_eq!(sandbox.files("four").len(), 4);
    assert_eq!(sandbox.files("two").len(), 2);
    let codes = |file: &str| {
        image::open(sandbox.path(file))
            .expect("a PNG")
            .to_rgb8()
            .into_raw()
    };
    // Half a turn is the third of four and the second of two, but for the sine of π.
    let [half, other] = ["four/frame-00003.png", "two/frame-00002.png"].map(codes);
    let off = half
        .iter()
        .zip(&other)
        .filter(|(a, b)| a.abs_diff(**b) > 2)
        .count();
    assert!(off * 100 < half.len(), "{off} of {} codes", half.len());
    let differs = |a: &str, b: &str| {
        let (a, b) = (codes(a), codes(b));
        a.iter().zip(&b).filter(|(a, b)| a.abs_diff(**b) > 10).count() * 20 > a.len()
    };
    assert!(differs("four/frame-00001.png", "four/frame-00002.png"));
    assert!(differs("four/frame-00001.png", "four/frame-00003.png"));
    for (options, words) in [
        ("--turntable 0 -o none", &["--turntable", "1 to 10000"][..]),
        ("--turntable 3", &["--turntable", "-o DIR"]),
        ("--turntable 3 --path walk.json -o none", &["--path"]),
        ("--turntable 3 -o none --camera nobody", &["--camera"]),
    ] {
        let code = if options.contains("nobody") { 1 } else { 2 };
        sandbox
            .run(&format!("render builtin:mirror {QUICK} {options}"))
            .failed_in_one_sentence(code, words);
    }
}

#[test]
fn what_does_not_go_with_a_path_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.write("walk.json", showroom(2));
    for (options, words) in [
        ("--stats --backend cpu", &["--backend cpu", "graphics card"][..]),
        ("", &["--stats", "-o DIR"]),
        ("--stats --camera 0", &["--camera"]),
        ("--stats --effects chains=off", &["chains=off"]),
    ] {
        sandbox
            .run(&format!("render builtin:ring --path walk.json {QUICK} {options}"))
            .failed_in_one_sentence(2, words);
    }
    sandbox
        .run("render builtin:ring -o a.png --stats")
        .failed_in_one_sentence(2, &["--path"]);
    sandbox
        .run("render builtin:ring")
        .failed_in_one_sentence(2, &["--output"]);
    sandbox
        .run("render builtin:ring --path nowhere.json --stats")
        .failed_in_one_sentence(1, &["nowhere.json"]);
    sandbox.write("broken.json", "{\"frames\": 0}");
    sandbox
        .run("render builtin:ring --path broken.json --stats")
        .failed_in_one_sentence(1, &["broken.json", "camera path"]);
    assert_eq!(sandbox.files("."), ["broken.json", "walk.json"]);
}
