//! A page to walk through: its folder and its single file, taken apart.

use std::collections::HashMap;
use std::io::Read as _;
use std::path::Path;

use nephroid::export::map_set::MapSet;
use nephroid::export::sequence::FrameTimes;
use nephroid::export::web::{Site, WebReport};
use nephroid::eye_pass::renderer::WebScene;

use super::Baked;
use crate::prelude::*;
use support::program::Sandbox;

const LAYERS: [LayerKind; 2] = [LayerKind::Caustic, LayerKind::Direct];
/// Step of nine bits that share an exponent, and what fewer texels may differ by [1].
const TOLERANCE: f64 = 1.0 / 256.0 + 0.02;
/// Radiance of every still picture, all over: two stops below white [W/(m² sr)].
const GREY: f32 = 0.25;

fn baked() -> Baked {
    Baked::quick(builtin::build("ring").expect("it is built in"), &LAYERS)
}

fn site(baked: &Baked) -> Site {
    let set = MapSet::open(baked.path("out"), &baked.scene).expect("it was baked");
    let eye = |view: &View| {
        Ok(Picture {
            width: view.width,
            height: view.height,
            radiance: vec![[GREY; 3]; (view.width * view.height) as usize],
        })
    };
    Site::new(&baked.scene, &[set], &eye, &Control::default()).expect("it fits")
}

fn written(baked: &Baked) -> (WebReport, Value, String) {
    let report = site(baked)
        .write_folder(&baked.path("site"), false)
        .expect("it is empty");
    let page = text(&baked.path("site/index.html"));
    (report, about(&page), page)
}

/// The file of a moment: its description, and what it names.
struct Moment {
    description: Value,
    contents: HashMap<String, Vec<u8>>,
}

impl Moment {
    fn read(path: &Path, first: Option<&Self>) -> Self {
        let (packed, mut file) = (std::fs::read(path).expect("it was written"), Vec::new());
        let read = flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut file);
        read.expect("gzip");
        let (length, rest) = file.split_at(4);
        let length = u32::from_le_bytes(length.try_into().expect("four bytes")) as usize;
        let (description, stored) = rest.split_at(length);
        let description: Value = serde_json::from_slice(description).expect("JSON");
        let mut contents = first.map_or_else(HashMap::new, |first| first.contents.clone());
        for (name, place) in description["contents"].as_object().expect("places") {
            let [first, length] = [0, 1].map(|which| place[which].as_u64().expect("a number") as usize);
            let stored = &stored[first..first + length];
            let bytes = match place[2].as_u64() {
                Some(record) => unfiltered(stored, record as usize, contents.get(name)),
                None => stored.to_vec(),
            };
            contents.insert(name.clone(), bytes);
        }
        Self {
            description,
            contents,
        }
    }
}

/// Bytes lie by their place in a record; words are differences from the first moment, and these from the record before.
fn unfiltered(stored: &[u8], record: usize, first: Option<&Vec<u8>>) -> Vec<u8> {
    let byte = |at: usize| stored[at % record * (stored.len() / record) + at / record];
    let first: Vec<u32> = bytemuck::pod_collect_to_vec(first.map_or(&[][..], |first| first));
    let mut moved: Vec<u32> = Vec::new();
    for word in 0..stored.len() / 4 {
        let change = u32::from_le_bytes([0, 1, 2, 3].map(|part| byte(4 * word + part)));
        let before = word.checked_sub(record / 4).map_or(0, |before| moved[before]);
        moved.push(change.wrapping_add(before));
    }
    let words = moved.iter().enumerate();
    let words = words.map(|(word, moved)| moved.wrapping_add(first.get(word).copied().unwrap_or(0)));
    words.flat_map(u32::to_le_bytes).collect()
}

/// What scripts read in a page.
fn about(page: &str) -> Value {
    let about = page.split_once("id=\"about\">").expect("it has its data").1;
    let about = about.split_once("</script>").expect("it ends").0;
    serde_json::from_str(about).expect("it is JSON")
}

