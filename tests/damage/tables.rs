//! Camera paths and tables of spectra.

use std::fmt::Write as _;

use nephroid::optics::spectrum::csv::read_lamp;
use nephroid::scene::CameraPath;
use serde_json::json;

use crate::mutate::{Damage, effort};
use crate::watch::Tally;

/// Memory that so small a file may take [bytes].
const MOST_BYTES: usize = 16 << 20;

#[test]
fn camera_paths() {
    let _alone = crate::watch::alone();
    let key = |x: f64| json!({ "position_m": [x, 1.0, 3.0], "target_m": [0.0, 0.5, -x] });
    let path = json!({ "frames": 30, "vertical_fov_deg": 50, "keys": [key(0.0), key(1.5), key(-2.0)] });
    let text = path.to_string();
    let tally = Tally::default();
    for number in 0..2_000 * effort() {
        let mut damage = Damage::to("walk.json", number);
        let bytes = if damage.below(2) == 0 {
            let mut path = path.clone();
            damage.json(&mut path);
            path.to_string().into_bytes()
        } else {
            damage.text(&text)
        };
        let parse = || CameraPath::parse(&bytes, "walk.json");
        if let Some(path) = tally.watch((&format!("{number}-walk.json"), &bytes), MOST_BYTES, parse) {
            let cameras = path.cameras(glam::DVec3::ZERO);
            let is_sound = |camera: &nephroid::scene::Camera| {
                camera.position.is_finite() && (camera.forward.length() - 1.0).abs() < 1e-12
            };
            let text = String::from_utf8_lossy(&bytes);
            assert!(!cameras.is_empty() && cameras.iter().all(is_sound), "{text}");
        }
    }
    println!("camera paths: {tally:?}");
    assert!(tally.taken.get() > 100 && tally.refused.get() > 100, "{tally:?}");
}

#[test]
fn tables_of_spectra() {
    let _alone = crate::watch::alone();
    let mut table = String::from("# a lamp\nnm, W/nm\n");
    for row in 0..40 {
        let _ = writeln!(table, "{}, {:.3}", 380 + 10 * row, f64::from(row % 7) * 0.25);
    }
    let tally = Tally::default();
    for number in 0..2_000 * effort() {
        let bytes = Damage::to("lamp.csv", number).text(&table);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let read = || {
            let lamp = read_lamp(&text).and_then(|lamp| lamp.to_luminous_equivalent(1.0));
            lamp.map_err(|error| error.at("lamp.csv"))
        };
        if let Some(lamp) = tally.watch((&format!("{number}-lamp.csv"), &bytes), MOST_BYTES, read) {
            let colour = lamp.xyz().to_linear_srgb();
            assert!(colour.is_finite(), "{colour:?} of {text}");
            let luminance = colour.luminance();
            assert!((luminance - 1.0).abs() < 1e-9, "{luminance} of {text}");
        }
    }
    println!("tables of spectra: {tally:?}");
    assert!(tally.taken.get() > 100 && tally.refused.get() > 100, "{tally:?}");
}
