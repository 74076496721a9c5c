//! `render`: pictures of maps that were baked before, or are baked for it.

use nephroid::export::FloatImage;
use nephroid::eye_pass::{Picture, ToneMap, WhiteBalance, tone_mapping};

use super::without_card;
use crate::export::boxes;
use crate::prelude::*;
use support::program::{Run, Sandbox};

const QUICK: &str = "--density 1e3 --map-resolution 32 --size 40x30";

fn radiance(sandbox: &Sandbox, file: &str) -> Picture {
    let image = FloatImage::read(&sandbox.path(file)).expect("a picture");
    Picture {
        width: image.width as u32,
        height: image.height as u32,
        radiance: image.rgb("").expect("R, G, B"),
    }
}

#[test]
fn stored_maps_look_as_those_baked_for_it() {
    let sandbox = Sandbox::new();
    // Their coordinates are made by the bake.
    sandbox.write("boxes.glb", boxes().bytes());
    sandbox.succeed(&format!(
        "render boxes.glb -o fresh.exr --backend cpu {QUICK} --layers caustic,direct"
    ));
    sandbox.succeed("bake boxes.glb -o maps --density 1e3 --map-resolution 32 --layers caustic,direct");
    sandbox.succeed("render boxes.glb -o stored.exr --size 40x30 --backend cpu --maps maps");
    let [fresh, stored] = ["fresh.exr", "stored.exr"].map(|file| radiance(&sandbox, file));
    assert_eq!((fresh.width, fresh.height), (40, 30));
    assert!(fresh.radiance == stored.radiance);
    assert!(fresh.radiance.as_flattened().iter().any(|value| *value > 0.0));
}

#[test]
fn a_png_shows_radiance_as_its_options_say() {
    let sandbox = Sandbox::new();
    sandbox.succeed("bake builtin:mirror -o maps --estimator wavefront --density 1e3 --map-resolution 32 --layers caustic,direct");
    let render = |file: &str, options: &str| {
        let line = "render builtin:mirror --size 40x30 --backend cpu --maps maps --json --camera 0";
        sandbox.succeed(&format!("{line} -o {file} {options}")).json()
    };
    let report = render("radiance.exr", "");
    assert!(
        report["picture"] == "radiance.exr" && report["made_by"] == "cpu",
        "{report}"
    );
    assert!(report["width"] == 40 && report["height"] == 30, "{report}");
    let seen = radiance(&sandbox, "radiance.exr");
    let shown = |options: &str| {
        let report = render("a.png", options);
        let picture = image::open(sandbox.path("a.png")).expect("a PNG").to_rgba8();
        (
            picture.into_raw(),
            report["exposure_stops"].as_f64().expect("a number"),
        )
    };
    let (auto, stops) = shown("");
    assert_eq!(stops, tone_mapping::auto_exposure_stops(&seen));
    assert!(auto == tone_mapping::display_rgba8(&seen, stops, ToneMap::default()));
    let mut all = vec![auto];
    for (name, tone_map) in ["none", "neutral", "agx", "aces", "soft"]
        .into_iter()
        .zip(ToneMap::ALL)
    {
        let (picture, stops) = shown(&format!("--exposure 1 --tone-map {name}"));
        assert!(
            picture == tone_mapping::display_rgba8(&seen, 1.0, tone_map),
            "{name}"
        );
        assert!(
            stops == 1.0 && !all.contains(&picture),
            "{name} shows what another one shows"
        );
        all.push(picture);
    }
    let plain = shown("--exposure 1").0;
    // Its lamp is white.
    assert!(shown("--exposure 1 --white-balance lamps").0 == plain);
    for white in ["3000", "0.4,0.38"] {
        let picture = shown(&format!("--exposure 1 --white-balance {white}")).0;
        let of: WhiteBalance = white.parse().expect("a white");
        let balanced = seen.clone().white_balanced(&of.matrix(&Scene::default()));
        let expected = tone_mapping::display_rgba8(&balanced, 1.0, ToneMap::default());
        assert!(picture == expected && picture != plain, "{white}");
    }
}

#[test]
fn a_missing_card_fails_only_when_asked_for() {
    let sandbox = Sandbox::new();
    let run = |options: &str| {
        let line = format!("render builtin:mirror -o a.png {QUICK} {options}");
        Run::from(
            without_card(&sandbox, &line)
                .output()
                .expect("the program starts"),
        )
    };
    run("--backend gpu").failed_in_one_sentence(1, &["adapter"]);
    let fallback = run("--json");
    assert_eq!(fallback.code, 0, "{}", fallback.stderr);
    assert_eq!(fallback.json()["made_by"], "cpu");
    assert!(fallback.stderr.contains("CPU"), "{}", fallback.stderr);
}
