//! Lights with extent from files: what glows, flat lamps, sizes, environments.

use std::path::PathBuf;

use glam::DVec3;
use nephroid::error::ErrorKind;
use nephroid::scene::{Light, LightKind, LightSize, LoadOptions, PanelShape, Scene, load};
use serde_json::{Value, json};

use support::glb::{Glb, assert_warned};

#[track_caller]
fn close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= 1e-12 * expected.abs(),
        "{found} for {expected}"
    );
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
    let LightKind::Surface { object, radiance } = lamp.kind else {
        panic!("{lamp:?} is no surface");
    };
    assert_eq!(object, 0);
    close(lamp.colour.luminance(), 1.0);
    let emitted = scene.materials[0].emitted_radiance;
    assert_eq!(emitted.to_array(), [10.0, 5.0, 0.0]);
    for (sent, emitted) in lamp.strength().to_array().into_iter().zip(emitted.to_array()) {
        close(sent, emitted);
    }
    close(radiance.0, emitted.luminance());
    assert!(lamp.has_extent());
}

#[test]
fn a_scene_that_only_glows_gets_no_sun() {
    let options = LoadOptions {
        default_light: true,
        ..LoadOptions::default()
    };
    let dark = Glb::triangle().load_with(&options).expect("it is read");
    assert_eq!(dark.lights[0].name, "default sun");
    let file = Glb::triangle().with_material(glowing([1.0; 3], 1.0));
    let lit = file.load_with(&options).expect("it is read");
    assert_eq!(lit.lights.len(), 1);
    assert!(matches!(lit.lights[0].kind, LightKind::Surface { .. }));
    let black = Glb::triangle().with_material(glowing([1.0; 3], 0.0)).scene();
    assert!(black.lights.is_empty());
}

#[test]
fn a_glowing_triangle_without_area_is_no_light() {
    let mut file = Glb::empty();
    let positions = file.push_floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0], 3);
    let mesh = file.push_mesh(json!({ "attributes": { "POSITION": positions } }));
    file.push_root(json!({ "name": "line", "mesh": mesh }));
    let scene = file.with_material(glowing([1.0; 3], 5.0)).scene();
    assert!(scene.lights.is_empty());
    assert_warned(&scene, &["triangles without area were dropped"]);
}

/// A file with one flat lamp on the node `panel`.
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

fn panel(light: &Light) -> (DVec3, DVec3, DVec3, PanelShape, f64) {
    match light.kind {
        LightKind::Panel {
            centre,
            across,
            down,
            shape,
            radiance,
        } => (centre, across, down, shape, radiance.0),
        _ => panic!("{light:?} is no panel"),
    }
}

#[test]
fn flat_lamps_follow_their_draft() {
    let light = json!({
        "type": "rect", "intensity": 1366.0, "size": 0.5, "rect": { "aspect": 3.0 }, "color": [1.0, 0.5, 0.25],
        "extras": { "any": "thing" },
    });
    // A quarter turn about x: −z goes to −y... that is, to (0, −1, 0) for +90° about −x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let node = json!({ "translation": [1.0, 2.0, 3.0], "rotation": [-half, 0.0, 0.0, half], "scale": [1.0, -2.0, 1.0] });
    let scene = with_area_light(light, node).scene();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let light = &scene.lights[0];
    assert_eq!(light.name, "panel");
    assert_eq!(light.colour.to_array(), [1.0, 0.5, 0.25]);
    let (centre, across, down, shape, radiance) = panel(light);
    assert_eq!(
        (centre, shape, radiance),
        (DVec3::new(1.0, 2.0, 3.0), PanelShape::Rectangle, 2.0)
    );
    // Scaled by the largest scale, evenly: 1 m high and 3 m wide.
    close(across.length(), 1.5);
    close(down.length(), 0.5);
    assert!(across.normalize().abs_diff_eq(DVec3::X, 1e-12), "{across}");
    let along = across.cross(down).normalize();
    assert!(along.abs_diff_eq(DVec3::NEG_Y, 1e-12), "it shines along {along}");
}

#[test]
fn disks_and_defaults_of_flat_lamps() {
    let (_, across, down, shape, radiance) = panel(
        &with_area_light(json!({ "type": "disk", "size": 0.4 }), json!({}))
            .scene()
            .lights[0],
    );
    assert_eq!(shape, PanelShape::Disc);
    close(across.length(), 0.2);
    close(down.length(), 0.2);
    close(radiance, 1000.0 / 683.0);
    assert!(across.cross(down).z < 0.0, "it shines along −z");
}

