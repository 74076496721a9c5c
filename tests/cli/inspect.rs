//! What `inspect` tells.

use crate::program::Sandbox;
use crate::scenes;

#[test]
fn contents_effects_and_reasons() {
    let sandbox = Sandbox::new();
    let report = sandbox.succeed("inspect builtin:ring --json").json();
    assert_eq!(report["scene"], "builtin:ring");
    let names: Vec<&str> = report["objects"]
        .as_array()
        .expect("objects")
        .iter()
        .map(|object| object["name"].as_str().expect("a name"))
        .collect();
    assert!(names.contains(&"floor") && names.contains(&"ring"), "{names:?}");
    // 100 W in all directions, by the reference scene's parameters.
    let power = report["lights"][0]["power_w"].as_f64().expect("a point light");
    assert!((power - 100.0).abs() < 1e-9, "{power} W");
    for effect in report["plan"]["effects"].as_array().expect("effects") {
        assert!(!effect["reason"].as_str().expect("a reason").is_empty());
    }
    let text = sandbox.succeed("inspect builtin:ring").stdout;
    for word in [
        "light_pass: on",
        "refraction: off",
        "100.0000 W",
        "floor",
        "diffuse",
        "mirror",
    ] {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
}

#[test]
fn lights_are_told_with_kind_size_and_strength() {
    let sandbox = Sandbox::new();
    sandbox.write("lamps.gltf", scenes::lamps_with_extent());
    sandbox.write("sky.hdr", scenes::grey_sky());
    let command = "inspect lamps.gltf --environment sky.hdr --map-resolution 16";
    let report = sandbox.succeed(&format!("{command} --json")).json();
    let lights = report["lights"].as_array().expect("lights");
    let kinds: Vec<&str> = lights
        .iter()
        .map(|light| light["kind"].as_str().expect("a kind"))
        .collect();
    assert_eq!(kinds, ["point", "sun", "panel", "surface", "environment"]);
    let number = |light: usize, field: &str| lights[light][field].as_f64().expect(field);
    let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12, "{found}");
    close(number(0, "radius_m"), 0.05);
    close(number(1, "angular_diameter_deg"), 0.53);
    close(number(2, "area_m2"), 0.5);
    close(number(2, "power_w"), 0.5 * std::f64::consts::PI);
    close(number(3, "area_m2"), 0.5);
    close(number(3, "power_w"), 0.5 * std::f64::consts::PI);
    close(
        number(4, "spherical_irradiance_w_per_m2"),
        4.0 * std::f64::consts::PI,
    );
    let text = sandbox.succeed(command).stdout;
    for word in [
        "0.0500 m radius",
        "0.5300 degrees across",
        "panel, 0.5000 m^2",
        "12.5664 W/m^2 from all",
    ] {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
}

#[test]
fn the_estimate_of_rays_follows_the_density() {
    let sandbox = Sandbox::new();
    let rays = |density: &str| {
        let report = sandbox
            .succeed(&format!("inspect builtin:mirror --json --density {density}"))
            .json();
        report["estimated_rays"].as_f64().expect("a number")
    };
    let ratio = rays("4e6") / rays("1e6");
    assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
}

#[test]
fn what_a_bake_would_take_for_every_preset() {
    let sandbox = Sandbox::new();
    let report = sandbox
        .succeed("inspect builtin:ring --json --map-resolution 64")
        .json();
    let presets = report["presets"].as_array().expect("presets");
    let of = |preset: &serde_json::Value, field: &str| preset[field].as_f64().expect("a number");
    assert_eq!(presets.len(), 3);
    for (preset, (name, target)) in presets
        .iter()
        .zip([("draft", 0.1), ("preview", 0.03), ("final", 0.01)])
    {
        assert_eq!(preset["preset"], name);
        assert!((of(preset, "target") - target).abs() < 1e-12);
        assert!(of(preset, "rays") > 100.0 && of(preset, "cpu_s") > 0.0 && of(preset, "bytes") > 64.0 * 64.0);
    }
    // On so small a map the pilot may already be good enough for all of them.
    assert!(of(&presets[0], "rays") <= of(&presets[2], "rays"));
    let map = &report["maps"][0];
    assert_eq!((&map["surface"], &map["width"]), (&"floor".into(), &64.into()));
    let effects = report["pilot"]["effects"].as_array().expect("effects");
    let rays = |name: &str| {
        let effect = effects.iter().find(|effect| effect["effect"] == name);
        effect.expect("a line for every effect")["counts"]["rays"]
            .as_u64()
            .expect("a count")
    };
    assert!(rays("reflection") > 0 && rays("light_pass") > 0);
    assert_eq!(
        (rays("refraction"), rays("absorption"), rays("direct")),
        (0, 0, 0)
    );
}

#[test]
fn effects_that_are_switched_off_say_so() {
    let sandbox = Sandbox::new();
    let text = sandbox
        .succeed("inspect builtin:ball --map-resolution 32 --effects refraction=off,chains=off")
        .stdout;
    assert!(
        text.contains("refraction: off, switched off by the user"),
        "{text}"
    );
    let refused = sandbox.run("inspect builtin:ball --effects refraction=sideways");
    refused.failed_in_one_sentence(2, &["auto, on or off"]);
}

#[test]
fn a_bake_tells_what_was_expected_and_what_it_took() {
    let sandbox = Sandbox::new();
    let manifest = sandbox
        .succeed("bake builtin:ring -o out --max-error 2% --map-resolution 64 --json")
        .json();
    let forecast = &manifest["forecast"];
    let rays = |part: &str| forecast[part]["rays"].as_f64().expect("a count");
    assert!(rays("made_at") > 0.0 && rays("expected") >= rays("made_at"));
    assert_eq!(
        rays("actual"),
        manifest["counts"]["rays"].as_f64().expect("a count")
    );
    let ratio = rays("actual") / rays("expected");
    assert!((0.2..5.0).contains(&ratio), "{forecast}");
    assert!(manifest["course"].as_array().expect("points").len() >= 2);
}

#[test]
fn glasses_metals_and_spectra_are_told() {
    let sandbox = Sandbox::new();
    sandbox.write("glasses.gltf", scenes::glasses());
    let command = "inspect glasses.gltf --map-resolution 16";
    let report = sandbox.succeed(&format!("{command} --json")).json();
    let glass = &report["materials"][0]["glass"];
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    assert_eq!(
        (&glass["name"], &glass["range_nm"][0]),
        (&"N-SF11".into(), &370.0.into())
    );
    // SCHOTT's data sheet of N-SF11.
    assert!((number(&glass["n_d"]) - 1.78472).abs() < 1e-5);
    assert!((number(&glass["abbe_number"]) - 25.68).abs() < 5e-3);
    assert_eq!(report["materials"][1]["metal"], "Gold");
    let spectrum = &report["lights"][0]["spectrum"];
    assert_eq!(spectrum["name"], "A");
    // CIE 15:2018: illuminant A is a black body of 2856 K.
    assert!((number(&spectrum["correlated_temperature_k"]) - 2856.0).abs() < 2.0);
    assert_eq!(report["lights"][1]["spectrum"], serde_json::Value::Null);
    let text = sandbox.succeed(command).stdout;
    for word in [
        "ior 1.7847, N-SF11 (V_d 25.7, measured from 370 to 2500 nm)",
        "Gold by wavelength",
        "spectrum `A` of 2856 K, 360 to 830 nm, ",
        " lm/W",
        "dispersion: ",
    ] {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
    // Light of one colour alone has the largest efficacy there is: 683 lm/W at 555 nm.
    let line = spectrum_of_a_line(&sandbox);
    assert!((line - 683.0).abs() < 1.0, "{line} lm/W");
}

fn spectrum_of_a_line(sandbox: &Sandbox) -> f64 {
    sandbox.write("line.gltf", scenes::glasses().replace("\"A\"", "\"line:555\""));
    let report = sandbox
        .succeed("inspect line.gltf --json --map-resolution 16")
        .json();
    let efficacy = report["lights"][0]["spectrum"]["lumens_per_watt"].as_f64();
    efficacy.expect("a number")
}