fn moments(about: &Value) -> Vec<&str> {
    let names = about["moments"].as_array().expect("a list").iter();
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
    assert_eq!(moments(&about), ["moment0.gz"]);
    for file in moments(&about).into_iter().chain(["still.jpg", "page.js"]) {
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
    let still = image::open(baked.path("site/still.jpg"))
        .expect("a picture")
        .to_rgb8();
    // A stop above middle grey, since nothing is light: the sRGB code of 0.36, which the tone map leaves as it is.
    assert_eq!(still.dimensions(), (1280, 720));
    assert!(
        still
            .pixels()
            .all(|pixel| pixel.0.iter().all(|code| code.abs_diff(162) <= 2))
    );
    let cameras = about["cameras"].as_array().expect("a list");
    assert_eq!(cameras.len(), baked.scene.cameras.len().max(1));
    for camera in cameras {
        let stops = camera["exposure_stops"].as_f64().expect("a number");
        assert_close(stops, (0.36 / f64::from(GREY)).log2(), 1e-6, "exposure");
    }
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
    let moment = Moment::read(&baked.path("site").join(moments(&about)[0]), None);
    let side = moment.description["textures"]["direct0"]["size"][0]
        .as_u64()
        .expect("a size") as usize;
    // Words are differences from the row before.
    let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(&moment.contents["direct0"]);
    for texel in side..words.len() {
        words[texel] = words[texel].wrapping_add(words[texel - side]);
    }
    assert_eq!(words.len(), side * side);
    // Means over what one of its texels covers.
    let fold = 64 / side;
    let mut squares = 0.0;
    for (texel, word) in words.into_iter().enumerate() {
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
    for (start, _) in page.match_indices("src=\"").chain(page.match_indices("href=\"")) {
        let value = page[start..].split_once('"').expect("a value").1;
        assert!(value.starts_with("data:"), "{}", &value[..40]);
    }
    assert!(!page.contains("http:") && !page.contains("https:"));
    assert!(page.contains("data-file=\"moment0.gz\"") && page.contains("data-file=\"module:page\""));
}

/// Each moment has a file of what differs from the first; those of an export that is replaced go.
#[test]
fn a_sequence_has_what_differs_at_each_moment() {
    let sandbox = Sandbox::new();
    let quick = "--density 1e3 --map-resolution 32 --layers caustic,direct";
    sandbox.succeed(&format!("bake builtin:pool -o maps --frames 3 --fps 8 {quick}"));
    sandbox.succeed("export maps --format web -o site");
    let moving = about(&text(&sandbox.path("site/index.html")));
    let names = ["moment0.gz", "moment1.gz", "moment2.gz"];
    assert_eq!((&moving["moments"], &moving["fps"]), (&json!(names), &json!(8.0)));
    let moments = names.map(|name| sandbox.path("site").join(name));
    let first = Moment::read(&moments[0], None);
    let last = Moment::read(&moments[2], Some(&first));
    // Clear water alone moves: direct light, and what surfaces look like, stand still.
    let stored = last.description["contents"].as_object().expect("places");
    assert!(stored.contains_key("caustic0") && stored.contains_key("corners"));
    assert!(!stored.contains_key("direct0") && !stored.contains_key("map_uvs"));
    assert!(last.description["programs"].is_null() && first.description["programs"].is_object());
    let times = FrameTimes {
        frames: 3,
        fps: 8.0,
        is_loop: false,
    };
    let rest = built_in("pool");
    let water = times.scene(&rest).at(times.time_s(2));
    for (name, content) in WebScene::new(&water, &[]).expect("it is small").contents {
        if ["corners", "nodes", "triangles", "indices"].contains(&&*name) {
            assert!(last.contents[&name] == content.bytes, "{name}");
        }
    }
    std::fs::write(sandbox.path("site/mine.txt"), "mine").expect("it can be written");
    sandbox.succeed(&format!("bake builtin:pool -o maps {quick}"));
    sandbox.succeed("export maps --format web -o site");
    let still = about(&text(&sandbox.path("site/index.html")));
    assert_eq!(
        (&still["moments"], &still["fps"]),
        (&json!(["moment0.gz"]), &Value::Null)
    );
    assert!(moments[0].is_file() && !moments[1].exists() && !moments[2].exists());
    assert_eq!(text(&sandbox.path("site/mine.txt")), "mine");
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