#[test]
fn flat_lamps_that_cannot_be_are_left_out() {
    for (light, node, words) in [
        (json!({ "type": "rect", "size": 0.0 }), json!({}), "has no area"),
        (
            json!({ "type": "rect", "rect": { "aspect": -1.0 } }),
            json!({}),
            "has no area",
        ),
        (
            json!({ "type": "rect" }),
            json!({ "scale": [1.0, 1.0, 0.0] }),
            "has no area",
        ),
        (json!({ "type": "disk", "size": 1e200 }), json!({}), "has no area"),
        (json!({ "type": "sphere" }), json!({}), "unknown shape"),
        (
            json!({ "type": "disk", "intensity": 0.0 }),
            json!({}),
            "has no power",
        ),
        (
            json!({ "type": "disk", "intensity": -1.0 }),
            json!({}),
            "intensity of -1",
        ),
        (
            json!({ "type": "disk", "color": [-1.0, 1.0, 1.0] }),
            json!({}),
            "colour that is negative",
        ),
        (
            json!({ "type": "disk", "size": "large" }),
            json!({}),
            "does not follow EXT_lights_area",
        ),
    ] {
        let scene = with_area_light(light, node).scene();
        assert!(scene.lights.is_empty(), "{words}");
        assert_warned(&scene, &["light `panel`", words, "left out"]);
    }
    let mut file = with_area_light(json!({ "type": "disk" }), json!({}));
    file.json["nodes"][1]["extensions"]["EXT_lights_area"]["light"] = json!(7);
    assert_warned(&file.scene(), &["is area light 7, which does not exist"]);
}

fn size_of(light: Value, of_node: Value) -> (LightSize, Scene) {
    let mut file = Glb::triangle().with_light("lamp", light);
    file.json["nodes"][1]["extras"] = of_node;
    let scene = file.scene();
    (scene.lights[0].size, scene)
}

#[test]
fn sizes_come_from_extras_of_the_node_or_else_of_the_light() {
    let point = |radius: Value| json!({ "type": "point", "extras": { "radius_m": radius } });
    let radius = |radius_m: f64| LightSize::Radius { radius_m };
    assert_eq!(size_of(point(json!(0.05)), json!({})).0, radius(0.05));
    assert_eq!(
        size_of(point(json!(0.05)), json!({ "radius_m": 2 })).0,
        radius(2.0)
    );
    assert_eq!(size_of(point(json!(0.0)), json!({})).0, LightSize::None);
    let spot = json!({ "type": "spot", "spot": { "outerConeAngle": 0.5 } });
    let (size, scene) = size_of(spot, json!({ "radius_m": 0.1 }));
    assert_eq!((size, scene.warnings.len()), (radius(0.1), 0));
    assert!(scene.lights[0].has_extent());
    let sun = json!({ "type": "directional", "extras": { "angular_diameter_deg": 0.53 } });
    let LightSize::Angle { diameter_rad } = size_of(sun, json!(null)).0 else {
        panic!("the sun has a size");
    };
    close(diameter_rad, 0.53_f64.to_radians());
}

#[test]
fn sizes_that_cannot_be_are_named() {
    let sun = |angle: Value| json!({ "type": "directional", "extras": { "angular_diameter_deg": angle } });
    for number in [json!(-1.0), json!(180.1), json!("NaN"), json!([1.0]), json!(null)] {
        let (size, scene) = size_of(sun(number.clone()), json!({}));
        assert_eq!(size, LightSize::None);
        assert_warned(&scene, &["light `lamp`", "angular_diameter_deg", "no size"]);
        let point = json!({ "type": "point", "extras": { "radius_m": number } });
        let (size, scene) = size_of(point, json!({}));
        if number != 180.1 {
            assert_eq!(size, LightSize::None);
            assert_warned(&scene, &["light `lamp`", "radius_m", "no size"]);
        }
    }
    let (size, scene) = size_of(json!({ "type": "directional" }), json!({ "radius_m": 1.0 }));
    assert_eq!(size, LightSize::None);
    assert_warned(
        &scene,
        &["radius_m was ignored", "angular_diameter_deg for a sun"],
    );
}

/// A scene under an image, of the given format by its name.
fn under(name: &str, bytes: &[u8]) -> nephroid::error::Result<Scene> {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("it can be written");
    under_file(path)
}

fn under_file(path: PathBuf) -> nephroid::error::Result<Scene> {
    let scene = folder_scene();
    let options = LoadOptions {
        default_light: true,
        environment: Some(path),
        ..LoadOptions::default()
    };
    load(scene.path().join("t.glb").to_str().expect("UTF-8"), &options)
}

