//! A page to walk through: its folder and its single file, taken apart.

use std::io::Read as _;
use std::path::Path;

use nephroid::export::map_set::MapSet;
use nephroid::export::web::{Site, WebReport};

use super::Baked;
use crate::prelude::*;
use support::glb::load_path;
use support::program::Sandbox;

const LAYERS: [LayerKind; 2] = [LayerKind::Caustic, LayerKind::Direct];
/// Step of nine bits that share an exponent, and what fewer texels may differ by [1].
const TOLERANCE: f64 = 1.0 / 256.0 + 0.02;

fn baked() -> Baked {
    Baked::quick(builtin::build("ring").expect("it is built in"), &LAYERS)
}

fn site(baked: &Baked) -> Site {
    let set = MapSet::open(baked.path("out"), &baked.scene).expect("it was baked");
    Site::new(&baked.scene, &[set], 0.0, &Control::default()).expect("it fits")
}

fn written(baked: &Baked) -> (WebReport, Value, String) {
    let report = site(baked)
        .write_folder(&baked.path("site"), false)
        .expect("it is empty");
    let page = text(&baked.path("site/index.html"));
    (report, about(&page), page)
}

/// What scripts read in a page.
fn about(page: &str) -> Value {
    let about = page.split_once("id=\"about\">").expect("it has its data").1;
    let about = about.split_once("</script>").expect("it ends").0;
    serde_json::from_str(about).expect("it is JSON")
}

fn files(about: &Value) -> Vec<&str> {
    let names = about["files"].as_array().expect("a list").iter();
    names.map(|name| name.as_str().expect("a name")).collect()
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).expect("it was written")
}

#[test]
fn a_folder_holds_all_that_its_page_names() {
    let baked = baked();
    let (report, about, page) = written(&baked);
    assert_eq!(about["layers"], json!(["caustic", "direct"]));
    let maps = files(&about).into_iter().filter(|file| file.starts_with("maps/"));
    assert_eq!(maps.count(), report.textures);
    for file in files(&about).into_iter().chain(["page.js", "three/LICENSE"]) {
        assert!(baked.path("site").join(file).is_file(), "{file}");
    }
    let imports = page.split_once("importmap\">").expect("it imports").1;
    let imports: Value =
        serde_json::from_str(imports.split_once("</script>").expect("it ends").0).expect("JSON");
    for file in imports["imports"].as_object().expect("names").values() {
        assert!(
            baked.path("site").join(file.as_str().expect("a name")).is_file(),
            "{file}"
        );
    }
    let packed = std::fs::read(baked.path("site/scene.glb.gz")).expect("it was written");
    let mut glb = Vec::new();
    flate2::read::GzDecoder::new(&packed[..])
        .read_to_end(&mut glb)
        .expect("gzip");
    std::fs::write(baked.path("scene.glb"), glb).expect("it can be written");
    let read = load_path(&baked.path("scene.glb"), &LoadOptions::default()).expect("we read it ourselves");
    assert_eq!(
        (read.objects.len(), read.lights.len()),
        (baked.scene.objects.len(), 0)
    );
    let kinds: Vec<&Value> = about["objects"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|look| &look["kind"])
        .collect();
    assert!(
        kinds.contains(&&json!("mirror")) && kinds.contains(&&json!("diffuse")),
        "{kinds:?}"
    );
    let again = site(&baked)
        .write_folder(&baked.path("site"), false)
        .expect("it is ours");
    assert_eq!(again.bytes, report.bytes);
}

