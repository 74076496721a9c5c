//! Output folders: ours are replaced file by file, other people's are left alone.

use nephroid::export::float_image::FloatImage;
use nephroid::export::map_folder::MapFolder;

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
    // A bake that fails writes nothing to the folder that it tried.
    let folder = MapFolder::open(&sandbox.path("x/y"), false).expect("writable");
    assert_eq!(sandbox.files("."), ["a", "x"]);
    drop(folder);
    assert_eq!(sandbox.files("."), ["a"]);
}

#[test]
fn files_are_as_large_as_they_are_asked_to_be_however_little_memory_there_is() {
    let sandbox = Sandbox::new();
    let found =
        sandbox.succeed("bake builtin:mirror -o out --density 1e3 --map-resolution 600x500 --memory 1M");
    assert!(found.stderr.contains("--memory"), "{}", found.stderr);
    let map = &sandbox.manifest("out")["maps"][0];
    assert_eq!((&map["width"], &map["height"]), (&600.into(), &500.into()));
    let bytes = |name: &str| map[name].as_u64().expect("a number");
    assert!(bytes("memory_bytes") <= 1 << 20 && bytes("dense_bytes") == 600 * 500 * 56);
    let file = map["file"].as_str().expect("a name");
    let image = FloatImage::read(&sandbox.path("out").join(file)).expect("an image");
    assert_eq!((image.width, image.height), (600, 500));
}