fn folder_scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("temporary folder");
    std::fs::write(folder.path().join("t.glb"), Glb::triangle().bytes()).expect("it can be written");
    folder
}

/// An OpenEXR image.
fn exr(width: usize, height: usize, pixel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) -> Vec<u8> {
    use exr::prelude::WritableImage;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let channels = exr::prelude::SpecificChannels::rgb(|at: exr::math::Vec2<usize>| pixel(at.x(), at.y()));
    exr::image::Image::from_channels((width, height), channels)
        .write()
        .to_buffered(&mut bytes)
        .expect("it can be encoded");
    bytes.into_inner()
}

/// A Radiance image of one colour, without run lengths: mantissas and a shared exponent.
fn hdr(width: usize, height: usize, header: &str, rgbe: [u8; 4]) -> Vec<u8> {
    let mut bytes =
        format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    (0..width * height).for_each(|_| bytes.extend(rgbe));
    bytes
}

#[test]
fn environments_are_read_and_light_the_scene() {
    let scene = under("sky.exr", &exr(4, 2, |x, y| (x as f32, y as f32, 1e30))).expect("it is read");
    let [light] = &scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    assert_eq!(
        (light.name.as_str(), light.kind),
        ("environment", LightKind::Environment { scale: 1.0 })
    );
    let sky = scene.environment.expect("it has one");
    assert_eq!(sky.size(), (4, 2));
    assert_eq!(sky.pixels()[4 + 3], [3.0, 1.0, 1e30]);
    assert!(sky.total_w_per_m2().is_finite());
    // 128 · 2^(129 − 136) = 1.
    let scene = under("sky.hdr", &hdr(3, 2, "", [128, 64, 32, 129])).expect("it is read");
    let sky = scene.environment.expect("it has one");
    assert_eq!(sky.pixels(), [[1.0, 0.5, 0.25]; 6]);
    let scene = under("dim.hdr", &hdr(3, 2, "EXPOSURE=4.0\n", [128, 64, 32, 129])).expect("it is read");
    assert_eq!(
        scene.environment.expect("it has one").pixels()[0],
        [0.25, 0.125, 0.0625]
    );
}

#[test]
fn a_single_pixel_is_a_sky_and_a_black_one_gives_no_light() {
    let scene = under("sky.exr", &exr(1, 1, |_, _| (2.0, 2.0, 2.0))).expect("it is read");
    let sky = scene.environment.expect("it has one");
    close(sky.total_w_per_m2(), 8.0 * std::f64::consts::PI);
    let scene = under("black.exr", &exr(2, 1, |_, _| (0.0, 0.0, 0.0))).expect("it is read");
    assert_warned(&scene, &["black.exr", "the environment is black"]);
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(scene.lights[0].name, "default sun");
}

#[test]
fn environments_that_are_none_get_one_sentence() {
    let sound = exr(2, 1, |_, _| (1.0, 1.0, 1.0));
    let many = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 99999\n".to_vec();
    for (name, bytes, words) in [
        ("empty.hdr", Vec::new(), "neither a Radiance nor an OpenEXR"),
        (
            "text.hdr",
            b"Dear sky,".to_vec(),
            "neither a Radiance nor an OpenEXR",
        ),
        ("cut.exr", sound[..sound.len() / 2].to_vec(), "cannot be decoded"),
        (
            "cut.hdr",
            hdr(5, 5, "", [1, 2, 3, 4])[..80].to_vec(),
            "cannot be decoded",
        ),
        ("none.hdr", hdr(0, 0, "", [0; 4]), "has no pixels"),
        ("wide.hdr", many, "cannot be decoded"),
        (
            "negative.exr",
            exr(2, 1, |_, _| (1.0, -1.0, 1.0)),
            "are no radiance",
        ),
        (
            "nan.exr",
            exr(2, 1, |_, _| (f32::NAN, 1.0, 1.0)),
            "are no radiance",
        ),
        (
            "blinding.exr",
            exr(2, 1, |_, _| (2e36, 1.0, 1.0)),
            "holds values above 1e36",
        ),
        (
            "infinite.exr",
            exr(2, 1, |_, _| (f32::INFINITY, 1.0, 1.0)),
            "are no radiance",
        ),
    ] {
        let error = under(name, &bytes).expect_err(name);
        let sentence = error.to_string();
        assert_eq!(error.kind, ErrorKind::Failure);
        assert!(
            sentence.contains(words) && sentence.contains(name) && !sentence.contains('\n'),
            "{name}: {sentence}"
        );
    }
    assert!(
        under_file("nowhere.exr".into())
            .expect_err("missing")
            .to_string()
            .contains("nowhere.exr: there is no such file")
    );
}
