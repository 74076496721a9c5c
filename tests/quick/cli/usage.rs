//! Help, options, what is refused before any work, and bad input: one sentence with what, where and what to do, exit 1,
//! nothing half-written.

use std::fs;
use std::path::Path;

use crate::prelude::*;
use nephroid::settings::options::OPTIONS;
use support::files;
use support::program::Sandbox;

#[test]
fn help_fits_a_screen_and_begins_with_examples() {
    let sandbox = Sandbox::new();
    let studies = sandbox.succeed("study --list").stdout;
    let studies = studies.lines().filter_map(|line| line.split_whitespace().next());
    let studies = studies.map(|study| format!("study {study}"));
    let commands = "view bake render inspect compare export merge study".split(' ');
    let root = sandbox.succeed("--help");
    assert_eq!(root.stderr, "");
    for command in commands.clone() {
        assert!(root.stdout.contains(command), "{command}");
    }
    for command in commands.map(str::to_string).chain(studies).chain([String::new()]) {
        let [long, short] = ["--help", "-h"].map(|flag| sandbox.succeed(&format!("{command} {flag}")).stdout);
        let lines = |text: &str| text.lines().count();
        let widest = long.lines().map(|line| line.chars().count()).max();
        assert!(lines(&long) <= 50 && widest <= Some(100), "{widest:?} {long}");
        assert!(lines(&short) <= lines(&long) && lines(&short) <= 40, "{short}");
        assert!(long.contains("Usage: nephroid"), "{long}");
        if !command.starts_with("study ") {
            assert!(long.find("Examples:") < long.find("Usage:"), "{long}");
            assert!(long.contains("Examples:\n  nephroid"), "{long}");
        }
    }
    let render = sandbox.succeed("render --help").stdout;
    assert!(render.contains("none, neutral, agx, aces or soft"), "{render}");
    let version = sandbox.succeed("--version").stdout;
    assert_eq!(version, format!("nephroid {}\n", env!("CARGO_PKG_VERSION")));
}

/// The guide's page of options, from their table.
fn options_page() -> String {
    let escaped = |text: &str| text.replace('|', "\\|");
    let mut page = String::from(
        "# Options of a bake\n\n`nephroid bake --help` has them in short. `render`, `view`, `inspect` and `study effects` take \
         them too. An option that does\nnot apply to the others is refused with the reason.\n\n\
         | option | sets | values | default | accuracy | cost |\n|---|---|---|---|---|---|\n",
    );
    for option in OPTIONS {
        let name = format!("--{} {}", option.name, option.value);
        let cells = [
            option.what,
            &option.range(),
            option.default,
            option.accuracy,
            option.cost,
        ];
        page += &format!(
            "| `{}` | {} |\n",
            escaped(name.trim_end()),
            escaped(&cells.join(" ¦ ")).replace('¦', "|")
        );
    }
    page += "\n| option | value | meaning |\n|---|---|---|\n";
    for option in OPTIONS {
        for (name, meaning) in option.values.map_or(Vec::new(), |values| values()) {
            let meaning: Vec<&str> = meaning.split_whitespace().collect();
            page += &format!(
                "| `--{}` | `{name}` | {} |\n",
                option.name,
                escaped(&meaning.join(" "))
            );
        }
    }
    page
}

#[test]
fn the_guide_lists_the_options() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/guide/options.md");
    let page = options_page();
    if fs::read_to_string(&path).ok().as_ref() != Some(&page) {
        fs::write(&path, &page).expect("a page to write");
        panic!(
            "{} was out of date and is written anew: look at it and keep it",
            path.display()
        );
    }
}

/// Runs each line in an empty folder and expects that exit code, one sentence with the words (separated by ` | `), and
/// nothing written.
fn assert_refused(code: i32, beginning: &str, table: &str) {
    let sandbox = Sandbox::new();
    for (options, words) in rows(table) {
        let line = format!("{beginning} {options}");
        let run = sandbox.run(&line);
        assert_eq!(run.code, code, "{line}: {}", run.stderr);
        run.failed_in_one_sentence(code, &words.split(" | ").collect::<Vec<_>>());
    }
    assert!(sandbox.files(".").is_empty(), "{beginning}");
}

