//! Pictures, and maps that are read back for them.

use std::sync::Arc;

use nephroid::export::FloatImage;
use nephroid::eye_pass::{Picture, ToneMap, View, WhiteBalance, reference, tone_mapping};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin;
use nephroid::transport::Tracer;

use crate::program::{Run, Sandbox};
#[cfg(feature = "gpu")]
use crate::skip::skip;

const QUICK: &str = "--density 1e4 --map-resolution 64";
const SMALL: &str = "--size 40x30 --backend cpu";

#[test]
fn pictures_of_baked_and_of_stored_maps_agree() {
    let sandbox = Sandbox::new();
    for scene in ["mirror", "showroom"] {
        sandbox.succeed(&format!(
            "render builtin:{scene} -o fresh.exr {SMALL} {QUICK} --layers caustic,direct"
        ));
        sandbox.succeed(&format!(
            "bake builtin:{scene} -o maps {QUICK} --layers caustic,direct"
        ));
        sandbox.succeed(&format!(
            "render builtin:{scene} -o stored.exr {SMALL} --maps maps"
        ));
        let [fresh, stored] = ["fresh.exr", "stored.exr"].map(|file| {
            let image = FloatImage::read(&sandbox.path(file)).expect("a picture");
            assert_eq!((image.width, image.height), (40, 30));
            image.rgb("").expect("R, G, B")
        });
        assert_eq!(fresh, stored, "{scene}");
        assert!(
            fresh.iter().flatten().any(|value| *value > 0.0),
            "{scene} is dark"
        );
    }
}

#[test]
fn png_and_json_say_what_was_made() {
    let sandbox = Sandbox::new();
    let report = sandbox
        .succeed(&format!(
            "render builtin:mirror -o a.png {SMALL} {QUICK} --json --camera 0"
        ))
        .json();
    assert_eq!(report["picture"], "a.png");
    assert_eq!(report["made_by"], "cpu");
    assert_eq!((&report["width"], &report["height"]), (&40.into(), &30.into()));
    let brightness = |file: &str| -> u64 {
        let picture = image::open(sandbox.path(file)).expect("a PNG").to_rgb8();
        picture.pixels().flat_map(|pixel| pixel.0).map(u64::from).sum()
    };
    let stops = report["exposure_stops"].as_f64().expect("a number");
    for (file, stops) in [("same.png", stops), ("darker.png", stops - 2.0)] {
        sandbox.succeed(&format!(
            "render builtin:mirror -o {file} {SMALL} {QUICK} --camera 0 --exposure {stops}"
        ));
    }
    assert_eq!(brightness("a.png"), brightness("same.png"));
    assert!(brightness("darker.png") < brightness("a.png"));
}

#[test]
fn every_tone_map_shows_the_same_radiance_in_its_own_way() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("render builtin:mirror -o radiance.exr {SMALL} {QUICK}"));
    let picture = Picture {
        width: 40,
        height: 30,
        radiance: pixels(&sandbox, "radiance.exr"),
    };
    let mut seen: Vec<Vec<u8>> = Vec::new();
    for (name, tone_map) in ["none", "neutral", "agx", "aces"].into_iter().zip(ToneMap::ALL) {
        sandbox.succeed(&format!(
            "render builtin:mirror -o {name}.png {SMALL} {QUICK} --exposure 1 --tone-map {name}"
        ));
        let path = sandbox.path(&format!("{name}.png"));
        let shown = image::open(path).expect("a PNG").to_rgba8().into_raw();
        assert!(
            shown == tone_mapping::display_rgba8(&picture, 1.0, tone_map),
            "{name}"
        );
        assert!(!seen.contains(&shown), "{name} shows what another one shows");
        seen.push(shown);
    }
    let help = sandbox.succeed("render -h").stdout;
    let words: Vec<&str> = help.split_whitespace().collect();
    assert!(words.join(" ").contains("none, neutral, agx, aces]"), "{help}");
}

