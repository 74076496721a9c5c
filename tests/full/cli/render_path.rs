//! Frames of a camera's path: timed, and kept as pictures.

use support::prelude::*;
use support::program::{Run, Sandbox, number};
use support::{or_skip, skip};

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

/// Median, 95 % and largest, in order.
fn check_spread(spread: &Value) {
    let [median, p95, max] = ["median", "p95", "max"].map(|name| number(&spread[name]));
    assert!(
        0.0 <= median && median <= p95 && p95 <= max && max.is_finite(),
        "{spread}"
    );
}

fn key(position: [f64; 3], target: [f64; 3]) -> Value {
    json!({"position_m": position, "target_m": target})
}

/// Frames, in a warm-up's list, that made something anew.
fn warm_up_frames(times: &Value) -> Vec<u64> {
    let warm_up = times["warm_up"].as_array().expect("a list");
    let frame = |drawing: &Value| drawing["frame"].as_u64();
    warm_up.iter().filter_map(frame).collect()
}

#[test]
fn frames_are_timed_with_and_without_chains() {
    let sandbox = Sandbox::new();
    // First the right wall alone, from near by, then the ring.
    let keys = [
        key([2.6, 0.8, 0.2], [3.2, 0.8, 0.2]),
        key([-1.6, 1.0, 1.6], [-1.0, 0.05, 0.25]),
    ];
    let path = json!({"frames": 4, "vertical_fov_deg": 40, "keys": keys});
    sandbox.write("walk.json", path.to_string());
    sandbox
        .succeed("bake builtin:showroom -o maps --density 1e4 --map-resolution 64 --layers caustic,direct");
    let line = "render builtin:showroom --path walk.json --stats --maps maps --size 48x32";
    let text = or_skip!(run(&sandbox, "frame times", line));
    for told in [
        "raster alone",
        "with chains",
        "warm-up",
        "95 %",
        "device",
        "4 frames",
    ] {
        assert!(text.stdout.contains(told), "{told} in {}", text.stdout);
    }
    let report = sandbox.succeed(&format!("{line} --json")).json();
    let shape = ["frames", "samples_per_pixel", "width", "height"].map(|name| number(&report[name]));
    assert_eq!(shape, [4.0, 4.0, 48.0, 32.0]);
    assert!(report["folder"].is_null() && !report["adapter"].as_str().expect("a name").is_empty());
    let [alone, chains] = ["raster_alone", "with_chains"].map(|name| &report["stats"][name]);
    assert_eq!(
        (&alone["chains"], &chains["chains"]),
        (&"off".into(), &"auto".into())
    );
    let tells = !alone["device_ms"].is_null();
    for times in [alone, chains] {
        assert_eq!(times["frames"], 4, "each frame once");
        check_spread(&times["wall_ms"]);
        assert!(number(&times["wall_ms"]["median"]) > 0.0);
        let most = number(&times["drawn_objects"]["max"]);
        assert!(most > 3.0 && most < 40.0, "{times}");
        assert_eq!(times["device_ms"].is_null(), !tells);
        for pass in ["opaque", "specular", "tone_mapping", "sum"] {
            if tells {
                check_spread(&times["device_ms"][pass]);
            }
        }
    }
    assert_eq!(warm_up_frames(alone)[0], 1, "the first look is counted apart");
    let of_chains = warm_up_frames(chains);
    let is_later = |frame: &u64| *frame > 1;
    assert!(
        of_chains[0] == 1 && of_chains.iter().any(is_later),
        "so are pipelines that come on the way: {of_chains:?}"
    );
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
    assert_eq!(sandbox.files("."), ["maps", "walk.json"], "nothing is kept");
}

fn codes(sandbox: &Sandbox, file: &str) -> Vec<u8> {
    let image = image::open(sandbox.path(file)).expect("a PNG");
    image.to_rgb8().into_raw()
}

/// Share of codes of two pictures that differ by more than so many steps.
fn share_off(sandbox: &Sandbox, files: [&str; 2], steps: u8) -> f64 {
    let [a, b] = files.map(|file| codes(sandbox, file));
    let is_off = |(a, b): &(&u8, &u8)| a.abs_diff(**b) > steps;
    a.iter().zip(&b).filter(is_off).count() as f64 / a.len() as f64
}

#[test]
fn frames_are_the_pictures_of_render() {
    let sandbox = Sandbox::new();
    let camera = builtin::build("mirror").expect("it is listed").cameras[0].clone();
    let there = key(
        camera.position.to_array(),
        (camera.position + camera.forward).to_array(),
    );
    let fov = camera.vertical_fov_rad.to_degrees();
    let path = json!({"frames": 3, "vertical_fov_deg": fov, "keys": [there, there]});
    sandbox.write("still.json", path.to_string());
    let shown = format!("{QUICK} --exposure 1 --tone-map agx");
    let line = format!("render builtin:mirror --path still.json -o frames {shown} --json");
    let made = or_skip!(run(&sandbox, "frames that are kept", &line));
    assert!(made.json()["stats"].is_null(), "nothing was timed");
    let names = ["frame-00001.png", "frame-00002.png", "frame-00003.png"];
    assert_eq!(sandbox.files("frames"), names);
    sandbox.succeed(&format!(
        "render builtin:mirror -o one.png --backend gpu --camera 0 {shown}"
    ));
    for name in names {
        // `render` takes the mean of several such pictures, which shows at edges and in mirrors.
        let off = share_off(&sandbox, [&format!("frames/{name}"), "one.png"], 1);
        assert!(off < 0.05, "{off} of the codes of {name}");
    }
    // A file that is no path is told before anything is baked.
    sandbox.write("broken.json", "{\"frames\": 0}");
    let broken = sandbox.run("render builtin:ring --path broken.json --stats");
    broken.failed_in_one_sentence(1, &["broken.json", "camera path"]);
}

#[test]
fn a_turntable_goes_around_in_equal_steps() {
    let sandbox = Sandbox::new();
    let turn = |frames: usize, folder: &str| {
        format!(
            "render builtin:mirror --turntable {frames} -o {folder} {QUICK} --exposure 1 --tone-map neutral --json"
        )
    };
    let four = or_skip!(run(&sandbox, "turntable", &turn(4, "four")));
    let report = four.json();
    assert_eq!(
        (&report["frames"], &report["path"]),
        (&4.into(), &"turntable".into())
    );
    sandbox.succeed(&turn(2, "two"));
    assert_eq!((sandbox.files("four").len(), sandbox.files("two").len()), (4, 2));
    // Half a turn is the third of four and the second of two, but for the sine of π.
    let off = share_off(&sandbox, ["four/frame-00003.png", "two/frame-00002.png"], 2);
    assert!(off < 0.01, "{off} of the codes");
    for other in ["four/frame-00002.png", "four/frame-00003.png"] {
        assert!(share_off(&sandbox, ["four/frame-00001.png", other], 10) > 0.05);
    }
    let camera = sandbox.run("render builtin:mirror --turntable 3 -o none --camera nobody");
    camera.failed_in_one_sentence(1, &["--camera"]);
}