#[test]
fn bad_bake_options_are_refused() {
    assert_refused(
        2,
        "bake builtin:prism -o out",
        "--density -5 => --density
         --density nan => --density
         --density many => --density
         --sigma -1 => --sigma
         --sigma adaptive => --sigma
         --estimator splat --sigma 0 => --sigma
         --estimator splat --kernel box --sigma 2 => --sigma
         --footprint disc => --footprint
         --rays jittered => --rays
         --kernel round => --kernel
         --max-error 0 => --max-error
         --max-error many => --max-error
         --estimator splat --max-error 2% => --max-error
         --map-resolution 0 => --map-resolution
         --map-resolution -4 => --map-resolution
         --map-resolution 64x0 => --map-resolution
         --map-resolution 99999 => --map-resolution
         --max-depth 0 => --max-depth
         --branch-threshold 2 => --branch-threshold
         --threads 0 => --threads
         --memory 0 => --memory
         --layers ambient => --layers
         --keep-spectrum => no bands to keep
         --wavelengths 0 => outside 1 to 1000
         --wavelengths many => a number, `rainbow` or `continuous`
         --spectral-sampling split => only splats
         --effects refraction=sideways => auto, on or off",
    );
}

#[test]
fn shards_that_cannot_be_cut_are_refused() {
    assert_refused(
        2,
        "bake builtin:mirror -o out --shard 1/2",
        "--map-resolution 16 => --max-error | --density
         --map-resolution 16 --preset draft => --max-error | --density
         --map-resolution 16 --max-error 2% => --max-error | --density
         --map-resolution 16 --density 1000 --max-time 5s => --max-time | --density
         --density 1000 => --map-resolution | auto
         --density 1000 --map-resolution auto => --map-resolution | auto
         --density 1000 --map-resolution 16 --layers direct => --layers | caustic",
    );
    let bake = "bake builtin:mirror -o out --density 1000 --map-resolution";
    assert_refused(
        2,
        &format!("{bake} 16 --shard"),
        "0/2 => --shard
         3/2 => --shard
         2 => --shard
         1/0 => --shard
         -1/2 => --shard
         1/1000000000 => --shard
         a/b => --shard",
    );
    let short = "--memory 1M --shard 1/2 => --memory | --map-resolution";
    assert_refused(1, &format!("{bake} 2048"), short);
}

#[test]
fn bad_render_options_are_refused() {
    let render = "render builtin:ring";
    assert_refused(
        2,
        render,
        "=> --output
         -o picture => .png
         -o picture.gif => .png
         -o a.png --size 0x5 => --size
         -o a.png --maps out --density 10 => --maps
         -o a.exr --exposure 2 => --exposure
         -o a.exr --tone-map none => --tone-map
         -o a.exr --white-balance 3000 => --white-balance | radiance
         -o a.png --white-balance warm => --white-balance
         -o a.png --white-balance 300 => --white-balance
         -o a.png --white-balance 0.8,0.4 => --white-balance
         -o a.png --white-balance 0.3 => --white-balance
         -o a.png --stats => --path",
    );
    if !cfg!(feature = "gpu") {
        return;
    }
    assert_refused(
        2,
        render,
        "--path walk.json --stats --backend cpu => --backend cpu | graphics card
         --path walk.json => --stats | -o DIR
         --path walk.json --stats --camera 0 => --camera
         --path walk.json --stats --effects chains=off => chains=off
         --turntable 0 -o none => --turntable | 1 to 10000
         --turntable 3 => --turntable | -o DIR
         --turntable 3 --path walk.json -o none => --path",
    );
    assert_refused(1, render, "--path walk.json --stats => walk.json | no such file");
}

