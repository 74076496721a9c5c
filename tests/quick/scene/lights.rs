//! Lights with extent from files: what glows, flat lamps, sizes, environments.

use std::f64::consts::FRAC_1_SQRT_2;
use std::path::PathBuf;

use nephroid::error::{ErrorKind, Result};
use nephroid::scene::PanelShape;

use crate::prelude::*;
use support::glb::load_path;

#[track_caller]
fn close(found: f64, expected: f64) {
    assert_close(found, expected, 1e-12, "number");
}

fn glowing(factor: [f64; 3], strength: f64) -> Value {
    json!({
        "emissiveFactor": factor,
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strength } },
    })
}

#[test]
fn what_glows_is_a_light_after_those_of_the_file() {
    let scene = Glb::triangle()
        .with_material(glowing([1.0, 0.5, 0.0], 6830.0))
        .with_light("lamp", json!({ "type": "point" }))
        .scene();
    let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["lamp", "tri"]);
    let lamp = &scene.lights[1];
    let LightKind::Surface { object: 0, radiance } = lamp.kind else {
        panic!("{lamp:?} is no surface");
    };
    close(lamp.colour.luminance(), 1.0);
    let emitted = scene.materials[0].emitted_radiance;
    assert_eq!(emitted.to_array(), [10.0, 5.0, 0.0]);
    for (sent, emitted) in lamp.strength().to_array().into_iter().zip(emitted.to_array()) {
        close(sent, emitted);
    }
    close(radiance.0, emitted.luminance());
    assert!(lamp.has_extent());

    // What only glows gets no sun.
    let with_sun = options(|options| options.default_light = true);
    let file = Glb::triangle().with_material(glowing([1.0; 3], 1.0));
    let lit = file.load_with(&with_sun).expect("it is read");
    assert!(lit.lights.len() == 1 && matches!(lit.lights[0].kind, LightKind::Surface { .. }));
    let black = Glb::triangle().with_material(glowing([1.0; 3], 0.0)).scene();
    assert!(black.lights.is_empty());
    let mut file = Glb::empty();
    let positions = file.push_floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0], 3);
    let mesh = file.push_mesh(json!({ "attributes": { "POSITION": positions } }));
    file.push_root(json!({ "name": "line", "mesh": mesh }));
    let scene = file.with_material(glowing([1.0; 3], 5.0)).scene();
    assert!(scene.lights.is_empty());
    warns(&scene, "triangles without area were dropped");
}

fn with_area_light(light: Value, mut node: Value) -> Glb {
    let mut file = Glb::triangle();
    file.json["extensionsUsed"] = json!(["EXT_lights_area"]);
    file.json["extensionsRequired"] = json!(["EXT_lights_area"]);
    file.json["extensions"]["EXT_lights_area"] = json!({ "lights": [light] });
    node["name"] = json!("panel");
    node["extensions"] = json!({ "EXT_lights_area": { "light": 0 } });
    file.push_root(node);
    file
}