#[test]
fn maps_hold_the_light_that_was_baked() {
    let baked = baked();
    let (_, about, _) = written(&baked);
    let wanted = baked.light("direct");
    let mean = wanted.iter().map(|texel| f64::from(texel[1])).sum::<f64>() / wanted.len() as f64;
    let file = about["maps"][0]["layers"]["direct"][0]
        .as_str()
        .expect("it was baked");
    let bytes = std::fs::read(baked.path("site").join(file)).expect("it was written");
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) as usize;
    let side = u32::from_le_bytes(bytes[20..24].try_into().expect("four bytes")) as usize;
    let mut level = Vec::new();
    let mut decoder =
        ruzstd::decoding::StreamingDecoder::new(&bytes[number(80)..number(80) + number(88)]).expect("zstd");
    decoder.read_to_end(&mut level).expect("zstd");
    assert_eq!(level.len(), 4 * side * side);
    // Means over what one of its texels covers.
    let fold = 64 / side;
    let mut squares = 0.0;
    for (texel, word) in level.chunks_exact(4).enumerate() {
        let word = u32::from_le_bytes(word.try_into().expect("four bytes"));
        let found = f64::from((word >> 9) & 511) * f64::from((word >> 27) as i32 - 24).exp2();
        let (row, column) = (texel / side, texel % side);
        let covered = (0..fold * fold)
            .map(|part| wanted[(row * fold + part / fold) * 64 + column * fold + part % fold][1]);
        let covered = covered.map(f64::from).sum::<f64>() / (fold * fold) as f64;
        squares += ((found - covered) / (covered + 0.1 * mean)).powi(2);
    }
    let off = (squares / (side * side) as f64).sqrt();
    assert!(off < TOLERANCE, "{off}");
}

#[test]
fn one_file_needs_no_other() {
    let baked = baked();
    let path = baked.path("site.html");
    site(&baked).write_file(&path).expect("it can be written");
    let page = text(&path);
    for (start, _) in page.match_indices("src=").chain(page.match_indices("href=")) {
        assert!(
            page[start..].starts_with("href=\"data:,\""),
            "{}",
            &page[start..start + 40]
        );
    }
    // Texts of three.js name its homepage, packed.
    assert!(!page.contains("http:") && !page.contains("https:"));
    assert!(page.contains("data-file=\"scene.glb.gz\"") && page.contains("data-file=\"module:page\""));
}

/// Each moment has a file where its light differs; those of an export that is replaced go.
#[test]
fn a_sequence_has_maps_of_each_moment() {
    let sandbox = Sandbox::new();
    let quick = "--density 1e3 --map-resolution 32 --layers caustic,direct";
    sandbox.succeed(&format!("bake builtin:pool -o maps --frames 3 --fps 8 {quick}"));
    sandbox.succeed("export maps --format web -o site");
    let moving = about(&text(&sandbox.path("site/index.html")));
    assert_eq!(moving["frames"], json!({ "count": 3, "fps": 8.0 }));
    let layers = &moving["maps"][0]["layers"];
    let caustics = layers["caustic"].as_array().expect("files");
    assert!(caustics.len() == 3 && caustics[0] != caustics[1], "{layers}");
    // Clear water alone moves: direct light stands still.
    assert_eq!(layers["direct"].as_array().expect("files").len(), 1, "{layers}");
    let is_there = |name: &&str| sandbox.path("site").join(name).is_file();
    assert!(files(&moving).iter().all(is_there));
    std::fs::write(sandbox.path("site/maps/mine.txt"), "mine").expect("it can be written");
    sandbox.succeed(&format!("bake builtin:pool -o maps {quick}"));
    sandbox.succeed("export maps --format web -o site");
    let still = about(&text(&sandbox.path("site/index.html")));
    assert!(still["frames"].is_null() && files(&still).iter().all(is_there));
    for gone in files(&moving)
        .iter()
        .filter(|name| !files(&still).contains(*name))
    {
        assert!(!is_there(gone), "{gone}");
    }
    assert_eq!(text(&sandbox.path("site/maps/mine.txt")), "mine");
}

#[test]
fn other_peoples_files_stay() {
    let baked = baked();
    std::fs::create_dir(baked.path("site")).expect("it can be made");
    std::fs::write(baked.path("site/index.html"), "mine").expect("it can be written");
    let refused = site(&baked)
        .write_folder(&baked.path("site"), false)
        .expect_err("it is not ours");
    assert!(
        refused.to_string().contains("not from an export for the web"),
        "{refused}"
    );
    assert_eq!(text(&baked.path("site/index.html")), "mine");
    site(&baked)
        .write_folder(&baked.path("site"), true)
        .expect("it was asked for");
}
