//! Ways for a camera, from files.

use nephroid::scene::CameraPath;

use crate::prelude::*;

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
fn frames_are_spread_evenly_between_keys() {
    let cameras = parse(&walk(5)).expect("it is a path").cameras(DVec3::ZERO);
    let positions: Vec<DVec3> = cameras.iter().map(|camera| camera.position).collect();
    let expected = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 0.5), (2.0, 1.0)];
    assert_eq!(positions, expected.map(|(x, y)| dvec3(x, y, 0.0)));
    for camera in &cameras {
        let towards = (dvec3(0.0, 0.0, -5.0) - camera.position).normalize();
        assert!(camera.forward.dot(towards) > 1.0 - 1e-12, "{camera:?}");
        assert!(camera.up.dot(DVec3::Y) > 0.9, "{camera:?}");
        assert!((camera.vertical_fov_rad - 60.0_f64.to_radians()).abs() < 1e-15);
        assert!(camera.near_m > 0.0 && camera.near_m < 0.1);
    }
    assert_eq!(cameras[4].name, "frame 5");
}

#[test]
fn paths_begin_and_end_at_keys_of_the_file() {
    let at = |frames: usize, origin: DVec3| parse(&walk(frames)).expect("it is a path").cameras(origin);
    for frames in [1, 2, 3, 7, 120, 10_000] {
        let cameras = at(frames, DVec3::ZERO);
        assert_eq!((cameras.len(), cameras[0].position), (frames, DVec3::ZERO));
        let last = if frames == 1 {
            DVec3::ZERO
        } else {
            dvec3(2.0, 1.0, 0.0)
        };
        assert_eq!(cameras[frames - 1].position, last);
    }
    // In the coordinates of the scene's file.
    let origin = dvec3(1000.0, 0.0, 2.0);
    assert_eq!(at(3, origin)[1].position, dvec3(2.0, 0.0, 0.0) - origin);
}

#[test]
fn shipped_walks_are_gentle_paths() {
    for (name, frames) in [("gallery", 240), ("showroom", 120)] {
        let file = format!("{}/assets/paths/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let path = CameraPath::read(std::path::Path::new(&file)).expect("it is a path");
        let cameras = path.cameras(DVec3::ZERO);
        assert_eq!(cameras.len(), frames, "{name}");
        // Gentle: less than 10 cm and 5 degrees a frame, and never through the floor.
        for pair in cameras.windows(2) {
            assert!(pair[0].position.distance(pair[1].position) < 0.1, "{name}");
            let turn_rad = pair[0].forward.angle_between(pair[1].forward);
            assert!(turn_rad < 5.0_f64.to_radians(), "{name}");
            assert!(pair[0].position.y > 0.4, "{name}");
        }
    }
}

/// A JSON pointer into a good path, the value that takes its place, and a part of the sentence that refuses it.
#[test]
fn everything_else_is_refused_in_one_sentence() {
    for (change, parts) in rows(
        r#"
        /frames 0 => 0 frames
        /frames 10001 => 10001 frames
        /frames -1 => -1
        /frames 1.5 => 1.5
        /frames "5" => string
        /vertical_fov_deg 0 => vertical_fov_deg is 0
        /vertical_fov_deg 180 => 170 degrees
        /vertical_fov_deg null => null
        /speed 1 => unknown field `speed`
        /keys [] => number of keys: 0
        /keys [{"position_m":[0,0,0],"target_m":[1,1,1]}] => number of keys: 1
        /keys [1,2] => invalid type
        /keys/1 {"position_m":[1,1,1],"target_m":[1,1,1]} => frame 3 the eye is at its target
        /keys/1 {"position_m":[1e10,0,0],"target_m":[1,1,1]} => key 2 lies beyond
        /keys/1 {"position_m":[1,2],"target_m":[0,0,0]} => length 2
        /keys/1 {"position_m":[1,2,3,4],"target_m":[0,0,0]} => trailing characters
        /keys/1 {"position_m":[1,2,3]} => target_m
        /keys/1 {"position_m":[1,2,3],"target_m":[0,0,0],"up":1} => `up`
        "#,
    ) {
        let mut document = walk(5);
        let (place, value) = change.split_once(' ').expect("a place and a value");
        match place {
            "/keys/1" => document["keys"][1] = parsed(value),
            field => document[&field[1..]] = parsed(value),
        }
        let sentence = parse(&document).expect_err(change);
        assert!(
            sentence.starts_with("walk.json: is no camera path ("),
            "{sentence}"
        );
        says(sentence, parts);
    }
    // Between keys, the eye goes through its target.
    let through = json!({"frames": 3, "vertical_fov_deg": 60, "keys": [
        key([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        key([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
    ]});
    says(
        parse(&through).expect_err("it is no path"),
        "frame 2 the eye is at its target",
    );
}