#[test]
fn flat_lamps_follow_their_draft() {
    let light = json!({
        "type": "rect", "intensity": 1366.0, "size": 0.5, "rect": { "aspect": 3.0 }, "color": [1.0, 0.5, 0.25],
        "extras": { "any": "thing" },
    });
    // A quarter turn about x: −z goes to −y... that is, to (0, −1, 0) for +90° about −x.
    let turn = [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
    let node = json!({ "translation": [1.0, 2.0, 3.0], "rotation": turn, "scale": [1.0, -2.0, 1.0] });
    let scene = with_area_light(light, node).scene();
    warns_not(&scene);
    let light = &scene.lights[0];
    assert_eq!(light.name, "panel");
    assert_eq!(light.colour.to_array(), [1.0, 0.5, 0.25]);
    let LightKind::Panel {
        centre,
        across,
        down,
        shape,
        radiance,
    } = light.kind
    else {
        panic!("{light:?}")
    };
    assert_eq!(
        (centre, shape, radiance.0),
        (dvec3(1.0, 2.0, 3.0), PanelShape::Rectangle, 2.0)
    );
    // Scaled by the largest scale, evenly: 1 m high and 3 m wide.
    close(across.length(), 1.5);
    close(down.length(), 0.5);
    near(across.normalize(), DVec3::X, 1e-12, "across");
    near(
        across.cross(down).normalize(),
        DVec3::NEG_Y,
        1e-12,
        "it shines down",
    );

    let disk = with_area_light(json!({ "type": "disk", "size": 0.4 }), json!({})).scene();
    let LightKind::Panel {
        across,
        down,
        shape: PanelShape::Disc,
        radiance,
        ..
    } = disk.lights[0].kind
    else {
        panic!("{disk:?}")
    };
    close(across.length(), 0.2);
    close(down.length(), 0.2);
    close(radiance.0, 1000.0 / 683.0);
    assert!(across.cross(down).z < 0.0, "it shines along −z");
}

#[test]
fn impossible_flat_lamps_are_left_out() {
    for (light, words) in rows(
        r#"
        {"type": "rect", "size": 0.0} => has no area
        {"type": "rect", "rect": {"aspect": -1.0}} => has no area
        {"type": "rect", "on": {"scale": [1.0, 1.0, 0.0]}} => has no area
        {"type": "disk", "size": 1e200} => has no area
        {"type": "sphere"} => unknown shape
        {"type": "disk", "intensity": 0.0} => has no power
        {"type": "disk", "intensity": -1.0} => intensity of -1
        {"type": "disk", "color": [-1.0, 1.0, 1.0]} => colour that is negative
        {"type": "disk", "size": "large"} => does not follow EXT_lights_area
        "#,
    ) {
        let mut light = parsed(light);
        let node = light.as_object_mut().and_then(|light| light.remove("on"));
        let scene = with_area_light(light, node.unwrap_or_else(|| json!({}))).scene();
        assert!(scene.lights.is_empty(), "{words}");
        warns(&scene, &format!("light `panel` | {words} | left out"));
    }
    let mut file = with_area_light(json!({ "type": "disk" }), json!({}));
    file.json["nodes"][1]["extensions"]["EXT_lights_area"]["light"] = json!(7);
    warns(&file.scene(), "is area light 7, which does not exist");
}

fn size_of(light: Value, of_node: Value) -> (LightSize, Scene) {
    let mut file = Glb::triangle().with_light("lamp", light);
    file.json["nodes"][1]["extras"] = of_node;
    let scene = file.scene();
    (scene.lights[0].size, scene)
}

fn point(radius: Value) -> Value {
    json!({ "type": "point", "extras": { "radius_m": radius } })
}

fn sun(angle: Value) -> Value {
    json!({ "type": "directional", "extras": { "angular_diameter_deg": angle } })
}

#[test]
fn sizes_come_from_extras_of_node_or_light() {
    let radius = |radius_m: f64| LightSize::Radius { radius_m };
    let spot = json!({ "type": "spot", "spot": { "outerConeAngle": 0.5 } });
    for (light, of_node, expected) in [
        (point(json!(0.05)), json!({}), radius(0.05)),
        (point(json!(0.05)), json!({ "radius_m": 2 }), radius(2.0)),
        (point(json!(0.0)), json!({}), LightSize::None),
        (spot, json!({ "radius_m": 0.1 }), radius(0.1)),
    ] {
        let (size, scene) = size_of(light, of_node);
        assert_eq!(size, expected);
        assert_eq!(scene.lights[0].has_extent(), size != LightSize::None);
        warns_not(&scene);
    }
    let LightSize::Angle { diameter_rad } = size_of(sun(json!(0.53)), json!(null)).0 else {
        panic!("the sun has a size");
    };
    close(diameter_rad, 0.53_f64.to_radians());
    let impossible = [json!(-1.0), json!(180.1), json!("NaN"), json!([1.0]), json!(null)];
    let suns = impossible
        .iter()
        .map(|angle| (sun(angle.clone()), "angular_diameter_deg"));
    let points = impossible.iter().filter(|radius| **radius != 180.1);
    for (light, name) in suns.chain(points.map(|radius| (point(radius.clone()), "radius_m"))) {
        let (size, scene) = size_of(light, json!({}));
        assert_eq!(size, LightSize::None);
        warns(&scene, &format!("light `lamp` | {name} | no size"));
    }
    let (size, scene) = size_of(json!({ "type": "directional" }), json!({ "radius_m": 1.0 }));
    assert_eq!(size, LightSize::None);
    warns(&scene, "radius_m was ignored | angular_diameter_deg for a sun");
}

/// A scene under an image, of the given format by its name.
fn under(name: &str, bytes: &[u8]) -> Result<Scene> {
    let folder = folder();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("it can be written");
    under_file(path)
}

fn under_file(path: PathBuf) -> Result<Scene> {
    let folder = folder();
    let scene = folder.path().join("t.glb");
    std::fs::write(&scene, Glb::triangle().bytes()).expect("it can be written");
    let under = options(|options| (options.default_light, options.environment) = (true, Some(path)));
    load_path(&scene, &under)
}

fn exr(width: usize, height: usize, pixel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) -> Vec<u8> {
    use exr::prelude::WritableImage;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let channels = exr::prelude::SpecificChannels::rgb(|at: exr::math::Vec2<usize>| pixel(at.x(), at.y()));
    let image = exr::image::Image::from_channels((width, height), channels);
    image.write().to_buffered(&mut bytes).expect("it can be encoded");
    bytes.into_inner()
}

/// A Radiance image of one colour, without run lengths: mantissas and a shared exponent.
fn hdr(width: usize, height: usize, header: &str, rgbe: [u8; 4]) -> Vec<u8> {
    let header = format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
    let mut bytes = header.into_bytes();
    (0..width * height).for_each(|_| bytes.extend(rgbe));
    bytes
}

#[test]
fn environments_are_read_and_light_the_scene() {
    let read = |name: &str, bytes: &[u8]| {
        let scene = under(name, bytes).expect("it is read");
        (scene.environment.clone().expect("it has one"), scene)
    };
    let (sky, scene) = read("sky.exr", &exr(4, 2, |x, y| (x as f32, y as f32, 1e30)));
    let [light] = &scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    assert_eq!(
        (light.name.as_str(), light.kind),
        ("environment", LightKind::Environment { scale: 1.0 })
    );
    assert_eq!(sky.size(), (4, 2));
    assert_eq!(sky.pixels()[4 + 3], [3.0, 1.0, 1e30]);
    assert!(sky.total_w_per_m2().is_finite());
    // 128 · 2^(129 − 136) = 1.
    let rgbe = [128, 64, 32, 129];
    assert_eq!(
        read("sky.hdr", &hdr(3, 2, "", rgbe)).0.pixels(),
        [[1.0, 0.5, 0.25]; 6]
    );
    let dim = read("dim.hdr", &hdr(3, 2, "EXPOSURE=4.0\n", rgbe)).0;
    assert_eq!(dim.pixels()[0], [0.25, 0.125, 0.0625]);
    let (single, _) = read("sky.exr", &exr(1, 1, |_, _| (2.0, 2.0, 2.0)));
    close(single.total_w_per_m2(), 8.0 * PI);
    let black = under("black.exr", &exr(2, 1, |_, _| (0.0, 0.0, 0.0))).expect("it is read");
    warns(&black, "black.exr | the environment is black");
    assert_eq!(
        (black.lights.len(), black.lights[0].name.as_str()),
        (1, "default sun")
    );
}

#[test]
fn skies_beside_a_dark_scene_are_named() {
    let folder = folder();
    let path = folder.path().join("t.glb");
    std::fs::write(&path, Glb::triangle().bytes()).expect("it can be written");
    for name in ["b.HDR", "a.hdr", "c.exr"] {
        std::fs::write(folder.path().join(name), "").expect("it can be written");
    }
    let scene = load_path(&path, &options(|options| options.default_light = true)).expect("it is read");
    let [a, b] = ["a.hdr", "b.HDR"].map(|name| folder.path().join(name).display().to_string());
    let [warning] = &scene.warnings[..] else {
        panic!("{:?}", scene.warnings);
    };
    assert!(
        warning
            .remedy
            .ends_with(&format!("--environment {a} or --environment {b}")),
        "{warning:?}"
    );
}

#[test]
fn environments_that_are_none_get_one_sentence() {
    let white = exr(2, 1, |_, _| (1.0, 1.0, 1.0));
    let red = |value: f32| exr(2, 1, move |_, _| (value, 1.0, 1.0));
    let many = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 99999\n".to_vec();
    let neither = "neither a Radiance nor an OpenEXR";
    let cut_hdr = hdr(5, 5, "", [1, 2, 3, 4])[..80].to_vec();
    for (name, bytes, words) in [
        ("empty.hdr", Vec::new(), neither),
        ("text.hdr", b"Dear sky,".to_vec(), neither),
        ("cut.exr", white[..white.len() / 2].to_vec(), "cannot be decoded"),
        ("cut.hdr", cut_hdr, "cannot be decoded"),
        ("none.hdr", hdr(0, 0, "", [0; 4]), "has no pixels"),
        ("wide.hdr", many, "cannot be decoded"),
        ("negative.exr", red(-1.0), "are no radiance"),
        ("nan.exr", red(f32::NAN), "are no radiance"),
        ("blinding.exr", red(2e36), "holds values above 1e36"),
        ("infinite.exr", red(f32::INFINITY), "are no radiance"),
    ] {
        let error = under(name, &bytes).expect_err(name);
        assert_eq!(error.kind, ErrorKind::Failure);
        says(error, &format!("{words} | {name}"));
    }
    let missing = under_file("nowhere.exr".into()).expect_err("missing");
    says(missing, "nowhere.exr: there is no such file");
}
