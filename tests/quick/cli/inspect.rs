//! What `inspect` tells, and `compare`: maps against references whose measures are known.

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
    let mut before = [100.0, 0.0, 64.0 * 64.0];
    for (preset, (name, target)) in list("presets").iter().zip(targets) {
        assert_eq!(preset["preset"], name);
        assert_close(number(&preset["target"]), target, 1e-12, name);
        // The better the dearer.
        let costs = ["rays", "cpu_s", "bytes"].map(|field| number(&preset[field]));
        assert!(
            costs.iter().zip(before).all(|(cost, less)| *cost >= less),
            "{preset}"
        );
        before = costs;
    }
    let map = &list("maps")[0];
    assert_eq!((&map["surface"], &map["width"]), (&"floor".into(), &64.into()));
    let [rays, shadow_rays] = ["rays", "shadow_rays"].map(|name| number(&report["pilot"]["counts"][name]));
    // Caustics are judged beside direct light.
    assert!(rays > 0.0 && shadow_rays > 0.0);
    let words = "light_pass: on | refraction: off | 100.0000 W | floor | diffuse | mirror";
    assert_tells(&sandbox, inspect, words);
}

#[test]
fn lights_have_kind_size_and_strength() {
    let sandbox = Sandbox::new();
    sandbox.write("lamps.glb", files::lamps_with_extent());
    sandbox.write("sky.hdr", files::grey_sky());
    let inspect = "inspect lamps.glb --environment sky.hdr --map-resolution 16";
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
    sandbox.write("glasses.glb", files::glasses("A"));
    let inspect = "inspect glasses.glb --map-resolution 16";
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
    sandbox.write("line.glb", files::glasses("line:555"));
    let report = sandbox
        .succeed("inspect line.glb --json --map-resolution 16")
        .json();
    let spectrum = &report["lights"][0]["spectrum"];
    near(number(&spectrum["lumens_per_watt"]), 683.0, 1.0, "lm/W");
}

/// What the measures are worth is held beside them; here that they are told.
#[test]
fn measures_of_known_pairs() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("ones.pfm", 7, 3, |_, _| 1.0);
    sandbox.write_pfm("more.pfm", 7, 3, |_, _| 1.25);
    sandbox.write_pfm("small.pfm", 2, 3, |column, row| (1 + column + 2 * row) as f32);
    // Each texel split in four that average to it.
    sandbox.write_pfm("large.pfm", 4, 6, |column, row| {
        let mean = (1 + column / 2 + 2 * (row / 2)) as f32;
        mean + [0.25, -0.25][(column + row) % 2]
    });
    let more =
        r#"{"relative_rmse": 0.25, "average_relative_difference": 0.25, "flux_ratio": 1.25, "peak": 1.25}"#;
    let same_size = r#"{"relative_rmse": 0, "width": 2, "height": 3}"#;
    for (pair, expected) in [
        ("more.pfm ones.pfm", more),
        ("ones.pfm ones.pfm --max-rmse 0", r#"{"relative_rmse": 0}"#),
        ("large.pfm small.pfm --max-rmse 0", same_size),
        ("small.pfm large.pfm --max-rmse 0", same_size),
    ] {
        let report = sandbox.succeed(&format!("compare {pair} --json")).json();
        for (name, expected) in parsed(expected).as_object().expect("measures") {
            let [found, expected] = [&report[name], expected].map(|value| value.as_f64().expect(name));
            near(found, expected, 1e-12, name);
        }
    }
}

#[test]
fn the_difference_picture_shows_where() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("reference.pfm", 3, 1, |_, _| 1.0);
    sandbox.write_pfm("map.pfm", 3, 1, |column, _| [2.0, 1.0, 0.0][column]);
    sandbox.succeed("compare map.pfm reference.pfm --difference difference.png");
    let picture = image::open(sandbox.path("difference.png"))
        .expect("a PNG")
        .to_rgb8();
    assert_eq!(picture.dimensions(), (3, 1));
    let [brighter, equal, darker] = [0, 1, 2].map(|column| picture.get_pixel(column, 0).0);
    assert!(
        brighter[0] == 255 && brighter[1].max(brighter[2]) < 200,
        "{brighter:?}"
    );
    assert_eq!(equal, [255; 3]);
    assert!(darker[2] == 255 && darker[0].max(darker[1]) < 200, "{darker:?}");
}

#[test]
fn a_baked_map_meets_its_reference() {
    let sandbox = Sandbox::new();
    let reference = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/S5.pfm");
    sandbox.succeed("bake builtin:mirror -o out --max-error 1% --error-metric rmse --map-resolution 64");
    let map = "out/maps/0000_floor.exr";
    let run = sandbox.succeed(&format!("compare {map} {reference} --json --max-rmse 5"));
    assert_eq!(run.json()["layer"], json!("caustic"));
    // A wrong layer is refused, not replaced.
    let wrong = sandbox.run(&format!("compare {map} {reference} --layer direct"));
    wrong.failed_in_one_sentence(1, &["caustic.R"]);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("ones.pfm", 2, 2, |_, _| 1.0);
    sandbox.write_pfm("odd.pfm", 3, 3, |_, _| 1.0);
    sandbox.write_pfm("dark.pfm", 2, 2, |_, _| 0.0);
    let nan = |column, row| if column + row == 2 { f32::NAN } else { 1.0 };
    sandbox.write_pfm("nan.pfm", 2, 2, nan);
    sandbox.write("short.pfm", "Pf\n2 2\n-1.0\nabc");
    sandbox.write("text.exr", "hello");
    sandbox.write("cut.exr", [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]);
    for (files, words) in rows(
        "ones.pfm dark.pfm => dark.pfm | the reference is dark
         ones.pfm odd.pfm => 2x2 | 3x3 | multiples
         nan.pfm ones.pfm => nan.pfm | column 1, row 1
         short.pfm ones.pfm => short.pfm
         text.exr ones.pfm => text.exr | neither
         cut.exr ones.pfm => cut.exr
         missing.exr ones.pfm => missing.exr
         ones.pfm missing.exr => missing.exr
         ones.pfm ones.pfm --difference no/d.png => no/d.png",
    ) {
        let run = sandbox.run(&format!("compare {files}"));
        run.failed_in_one_sentence(1, &words.split(" | ").collect::<Vec<_>>());
    }
}
