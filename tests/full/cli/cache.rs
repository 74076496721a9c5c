//! What is kept in the user's cache folder: coordinates that took a library to make.

use glam::DVec3;
use nephroid::scene::builtin::shapes;
use serde_json::json;

use support::glb::Glb;
use support::program::Sandbox;

/// A matte ball of 5,120 triangles without coordinates, and a lamp.
fn ball() -> Vec<u8> {
    let mesh = shapes::sphere(DVec3::new(2.0, 0.0, 0.0), 0.5, 4);
    let numbers =
        |vectors: &[DVec3]| -> Vec<f32> { vectors.iter().flat_map(|v| v.as_vec3().to_array()).collect() };
    let mut file = Glb::empty();
    let positions = file.push_floats(&numbers(&mesh.positions), 3);
    let normals = file.push_floats(&numbers(&mesh.normals), 3);
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let indices = file.push_indices(&indices);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    let mesh = file.push_mesh(json!({ "attributes": attributes, "indices": indices }));
    file.push_root(json!({ "name": "ball", "mesh": mesh }));
    file.with_light("lamp", json!({ "type": "point", "intensity": 1000.0 }))
        .bytes()
}

const BAKE: &str = "bake ball.glb -o out --layers direct --map-resolution 64 --force";

#[test]
fn coordinates_are_kept_and_never_trusted() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.glb", ball());
    let maps = |options: &str| {
        sandbox.succeed(&format!("{BAKE}{options}"));
        ["0000_ball.exr", "0000_ball.uv"].map(|file| {
            std::fs::read(sandbox.path("out/maps").join(file)).expect("a map with its coordinates")
        })
    };
    let fresh = maps(" --no-cache");
    assert!(sandbox.files(sandbox.cache()).is_empty());
    assert!(maps("") == fresh);
    let kept = sandbox.files(sandbox.cache());
    assert!(!kept.is_empty());
    assert!(maps("") == fresh, "what was kept is what was made");
    for file in &kept {
        let path = sandbox.cache().join(file);
        let bytes = std::fs::read(&path).expect("kept");
        std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("writable");
    }
    assert!(maps("") == fresh, "half a file is none");
    assert_eq!(sandbox.files(sandbox.cache()), kept);
}
