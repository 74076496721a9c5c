//! Shards as processes of their own, and what `merge` makes of them and refuses.

use std::path::Path;
use std::process::Child;

use serde_json::Value;

use crate::program::{Run, Sandbox, read_json};
use crate::scenes;

/// Bakes all shards of a bake side by side, into `NAME1`, `NAME2`, …; their folders.
fn bake_shards(sandbox: &Sandbox, bake: &str, name: &str, count: u32) -> Vec<String> {
    let start = |number: u32| -> (String, Child) {
        let folder = format!("{name}{number}");
        let line = format!("bake {bake} --shard {number}/{count} -o {folder} --quiet");
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let mut command = sandbox.command(&arguments);
        let pipe = || std::process::Stdio::piped();
        (
            folder,
            command.stdout(pipe()).stderr(pipe()).spawn().expect("it starts"),
        )
    };
    let running: Vec<(String, Child)> = (1..=count).map(start).collect();
    let end = |(folder, child): (String, Child)| {
        let run = Run::from(child.wait_with_output().expect("it ends"));
        assert_eq!(run.code, 0, "{folder}: {}", run.stderr);
        assert_eq!(sandbox.files(&folder), ["shard.json", "sums.bin"]);
        folder
    };
    running.into_iter().map(end).collect()
}

fn maps(sandbox: &Sandbox, folder: &str) -> Vec<(String, Vec<u8>)> {
    let maps = Path::new(folder).join("maps");
    let names = sandbox.files(&maps);
    let read = |name: String| {
        let bytes = std::fs::read(sandbox.path(folder).join("maps").join(&name)).expect("it is listed");
        (name, bytes)
    };
    names.into_iter().map(read).collect()
}

/// A manifest without times, and without the memory that the process held.
fn lasting(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            let of_the_run = ["timings_s", "cpu_s", "cpu_ms", "wall_s", "bytes"];
            of_the_run.iter().for_each(|name| drop(fields.remove(*name)));
            fields.values_mut().for_each(lasting);
        }
        Value::Array(items) => items.iter_mut().for_each(lasting),
        _ => {}
    }
}

#[track_caller]
fn assert_merges(sandbox: &Sandbox, bake: &str, count: u32) {
    let name = format!("part-{}-", sandbox.files(".").len());
    let (whole, merged) = (format!("{name}whole"), format!("{name}merged"));
    sandbox.succeed(&format!("bake {bake} -o {whole}"));
    // In any order.
    let mut folders = bake_shards(sandbox, bake, &name, count);
    folders.rotate_left(1);
    sandbox.succeed(&format!("merge {} -o {merged}", folders.join(" ")));
    let (ours, theirs) = (maps(sandbox, &merged), maps(sandbox, &whole));
    assert!(!theirs.is_empty(), "{bake}");
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert!(ours == theirs, "{bake}: {} is not {}", ours.0, theirs.0);
    }
    assert_eq!(ours.len(), theirs.len());
    let mut manifests = [merged, whole].map(|folder| sandbox.manifest(&folder));
    manifests.iter_mut().for_each(lasting);
    let [merged, whole] = manifests;
    for (name, value) in whole.as_object().expect("fields") {
        assert_eq!(&merged[name], value, "{bake}: {name}");
    }
    assert_eq!(merged, whole);
}

const LAMPS: &str = "lamps.gltf --density 4000 --map-resolution 24 --wavefronts 4";

fn with_lamps() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("lamps.gltf", scenes::mirror_under_lamps());
    sandbox
}

#[test]
fn eight_processes_make_the_files_of_one() {
    let sandbox = with_lamps();
    assert_merges(
        &sandbox,
        &format!("{LAMPS} --layers caustic,direct --per-light"),
        8,
    );
}

#[test]
fn splats_and_spectra_add_up_as_well() {
    let sandbox = with_lamps();
    assert_merges(
        &sandbox,
        &format!("{LAMPS} --estimator splat --sigma adaptive"),
        3,
    );
    assert_merges(&sandbox, "builtin:prism --density 1e6 --map-resolution 24", 3);
    let bands = "builtin:prism --density 1e6 --map-resolution 16 --wavelengths 3 --keep-spectrum";
    assert_merges(&sandbox, bands, 2);
}

#[test]
fn one_shard_of_one_is_the_bake() {
    assert_merges(&with_lamps(), LAMPS, 1);
}

#[test]
fn a_scene_that_was_moved_is_named() {
    let sandbox = with_lamps();
    let [one] = &bake_shards(&sandbox, LAMPS, "a", 1)[..] else {
        panic!("one shard")
    };
    std::fs::rename(sandbox.path("lamps.gltf"), sandbox.path("moved.gltf")).expect("it can be moved");
    sandbox
        .run(&format!("merge {one} -o out"))
        .failed_in_one_sentence(1, &["lamps.gltf", "there is no such file"]);
    sandbox.succeed(&format!("merge {one} -o out --scene moved.gltf"));
    sandbox
        .run(&format!("merge {one} -o other --scene builtin:mirror"))
        .failed_in_one_sentence(1, &["builtin:mirror", "not the scene", "a1"]);
    assert!(!sandbox.path("other").exists());
}

