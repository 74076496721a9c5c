//! Bad input: one sentence with what, where and what to do, exit 1, nothing half-written.

use std::fs::File;
use std::process::Stdio;

use crate::program::{Run, Sandbox};
use crate::scenes;

#[test]
fn scenes_that_cannot_be_read() {
    let sandbox = Sandbox::new();
    sandbox.write("text.glb", "this is no scene");
    sandbox.write("empty.gltf", "");
    std::fs::create_dir(sandbox.path("folder.glb")).expect("writable");
    for (scene, words) in [
        ("missing.glb", vec!["missing.glb"]),
        ("text.glb", vec!["text.glb"]),
        ("empty.gltf", vec!["empty.gltf"]),
        ("folder.glb", vec!["folder.glb"]),
        ("builtin:teapot", vec!["builtin:teapot", "showroom", "ring"]),
    ] {
        for command in ["inspect", "bake -o out", "render -o picture.png"] {
            sandbox
                .run(&format!("{command} {scene}"))
                .failed_in_one_sentence(1, &words);
        }
    }
    assert_eq!(sandbox.files("."), ["empty.gltf", "folder.glb", "text.glb"]);
}

#[test]
fn outputs_that_cannot_be_written_are_found_before_the_bake() {
    let sandbox = Sandbox::new();
    sandbox.write("file", "kept");
    // At this density the bake itself would take hours.
    let long = "--density 1e12 --map-resolution 64";
    sandbox
        .run(&format!("bake builtin:ring -o file {long}"))
        .failed_in_one_sentence(1, &["file"]);
    sandbox
        .run(&format!("bake builtin:ring -o file/below {long}"))
        .failed_in_one_sentence(1, &["file/below"]);
    sandbox
        .run(&format!("render builtin:ring -o nowhere/a.png {long}"))
        .failed_in_one_sentence(1, &["nowhere"]);
    std::fs::create_dir(sandbox.path("folder.png")).expect("writable");
    sandbox
        .run(&format!("render builtin:ring -o folder.png {long}"))
        .failed_in_one_sentence(1, &["folder.png"]);
    assert_eq!(std::fs::read(sandbox.path("file")).expect("there"), b"kept");
    assert_eq!(sandbox.files("."), ["file", "folder.png"]);
}

#[test]
fn a_scene_without_light_names_the_remedy() {
    let sandbox = Sandbox::new();
    sandbox.write("dark.gltf", scenes::dark_triangle());
    sandbox
        .run("bake dark.gltf -o out")
        .failed_in_one_sentence(1, &["dark.gltf", "--default-light"]);
    assert_eq!(sandbox.files("."), ["dark.gltf"]);
    let run = sandbox.succeed("bake dark.gltf -o out --default-light");
    assert!(
        run.stderr.contains("warning: ") && run.stderr.contains("sun"),
        "{}",
        run.stderr
    );
    assert!(run.stdout.contains("none: "), "{}", run.stdout);
    assert_eq!(sandbox.manifest("out")["maps"], serde_json::json!([]));
}

#[test]
fn environments_that_cannot_be_read() {
    let sandbox = Sandbox::new();
    sandbox.write("text.hdr", "this is no sky");
    sandbox.write("empty.exr", "");
    for (sky, words) in [
        ("missing.hdr", ["missing.hdr", "there is no such file"]),
        ("text.hdr", ["text.hdr", "neither a Radiance nor an OpenEXR"]),
        ("empty.exr", ["empty.exr", "neither a Radiance nor an OpenEXR"]),
    ] {
        for command in ["inspect", "bake -o out", "render -o picture.png"] {
            sandbox
                .run(&format!("{command} builtin:ring --environment {sky}"))
                .failed_in_one_sentence(1, &words);
        }
    }
    assert_eq!(sandbox.files("."), ["empty.exr", "text.hdr"]);
}

#[test]
fn an_environment_is_light_enough() {
    let sandbox = Sandbox::new();
    sandbox.write("dark.gltf", scenes::dark_triangle());
    sandbox.write("sky.hdr", scenes::grey_sky());
    let run = sandbox.succeed("bake dark.gltf -o out --environment sky.hdr");
    assert!(!run.stderr.contains("sun"), "{}", run.stderr);
}

#[test]
fn nothing_specular_is_no_error() {
    let sandbox = Sandbox::new();
    sandbox.write("matte.gltf", scenes::lit_matte_triangle());
    let run = sandbox.succeed("bake matte.gltf -o out --json");
    let manifest = run.json();
    assert_eq!(manifest["maps"], serde_json::json!([]));
    assert_eq!(manifest["stop_reason"], "nothing_to_do");
    assert_eq!(manifest["partial"], false);
}

#[test]
fn an_unknown_camera_names_those_there_are() {
    let sandbox = Sandbox::new();
    let quick = "--density 1e3 --map-resolution 16 --size 16x16";
    sandbox
        .run(&format!("render builtin:ring -o a.png --camera nobody {quick}"))
        .failed_in_one_sentence(1, &["--camera", "nobody", "camera"]);
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_written_are_a_failure() {
    let sandbox = Sandbox::new();
    let full = File::options()
        .write(true)
        .open("/dev/full")
        .expect("Linux has one");
    let output = sandbox
        .command(&["inspect", "builtin:ring"])
        .stdout(Stdio::from(full))
        .output()
        .expect("the program starts");
    Run::from(output).failed_in_one_sentence(1, &["stdout"]);
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let sandbox = Sandbox::new();
    let mut child = sandbox
        .command(&["inspect", "builtin:ring", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let run = Run::from(child.wait_with_output().expect("it ends"));
    assert_eq!((run.code, run.stderr.as_str()), (0, ""));
}
