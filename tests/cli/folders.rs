//! Output folders: ours are replaced file by file, other people's are left alone.

use crate::program::Sandbox;

const QUICK: &str = "--density 1e3 --map-resolution 16";

#[test]
fn folders_of_others_are_taken_only_by_force() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("photos")).expect("writable");
    sandbox.write("photos/cat.jpg", "a cat");
    sandbox
        .run(&format!("bake builtin:mirror -o photos {QUICK}"))
        .failed_in_one_sentence(1, &["photos", "--force"]);
    assert_eq!(sandbox.files("photos"), ["cat.jpg"]);
    // A manifest of another program does not make it ours.
    sandbox.write("photos/manifest.json", r#"{"name": "an app"}"#);
    sandbox
        .run(&format!("bake builtin:mirror -o photos {QUICK}"))
        .failed_in_one_sentence(1, &["photos", "--force"]);
    sandbox.succeed(&format!("bake builtin:mirror -o photos --force {QUICK}"));
    assert_eq!(sandbox.files("photos"), ["cat.jpg", "manifest.json", "maps"]);
    assert_eq!(sandbox.manifest("photos")["schema"], 1);
}

#[test]
fn ours_are_replaced_file_by_file() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o out {QUICK}"));
    sandbox.write("out/notes.txt", "keep me");
    sandbox.write("out/maps/other.exr", "not ours");
    let first = sandbox.files("out/maps");
    // Another scene: other surfaces receive light.
    sandbox.succeed(&format!("bake builtin:showroom -o out {QUICK}"));
    let mut expected: Vec<String> = sandbox.manifest("out")["maps"]
        .as_array()
        .expect("maps")
        .iter()
        .flat_map(|map| [&map["file"], &map["uv_file"]])
        .filter_map(|file| file.as_str()?.strip_prefix("maps/").map(str::to_string))
        .chain(["other.exr".to_string()])
        .collect();
    expected.sort();
    assert_eq!(sandbox.files("out/maps"), expected);
    assert_ne!(first, expected);
    assert_eq!(sandbox.files("out"), ["manifest.json", "maps", "notes.txt"]);
}

#[test]
fn folders_are_made_with_their_parents_and_only_for_a_result() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o a/b/c {QUICK}"));
    assert_eq!(sandbox.files("a/b/c"), ["manifest.json", "maps"]);
    // Too little memory for the map: the bake fails after the folder was tried.
    sandbox
        .run("bake builtin:mirror -o x/y --map-resolution 16384 --memory 1M")
        .failed_in_one_sentence(1, &["memory"]);
    assert_eq!(sandbox.files("."), ["a"]);
}