#[test]
fn shards_that_do_not_belong_together_are_refused_by_name() {
    let sandbox = with_lamps();
    bake_shards(&sandbox, LAMPS, "two", 2);
    bake_shards(&sandbox, LAMPS, "three", 3);
    bake_shards(&sandbox, &LAMPS.replace("4000", "5000"), "denser", 2);
    let other = "builtin:mirror --density 4000 --map-resolution 24 --wavefronts 4";
    bake_shards(&sandbox, other, "other", 2);
    let mut newer = read_json(&sandbox.path("two2/shard.json"));
    newer["program_version"] = "99.0.0".into();
    std::fs::create_dir(sandbox.path("newer")).expect("made");
    sandbox.write("newer/shard.json", newer.to_string());
    let sums = std::fs::read(sandbox.path("two2/sums.bin")).expect("written");
    sandbox.write("newer/sums.bin", &sums);
    for (folders, words) in [
        ("two1", vec!["two1", "missing: 2"]),
        ("three2", vec!["three2", "missing: 1, 3"]),
        ("two1 two1", vec!["two1", "is shard 1, and so is"]),
        ("two1 two2 two2", vec!["two2", "is shard 2, and so is"]),
        ("two1 three2", vec!["three2", "3 shards and not 2", "two1"]),
        (
            "two1 denser2",
            vec!["denser2", "density per sr", "5000", "4000", "two1"],
        ),
        ("two1 other2", vec!["other2", "another scene", "two1"]),
        ("two1 newer", vec!["newer", "shard.json"]),
        ("two1 nowhere", vec!["nowhere", "no such file"]),
        ("two1 .", vec!["holds no shard", "--shard"]),
    ] {
        sandbox
            .run(&format!("merge {folders} -o out"))
            .failed_in_one_sentence(1, &words);
    }
    assert!(!sandbox.path("out").exists());
}

#[test]
fn torn_and_damaged_shards_are_refused_by_name() {
    let sandbox = with_lamps();
    bake_shards(&sandbox, LAMPS, "s", 2);
    let whole = std::fs::read(sandbox.path("s2/sums.bin")).expect("written");
    let json = std::fs::read(sandbox.path("s2/shard.json")).expect("written");
    let mut flipped = whole.clone();
    let late = whole.len() - 40;
    flipped[late] ^= 0x10;
    for (bytes, word) in [
        (&whole[..whole.len() - 1], "ends before it should"),
        (&whole[..50], "ends before it should"),
        (&whole[..3], "ends before it should"),
        (b"", "ends before it should"),
        (&[&whole[..], b"x"].concat(), "longer than it should be"),
        (&flipped, "damaged"),
        (&[0; 100], "no sums of a shard"),
    ] {
        sandbox.write("s2/sums.bin", bytes);
        sandbox
            .run("merge s1 s2 -o out")
            .failed_in_one_sentence(1, &["s2", word, "again"]);
    }
    sandbox.write("s2/sums.bin", &whole);
    for bytes in [&json[..json.len() / 2], b"{}", b"[1]", b"", b"\xff"] {
        sandbox.write("s2/shard.json", bytes);
        sandbox
            .run("merge s1 s2 -o out")
            .failed_in_one_sentence(1, &["s2", "shard.json"]);
    }
    assert!(!sandbox.path("out").exists());
    sandbox.write("s2/shard.json", &json);
    sandbox.succeed("merge s1 s2 -o out");
}

#[test]
fn what_cannot_be_cut_is_refused_before_any_work() {
    let sandbox = Sandbox::new();
    let fixed = "--density 1000 --map-resolution 16";
    for (options, words) in [
        ("--map-resolution 16", ["--max-error", "--density"]),
        ("--map-resolution 16 --preset draft", ["--max-error", "--density"]),
        ("--map-resolution 16 --max-error 2%", ["--max-error", "--density"]),
        (
            "--map-resolution 16 --density 1000 --max-time 5s",
            ["--max-time", "--density"],
        ),
        ("--density 1000", ["--map-resolution", "auto"]),
        (
            "--density 1000 --map-resolution auto",
            ["--map-resolution", "auto"],
        ),
        (&format!("{fixed} --layers direct"), ["--layers", "caustic"]),
    ] {
        sandbox
            .run(&format!("bake builtin:mirror -o out --shard 1/2 {options}"))
            .failed_in_one_sentence(2, &words);
    }
    for shard in ["0/2", "3/2", "1", "1/0", "-1/2", "1/1000000000", "a/b"] {
        sandbox
            .run(&format!("bake builtin:mirror -o out {fixed} --shard {shard}"))
            .failed_in_one_sentence(2, &["--shard"]);
    }
    sandbox
        .run("bake builtin:mirror -o out --density 1000 --map-resolution 2048 --memory 1M --shard 1/2")
        .failed_in_one_sentence(1, &["--memory", "--map-resolution"]);
    assert!(sandbox.files(".").is_empty());
}

#[test]
fn shards_do_not_take_each_others_folders() {
    let sandbox = with_lamps();
    let shard = |number: u32, folder: &str, more: &str| {
        sandbox.run(&format!("bake {LAMPS} --shard {number}/2 -o {folder} {more}"))
    };
    assert_eq!(shard(1, "a", "").code, 0);
    let first = std::fs::read(sandbox.path("a/sums.bin")).expect("written");
    shard(2, "a", "").failed_in_one_sentence(1, &["a", "holds shard 1 of 2", "--force"]);
    assert_eq!(
        std::fs::read(sandbox.path("a/sums.bin")).expect("still there"),
        first
    );
    assert_eq!(shard(1, "a", "").code, 0, "the same one may be baked again");
    assert_eq!(shard(2, "a", "--force").code, 0);
    std::fs::create_dir(sandbox.path("full")).expect("made");
    sandbox.write("full/mine.txt", "mine");
    shard(1, "full", "").failed_in_one_sentence(1, &["full", "not from this shard", "--force"]);
    assert_eq!(shard(1, "b", "--json").json()["shard"]["number"], 1);
    sandbox
        .run("merge b a -o full")
        .failed_in_one_sentence(1, &["full", "not from a bake", "--force"]);
    sandbox.succeed("merge b a -o full --force");
    sandbox.succeed("merge b a -o full");
    assert_eq!(sandbox.files("full"), ["manifest.json", "maps", "mine.txt"]);
}