#[test]
fn white_balance_makes_the_lamps_light_white_in_pictures_for_display() {
    let sandbox = Sandbox::new();
    let render = |file: &str, options: &str| {
        sandbox.succeed(&format!(
            "render builtin:mirror -o {file} {SMALL} {QUICK} {options}"
        ));
        sandbox.path(file)
    };
    render("radiance.exr", "");
    let picture = Picture {
        width: 40,
        height: 30,
        radiance: pixels(&sandbox, "radiance.exr"),
    };
    let shown = |path| image::open(path).expect("a PNG").to_rgba8().into_raw();
    let plain = shown(render("plain.png", "--exposure 1"));
    // Its lamp is white.
    assert_eq!(
        shown(render("lamps.png", "--exposure 1 --white-balance lamps")),
        plain
    );
    let scene = nephroid::scene::Scene::default();
    for white in ["3000", "0.4,0.38"] {
        let found = shown(render(
            "white.png",
            &format!("--exposure 1 --white-balance {white}"),
        ));
        let matrix = white.parse::<WhiteBalance>().expect("a white").matrix(&scene);
        let balanced = picture.clone().white_balanced(&matrix);
        assert!(
            found == tone_mapping::display_rgba8(&balanced, 1.0, ToneMap::default()),
            "{white}"
        );
        assert!(found != plain, "{white}");
    }
    sandbox
        .run(&format!(
            "render builtin:mirror -o a.exr {SMALL} --white-balance 3000"
        ))
        .failed_in_one_sentence(2, &["--white-balance", "radiance"]);
    for wrong in ["warm", "300", "0.8,0.4", "0.3"] {
        let run = sandbox.run(&format!("render builtin:mirror -o a.png --white-balance {wrong}"));
        assert_eq!(run.code, 2, "{wrong}");
    }
}

#[test]
fn stored_maps_are_not_trusted() {
    let sandbox = Sandbox::new();
    sandbox.succeed(&format!("bake builtin:mirror -o maps {QUICK}"));
    let render = |words: &[&str]| {
        sandbox
            .run(&format!("render builtin:mirror -o a.png {SMALL} --maps maps"))
            .failed_in_one_sentence(1, words);
    };
    sandbox
        .run(&format!("render builtin:ring -o a.png {SMALL} --maps maps"))
        .failed_in_one_sentence(1, &["builtin:mirror", "builtin:ring"]);
    sandbox
        .run(&format!("render builtin:mirror -o a.png {SMALL} --maps nowhere"))
        .failed_in_one_sentence(1, &["nowhere"]);

    let sound = sandbox.manifest("maps");
    let file = sound["maps"][0]["file"].as_str().expect("a path").to_string();
    let edit = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut manifest = sound.clone();
        change(&mut manifest);
        sandbox.write("maps/manifest.json", manifest.to_string());
    };
    edit(&|manifest| manifest["schema"] = 99.into());
    render(&["version 99"]);
    edit(&|manifest| manifest["maps"][0]["file"] = "../../secret.exr".into());
    render(&["secret"]);
    edit(&|manifest| manifest["maps"][0]["file"] = "/etc/passwd".into());
    render(&["passwd"]);
    edit(&|manifest| manifest["maps"][0]["width"] = 63.into());
    render(&["64x64", "63x64"]);
    edit(&|manifest| manifest["maps"][0]["node"] = 7777.into());
    render(&["no surface"]);
    edit(&|manifest| manifest["maps"][0]["layers"] = serde_json::json!(["direct"]));
    render(&["direct layer"]);
    edit(&|manifest| manifest["maps"][0]["uv_set"] = "generated".into());
    render(&["texture coordinates"]);
    edit(&|manifest| {
        let map = manifest["maps"][0].clone();
        manifest["maps"].as_array_mut().expect("maps").push(map);
    });
    render(&["two maps"]);
    sandbox.write("maps/manifest.json", "{}");
    render(&["no manifest"]);
    edit(&|_| {});
    sandbox.write(&format!("maps/{file}"), "no image");
    render(&["neither"]);
    std::fs::remove_file(sandbox.path("maps").join(&file)).expect("it was there");
    render(&[&file]);
}

