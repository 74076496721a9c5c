//! What `inspect` tells.

use crate::program::Sandbox;

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
