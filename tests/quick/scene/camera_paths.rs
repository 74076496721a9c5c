//! Ways for a camera, from files.

use glam::DVec3;
use nephroid::scene::CameraPath;
use serde_json::{Value, json};

fn parse(document: &Value) -> Result<CameraPath, String> {
    CameraPath::parse(document.to_string().as_bytes(), "walk.json").map_err(|error| error.to_string())
}

fn key(position: [f64; 3], target: [f64; 3]) -> Value {
    json!({"position_m": position, "target_m": target})
}

/// Two metres along x, then one up; always looking 5 m to the north of where it started.
fn walk(frames: usize) -> Value {
    let target = [0.0, 0.0, -5.0];
    let keys = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]].map(|position| key(position, target));
    json!({"frames": frames, "vertical_fov_deg": 60, "keys": keys})
}

#[test]
fn frames_are_spread_evenly_over_the_spans_between_keys() {
    let cameras = parse(&walk(5)).expect("it is a path").cameras(DVec3::ZERO);
    let positions: Vec<DVec3> = cameras.iter().map(|camera| camera.position).collect();
    let expected = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 0.5, 0.0],
        [2.0, 1.0, 0.0],
    ];
    assert_eq!(positions, expected.map(DVec3::from_array));
    for camera in &cameras {
        let towards = (DVec3::new(0.0, 0.0, -5.0) - camera.position).normalize();
        assert!(camera.forward.dot(towards) > 1.0 - 1e-12, "{camera:?}");
        assert!(camera.up.dot(DVec3::Y) > 0.9, "{camera:?}");
        assert!((camera.vertical_fov_rad - 60.0_f64.to_radians()).abs() < 1e-15);
        assert!(camera.near_m > 0.0 && camera.near_m < 0.1);
    }
    assert_eq!(cameras[4].name, "frame 5");
}

#[test]
fn one_frame_is_the_first_key_and_many_end_at_the_last() {
    let cameras = parse(&walk(1)).expect("it is a path").cameras(DVec3::ZERO);
    assert_eq!(cameras.len(), 1);
    assert_eq!(cameras[0].position, DVec3::ZERO);
    for frames in [2, 3, 7, 120, 10_000] {
        let cameras = parse(&walk(frames)).expect("it is a path").cameras(DVec3::ZERO);
        assert_eq!(cameras.len(), frames);
        assert_eq!(cameras[frames - 1].position, DVec3::new(2.0, 1.0, 0.0));
    }
}

#[test]
fn a_path_is_in_the_coordinates_of_the_scenes_file() {
    let origin = DVec3::new(1000.0, 0.0, 2.0);
    let moved = parse(&walk(3)).expect("it is a path").cameras(origin);
    assert_eq!(moved[1].position, DVec3::new(2.0, 0.0, 0.0) - origin);
}

#[test]
fn the_walks_through_gallery_and_showroom_are_paths() {
    for (name, frames) in [("gallery", 240), ("showroom", 120)] {
        let file = format!("{}/assets/paths/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let path = CameraPath::read(std::path::Path::new(&file)).expect("it is a path");
        let cameras = path.cameras(DVec3::ZERO);
        assert_eq!(cameras.len(), frames, "{name}");
        // Gentle: less than 10 cm and 5 degrees a frame, and never through the floor.
        for pair in cameras.windows(2) {
            assert!(pair[0].position.distance(pair[1].position) < 0.1, "{name}");
            assert!(
                pair[0].forward.dot(pair[1].forward) > 5.0_f64.to_radians().cos(),
                "{name}"
            );
            assert!(pair[0].position.y > 0.4, "{name}");
        }
    }
}

/// Something changed in a good path, and a part of the sentence that refuses it.
#[test]
fn everything_else_is_refused_in_one_sentence() {
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut document = walk(5);
        change(&mut document);
        let sentence = parse(&document).expect_err("it is no path");
        assert!(
            sentence.starts_with("walk.json: is no camera path ("),
            "{sentence}"
        );
        assert!(!sentence.contains('\n'), "{sentence}");
        sentence
    };
    let set = |name: &'static str, value: Value| changed(&move |document| document[name] = value.clone());
    assert!(set("frames", 0.into()).contains("0 frames"));
    assert!(set("frames", 10_001.into()).contains("10001 frames"));
    assert!(set("frames", (-1).into()).contains("-1"));
    assert!(set("frames", 1.5.into()).contains("1.5"));
    assert!(set("frames", "5".into()).contains("string"));
    assert!(set("vertical_fov_deg", 0.into()).contains("vertical_fov_deg is 0"));
    assert!(set("vertical_fov_deg", 180.into()).contains("170 degrees"));
    assert!(set("vertical_fov_deg", Value::Null).contains("null"));
    assert!(set("speed", 1.into()).contains("unknown field `speed`"));
    assert!(set("keys", json!([])).contains("number of keys: 0"));
    assert!(set("keys", json!([key([0.0; 3], [1.0; 3])])).contains("number of keys: 1"));
    assert!(set("keys", json!([1, 2])).contains("invalid type"));
    let key_is = |value: Value| changed(&move |document| document["keys"][1] = value.clone());
    assert!(key_is(key([1.0; 3], [1.0; 3])).contains("frame 3 the eye is at its target"));
    assert!(key_is(key([1e10, 0.0, 0.0], [1.0; 3])).contains("key 2 lies beyond"));
    assert!(key_is(json!({"position_m": [1, 2], "target_m": [0, 0, 0]})).contains("length 2"));
    assert!(
        key_is(json!({"position_m": [1, 2, 3, 4], "target_m": [0, 0, 0]})).contains("trailing characters")
    );
    assert!(key_is(json!({"position_m": [1, 2, 3]})).contains("target_m"));
    assert!(key_is(json!({"position_m": [1, 2, 3], "target_m": [0, 0, 0], "up": 1})).contains("`up`"));

    // Between keys, the eye goes through its target.
    let through = json!({"frames": 3, "vertical_fov_deg": 60, "keys": [
        key([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        key([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
    ]});
    let sentence = parse(&through).expect_err("it is no path");
    assert!(
        sentence.contains("frame 2 the eye is at its target"),
        "{sentence}"
    );
}

#[test]
fn what_is_no_number_is_no_coordinate() {
    for number in ["NaN", "Infinity", "1e999", "-1e999", "null", "\"1\""] {
        let text = walk(5).to_string().replacen("2.0", number, 1);
        let error = CameraPath::parse(text.as_bytes(), "walk.json").expect_err("it is no path");
        assert!(
            error.to_string().contains("is no camera path"),
            "{number}: {error}"
        );
    }
    for text in ["", "{}", "[]", "\u{feff}{}", "{\"frames\": 5", "\0"] {
        assert!(
            CameraPath::parse(text.as_bytes(), "walk.json").is_err(),
            "{text:?}"
        );
    }
    assert!(CameraPath::parse(&[0xff, 0xfe, 0x7b], "walk.json").is_err());
}