#[test]
fn bad_export_options_are_refused() {
    assert_refused(
        2,
        "export out -o none",
        "--cut 100% => --cut | share
         --cut nan => --cut
         --exposure 1 => --exposure | unlit
         --as unlit --lights keep => --lights keep
         --as unlit --exposure nan => --exposure
         --layer sum => --layer
         --bits 32 => --bits
         --force => --force
         --transfer srgb => --transfer
         --mips => --mips
         --atlas => --atlas
         --format bmp => --format
         --format exr --bits 8 => --bits
         --format exr --cut 1% => --cut
         --format exr --as unlit => --as
         --format exr --lights keep => --lights
         --format exr --mips => --mips
         --format exr --packing bc6h => --packing
         --format png --bits 32 => --bits
         --format png --cut 1% --exposure 1 => --cut
         --format png --exposure 65 => --exposure
         --format png --atlas 5 => --atlas
         --format hdr --bits 16 => --bits
         --format hdr --transfer linear => --transfer
         --format ktx2 --bits 16 => --bits
         --format ktx2 --cut 1% => --cut
         --format ktx2 --atlas --mips => --mips
         --single-file => --single-file
         --format web --units lux => --units
         --format web --layer sum => --layer
         --format web --single-file --force => --force",
    );
    assert_refused(1, "export", "nowhere => nowhere");
}

#[test]
fn other_bad_usage_is_refused() {
    assert_refused(
        2,
        "",
        "bake => required
         bake builtin:ring => --output
         merge -o out => required
         merge shard => --output
         compare a.exr => REFERENCE
         compare a.exr b.exr --max-rmse -1 => --max-rmse
         compare a.exr b.exr --difference c.exr => --difference
         view builtin:ring --json => --json
         inspect builtin:ring --log loudly => --log",
    );
}

#[test]
fn ends_of_ranges_are_taken() {
    let sandbox = Sandbox::new();
    sandbox.write("dark.glb", files::dark_triangle());
    for options in [
        "--density 1",
        "--density 1e12 --map-resolution 16384x1",
        "--estimator splat --sigma adaptive",
        "--sigma 0.25 --max-error 5% --map-resolution auto",
        "--sigma 0 --max-error 0.02 --density 2000 --max-depth 1",
        "--branch-threshold 0 --memory 1M --layers caustic,direct",
        "--estimator splat --rays jittered --seed 18446744073709551615",
        "--estimator splat --kernel cone --kernel-sampling point --footprint fixed --item-buffer cube",
        "--estimator splat --preset final",
    ] {
        sandbox.succeed(&format!("inspect dark.glb {options}"));
    }
}

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
    fs::create_dir(sandbox.path("folder.glb")).expect("writable");
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
    fs::create_dir(sandbox.path("folder.png")).expect("writable");
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
    assert_eq!(fs::read(sandbox.path("file")).expect("there"), b"kept");
    assert_eq!(sandbox.files("."), ["file", "folder.png"]);
}

#[test]
fn an_export_does_not_replace_its_scene() {
    let sandbox = Sandbox::new();
    sandbox.write("matte.glb", files::lit_matte_triangle());
    sandbox.succeed("bake matte.glb -o out --layers direct --density 1e3 --map-resolution 16");
    fs::create_dir(sandbox.path("sub")).expect("it can be made");
    let itself = sandbox.run("export out -o sub/../matte.glb");
    itself.failed_in_one_sentence(2, &["scene itself"]);
    refused(&sandbox, "export out -o missing/a.glb", "missing");
    refused(&sandbox, "export out --scene builtin:ring", "geometry");
    let scene = fs::read(sandbox.path("matte.glb")).expect("it is there");
    assert_eq!(scene, files::lit_matte_triangle());
}

#[test]
fn a_scene_without_light_names_the_remedy() {
    let sandbox = Sandbox::new();
    sandbox.write("dark.glb", files::dark_triangle());
    refused(&sandbox, "bake dark.glb -o out", "dark.glb | --default-light");
    assert_eq!(sandbox.files("."), ["dark.glb"]);
    let run = sandbox.succeed("bake dark.glb -o out --default-light");
    says(run.stderr.trim_end(), "warning: | sun");
    assert!(run.stdout.contains("none: "), "{}", run.stdout);
    assert_eq!(sandbox.manifest("out")["maps"], json!([]));
    // A sky is light enough.
    sandbox.write("sky.hdr", files::grey_sky());
    let run = sandbox.succeed("bake dark.glb -o out --environment sky.hdr");
    assert!(!run.stderr.contains("sun"), "{}", run.stderr);
}

#[test]
fn nothing_specular_is_no_error() {
    let sandbox = Sandbox::new();
    sandbox.write("matte.glb", files::lit_matte_triangle());
    let manifest = sandbox.succeed("bake matte.glb -o out --json").json();
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
