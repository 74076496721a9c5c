//! Bad input: one sentence with what, where and what to do, exit 1, nothing half-written.

use crate::prelude::*;
use support::files;
use support::program::Sandbox;

#[track_caller]
fn refused(sandbox: &Sandbox, line: &str, words: &str) {
    let words: Vec<&str> = words.split(" | ").collect();
    sandbox.run(line).failed_in_one_sentence(1, &words);
}

/// Each way in which scenes and skies cannot be read has its sentence in the tests of scenes.
#[test]
fn scenes_and_skies_that_cannot_be_read() {
    let sandbox = Sandbox::new();
    sandbox.write("text.glb", "this is no scene");
    std::fs::create_dir(sandbox.path("folder.glb")).expect("writable");
    sandbox.write("text.hdr", "this is no sky");
    for (input, words) in rows(
        "missing.glb => missing.glb
         text.glb => text.glb
         folder.glb => folder.glb
         text.glb/below.glb => text.glb/below.glb
         builtin:teapot => builtin:teapot | showroom | ring
         builtin:ring --environment missing.hdr => missing.hdr | there is no such file
         builtin:ring --environment text.hdr/sky.hdr => text.hdr/sky.hdr
         builtin:ring --environment text.hdr => text.hdr | neither a Radiance nor an OpenEXR",
    ) {
        for command in ["inspect", "bake -o out", "render -o picture.png"] {
            refused(&sandbox, &format!("{command} {input}"), words);
        }
    }
    assert_eq!(sandbox.files("."), ["folder.glb", "text.glb", "text.hdr"]);
}

#[test]
fn unwritable_outputs_are_found_at_once() {
    let sandbox = Sandbox::new();
    sandbox.write("file", "kept");
    std::fs::create_dir(sandbox.path("folder.png")).expect("writable");
    // At this density the bake itself would take hours.
    let long = "builtin:ring --density 1e12 --map-resolution 64";
    for (line, words) in rows(
        "bake LONG -o file => file
         bake LONG -o file/below => file/below
         render LONG -o nowhere/a.png => nowhere
         render LONG -o file/below.png => file/below
         render LONG -o folder.png => folder.png
         render builtin:ring -o a.png --maps file/below => file/below
         compare file/below.exr file/below.exr => file/below
         study convergence builtin:ring -o file/below => file/below
         study reference builtin:ring --rays 1e9 -o file/below => file/below
         study effects builtin:ring -o file/below => file/below",
    ) {
        refused(&sandbox, &line.replace("LONG", long), words);
    }
    assert_eq!(std::fs::read(sandbox.path("file")).expect("there"), b"kept");
    assert_eq!(sandbox.files("."), ["file", "folder.png"]);
}

#[test]
fn an_export_does_not_replace_its_scene() {
    let sandbox = Sandbox::new();
    sandbox.write("matte.gltf", files::lit_matte_triangle());
    sandbox.succeed("bake matte.gltf -o out --layers direct --density 1e3 --map-resolution 16");
    std::fs::create_dir(sandbox.path("sub")).expect("it can be made");
    let itself = sandbox.run("export out -o sub/../matte.gltf");
    itself.failed_in_one_sentence(2, &["scene itself"]);
    refused(&sandbox, "export out -o missing/a.glb", "missing");
    refused(&sandbox, "export out --scene builtin:ring", "geometry");
    let scene = std::fs::read_to_string(sandbox.path("matte.gltf")).expect("it is there");
    assert_eq!(scene, files::lit_matte_triangle());
}

#[test]
fn a_scene_without_light_names_the_remedy() {
    let sandbox = Sandbox::new();
    sandbox.write("dark.gltf", files::dark_triangle());
    refused(&sandbox, "bake dark.gltf -o out", "dark.gltf | --default-light");
    assert_eq!(sandbox.files("."), ["dark.gltf"]);
    let run = sandbox.succeed("bake dark.gltf -o out --default-light");
    says(run.stderr.trim_end(), "warning: | sun");
    assert!(run.stdout.contains("none: "), "{}", run.stdout);
    assert_eq!(sandbox.manifest("out")["maps"], json!([]));
    // A sky is light enough.
    sandbox.write("sky.hdr", files::grey_sky());
    let run = sandbox.succeed("bake dark.gltf -o out --environment sky.hdr");
    assert!(!run.stderr.contains("sun"), "{}", run.stderr);
}

#[test]
fn nothing_specular_is_no_error() {
    let sandbox = Sandbox::new();
    sandbox.write("matte.gltf", files::lit_matte_triangle());
    let manifest = sandbox.succeed("bake matte.gltf -o out --json").json();
    assert_eq!(manifest["maps"], json!([]));
    assert_eq!(manifest["stop_reason"], "nothing_to_do");
    assert_eq!(manifest["partial"], false);
}

#[test]
fn an_unknown_camera_names_those_there_are() {
    let sandbox = Sandbox::new();
    let quick = "--density 1e3 --map-resolution 16 --size 16x16";
    let line = format!("render builtin:ring -o a.png --camera nobody {quick}");
    refused(&sandbox, &line, "--camera | nobody | camera");
}
