//! What `inspect` tells.

use crate::prelude::*;
use support::files;
use support::program::{Sandbox, number};

#[track_caller]
fn assert_tells(sandbox: &Sandbox, line: &str, words: &str) {
    let text = sandbox.succeed(line).stdout;
    for word in words.split(" | ") {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
}

#[test]
fn contents_effects_and_what_presets_take() {
    let sandbox = Sandbox::new();
    let inspect = "inspect builtin:ring --map-resolution 64";
    let report = sandbox.succeed(&format!("{inspect} --json")).json();
    assert_eq!(report["scene"], "builtin:ring");
    let list = |name: &str| report[name].as_array().expect("a list");
    for object in ["floor", "ring"] {
        assert!(
            list("objects").iter().any(|known| known["name"] == object),
            "{object}"
        );
    }
    // 100 W in all directions, by the reference scene's parameters.
    assert_close(number(&report["lights"][0]["power_w"]), 100.0, 1e-11, "power");
    for effect in report["plan"]["effects"].as_array().expect("effects") {
        assert!(!effect["reason"].as_str().expect("a reason").is_empty());
    }
    let targets = [("draft", 0.1), ("preview", 0.03), ("final", 0.01)];
    assert_eq!(list("presets").len(), targets.len());
    for (preset, (name, target)) in list("presets").iter().zip(targets) {
        assert_eq!(preset["preset"], name);
        assert_close(number(&preset["target"]), target, 1e-12, name);
        let [rays, cpu_s, bytes] = ["rays", "cpu_s", "bytes"].map(|field| number(&preset[field]));
        assert!(rays > 100.0 && cpu_s > 0.0 && bytes > 64.0 * 64.0, "{preset}");
    }
    // Each has a pilot of its own: a draft may take more rays, by photons, but never more memory.
    assert!(number(&list("presets")[0]["bytes"]) <= number(&list("presets")[2]["bytes"]));
    let map = &list("maps")[0];
    assert_eq!((&map["surface"], &map["width"]), (&"floor".into(), &64.into()));
    let [rays, shadow_rays] = ["rays", "shadow_rays"].map(|name| number(&report["pilot"]["counts"][name]));
    assert!(rays > 0.0 && shadow_rays == 0.0);
    let words = "light_pass: on | refraction: off | 100.0000 W | floor | diffuse | mirror";
    assert_tells(&sandbox, inspect, words);
}

#[test]
fn lights_have_kind_size_and_strength() {
    let sandbox = Sandbox::new();
    sandbox.write("lamps.gltf", files::lamps_with_extent());
    sandbox.write("sky.hdr", files::grey_sky());
    let inspect = "inspect lamps.gltf --environment sky.hdr --map-resolution 16";
    let report = sandbox.succeed(&format!("{inspect} --json")).json();
    let lights = report["lights"].as_array().expect("lights");
    let kinds: Vec<&str> = lights.iter().filter_map(|light| light["kind"].as_str()).collect();
    assert_eq!(kinds, ["point", "sun", "panel", "surface", "environment"]);
    for (light, field, expected) in [
        (0, "radius_m", 0.05),
        (1, "angular_diameter_deg", 0.53),
        (2, "area_m2", 0.5),
        (2, "power_w", 0.5 * PI),
        (3, "area_m2", 0.5),
        (3, "power_w", 0.5 * PI),
        (4, "spherical_irradiance_w_per_m2", 4.0 * PI),
    ] {
        assert_close(number(&lights[light][field]), expected, 1e-12, field);
    }
    let words = "0.0500 m radius | 0.5300 degrees across | panel, 0.5000 m^2 | 12.5664 W/m^2 from all";
    assert_tells(&sandbox, inspect, words);
}

#[test]
fn rays_follow_the_density_and_switches_are_told() {
    let sandbox = Sandbox::new();
    let rays = |density: &str| {
        let run = sandbox.succeed(&format!("inspect builtin:mirror --json --density {density}"));
        number(&run.json()["estimated_rays"])
    };
    near(rays("4e6") / rays("1e6"), 4.0, 0.1, "four times the density");
    let inspect = "inspect builtin:ball --map-resolution 32 --effects refraction=off,chains=off";
    assert_tells(&sandbox, inspect, "refraction: off, switched off by the user");
}

#[test]
fn glasses_metals_and_spectra_are_told() {
    let sandbox = Sandbox::new();
    sandbox.write("glasses.gltf", files::glasses());
    let inspect = "inspect glasses.gltf --map-resolution 16";
    let report = sandbox.succeed(&format!("{inspect} --json")).json();
    let glass = &report["materials"][0]["glass"];
    assert!(
        glass["name"] == "N-SF11" && glass["range_nm"][0] == 370.0,
        "{glass}"
    );
    // SCHOTT's data sheet of N-SF11.
    near(number(&glass["n_d"]), 1.78472, 1e-5, "n_d");
    near(number(&glass["abbe_number"]), 25.68, 5e-3, "V_d");
    assert_eq!(report["materials"][1]["metal"], "Gold");
    let spectrum = &report["lights"][0]["spectrum"];
    assert_eq!(spectrum["name"], "A");
    // CIE 15:2018: illuminant A is a black body of 2856 K.
    near(
        number(&spectrum["correlated_temperature_k"]),
        2856.0,
        2.0,
        "temperature",
    );
    assert_eq!(report["lights"][1]["spectrum"], Value::Null);
    let words = "ior 1.7847, N-SF11 (V_d 25.7, measured from 370 to 2500 nm) | Gold by wavelength | \
                 spectrum `A` of 2856 K, 360 to 830 nm, | lm/W | dispersion: ";
    assert_tells(&sandbox, inspect, words);
    // Light of one colour alone has the largest efficacy there is: 683 lm/W at 555 nm.
    sandbox.write("line.gltf", files::glasses().replace("\"A\"", "\"line:555\""));
    let report = sandbox
        .succeed("inspect line.gltf --json --map-resolution 16")
        .json();
    let spectrum = &report["lights"][0]["spectrum"];
    near(number(&spectrum["lumens_per_watt"]), 683.0, 1.0, "lm/W");
}