#[test]
fn a_missing_card_is_a_failure_only_when_asked_for() {
    let sandbox = Sandbox::new();
    // No driver is found where the loaders of Vulkan and OpenGL are sent to lists that are not there.
    let run = |line: &str| {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let output = sandbox
            .command(&arguments)
            .env("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
            .env("__EGL_VENDOR_LIBRARY_DIRS", "/nonexistent")
            .env("VK_ICD_FILENAMES", "/nonexistent.json")
            .env("VK_DRIVER_FILES", "/nonexistent.json")
            .output()
            .expect("the program starts");
        Run::from(output)
    };
    let quick = "--size 40x30 --density 1e3 --map-resolution 16";
    run(&format!("render builtin:mirror -o a.png --backend gpu {quick}"))
        .failed_in_one_sentence(1, &["adapter"]);
    let fallback = run(&format!("render builtin:mirror -o a.png {quick} --json"));
    assert_eq!(fallback.code, 0, "{}", fallback.stderr);
    assert_eq!(fallback.json()["made_by"], "cpu");
    assert!(fallback.stderr.contains("CPU"), "{}", fallback.stderr);
}

/// How many of a pixel's four samples see the mirror of `builtin:mirror`, in a picture of 80 by 60.
fn samples_of_the_mirror() -> Vec<usize> {
    let scene = Arc::new(builtin::build("mirror").expect("it is listed"));
    let samples = View {
        camera: scene.cameras[0].clone(),
        width: 160,
        height: 120,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::BLACK,
    };
    let hits = reference::first_hits(&Tracer::new(scene.clone()), &samples);
    let sees = |object: usize| scene.objects[object].name == "mirror";
    let mut seen = vec![0; 80 * 60];
    for (sample, hit) in hits.into_iter().enumerate() {
        seen[sample / 320 * 80 + sample % 160 / 2] += usize::from(hit.is_some_and(sees));
    }
    seen
}

fn pixels(sandbox: &Sandbox, file: &str) -> Vec<[f32; 3]> {
    let image = FloatImage::read(&sandbox.path(file)).expect("a picture");
    image.rgb("").expect("R, G, B")
}

/// The part of the samples within some pixels that see the mirror, if they agree: all or none.
fn sees_the_mirror(samples: &[usize], pixel: usize, margin: usize) -> Option<bool> {
    let (column, row) = (pixel % 80, pixel / 80);
    let columns = column.saturating_sub(margin)..=(column + margin).min(79);
    let rows = row.saturating_sub(margin)..=(row + margin).min(59);
    let mut near = rows.flat_map(|row| columns.clone().map(move |column| samples[row * 80 + column]));
    match samples[pixel] {
        0 => near.all(|seen| seen == 0).then_some(false),
        4 => near.all(|seen| seen == 4).then_some(true),
        _ => None,
    }
}

/// Without chains the mirror is black and all else as before; pixels within a margin of its edge may be either.
fn check_chains(auto: &[[f32; 3]], off: &[[f32; 3]], margin: usize) {
    let samples = samples_of_the_mirror();
    let (mut mirroring, mut others) = (0, 0);
    for pixel in 0..samples.len() {
        match sees_the_mirror(&samples, pixel, margin) {
            Some(false) => {
                assert_eq!(auto[pixel], off[pixel], "pixel {pixel} sees no mirror");
                others += 1;
            }
            Some(true) => {
                assert_eq!(off[pixel], [0.0; 3], "pixel {pixel} of the mirror");
                mirroring += usize::from(auto[pixel][1] > 0.0);
            }
            None => {}
        }
    }
    assert!(mirroring > 5 && others > 500, "{mirroring}, {others}");
}

fn with_chains(sandbox: &Sandbox, backend: &str, switch: &str) -> Run {
    sandbox.run(&format!(
        "render builtin:mirror -o {switch}.exr --size 80x60 --backend {backend} {QUICK} --effects chains={switch}"
    ))
}

#[test]
fn without_chains_the_mirror_is_black_and_all_else_as_before() {
    let sandbox = Sandbox::new();
    let [auto, on, off] = ["auto", "on", "off"].map(|switch| {
        assert_eq!(with_chains(&sandbox, "cpu", switch).code, 0);
        pixels(&sandbox, &format!("{switch}.exr"))
    });
    assert!(auto == on, "forced on is what is seen anyway");
    check_chains(&auto, &off, 0);
}

#[cfg(feature = "gpu")]
#[test]
fn the_card_leaves_chains_out_too() {
    let sandbox = Sandbox::new();
    let first = with_chains(&sandbox, "gpu", "off");
    if first.stderr.contains("adapter") {
        return skip("the_card_leaves_chains_out_too", &first.stderr);
    }
    let [auto, on, off] = ["auto", "on", "off"].map(|switch| {
        assert_eq!(with_chains(&sandbox, "gpu", switch).code, 0);
        pixels(&sandbox, &format!("{switch}.exr"))
    });
    assert!(auto == on, "forced on is what is seen anyway");
    // The card's samples lie elsewhere within their pixels.
    check_chains(&auto, &off, 1);
}
