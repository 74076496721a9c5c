//! What a browser gets of a scene: draws within their buffers, modules that hold, and tiles for the light of the maps.
//! Pictures are compared by `tests/run --interop`.

use std::collections::BTreeMap;

use nephroid::eye_pass::renderer::WebScene;
use nephroid::illumination::Layer;

use crate::prelude::*;
use support::floors::{diffuse, floor_map, floor_scene};

const SIDE: usize = 4;

fn scene(has_ball: bool) -> (Scene, Vec<IlluminationMap>) {
    let mut scene = floor_scene(diffuse(LinearSrgb::WHITE));
    if has_ball {
        let ball = shapes::sphere(dvec3(0.5, 0.3, 0.5), 0.2, 2);
        parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    }
    let light = |factor: f32| (0..SIDE * SIDE).map(|texel| [factor * texel as f32; 3]).collect();
    let mut map = floor_map(0, SIDE, SIDE, light(0.25));
    map.layers.push(Layer {
        kind: LayerKind::Direct,
        irradiance: light(0.5),
    });
    (scene, vec![map])
}

fn gathered(has_ball: bool) -> WebScene {
    let (scene, maps) = scene(has_ball);
    let made = WebScene::new(&scene, &maps).expect("it is small");
    assert_eq!(made.refusal, None);
    made
}

fn buffer<'a>(made: &'a WebScene, wanted: &str) -> Option<&'a [u8]> {
    made.contents.get(wanted).map(|content| &*content.bytes)
}

/// Objects by list of draws, each of which lies within its buffers and has a pipeline.
fn drawn(made: &WebScene) -> BTreeMap<&str, usize> {
    let about = &made.description;
    let number = |value: &Value| value.as_u64().expect("a number") as usize;
    let record = number(&about["vertices"][2]["arrayStride"]);
    let indices = buffer(made, "indices").expect("triangles").len() / 4;
    let objects = buffer(made, "objects").expect("objects").len() / record;
    let mut drawn = BTreeMap::new();
    for (list, draws) in about["draws"].as_object().expect("lists") {
        drawn.insert(list.as_str(), 0);
        for draw in draws.as_array().expect("draws") {
            let [index_count, object_count, first_index, first_object] =
                std::array::from_fn(|which: usize| number(&draw[1 + which]));
            let pipeline = &about["pipelines"][draw[0].as_str().expect("a name")];
            assert!(about["programs"][pipeline["program"].as_str().expect("a name")].is_string());
            assert!(first_index + index_count <= indices && first_object + object_count <= objects);
            *drawn.entry(list).or_default() += object_count;
        }
    }
    drawn
}

#[test]
fn draws_lie_within_their_buffers() {
    let made = gathered(true);
    // The floor and the ball: both hide, the ball is traced, and both are surfaces. Without chains, and in false colours,
    // clear bodies are left out.
    let wanted = [
        ("depths", 2),
        ("traced", 1),
        ("surfaces", 2),
        ("plain", 1),
        ("colours", 1),
    ];
    assert_eq!(drawn(&made), BTreeMap::from(wanted));
    let corner = made.description["vertices"][0]["arrayStride"]
        .as_u64()
        .expect("a stride");
    let corners = buffer(&made, "corners").expect("corners").len() / corner as usize;
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(buffer(&made, "indices").expect("triangles"));
    assert_eq!(*words.iter().max().expect("triangles") as usize + 1, corners);
    let triangles = buffer(&made, "triangles").expect("what chains are traced through");
    let size = made.description["Triangle"]["size"].as_u64().expect("a size") as usize;
    assert_eq!(triangles.len() / size, words.len() / 3);
}

/// The host makes the boxes of a mesh's nodes from those of their children.
#[test]
fn nodes_of_meshes_are_a_tree_over_all_triangles() {
    let made = gathered(true);
    let first = made.description["local"]["first_mesh_node"]
        .as_u64()
        .expect("a number") as usize;
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(buffer(&made, "nodes").expect("a hierarchy"));
    let nodes: Vec<&[u32]> = words.chunks_exact(8).collect();
    let mut seen = vec![0; nodes.len()];
    let mut triangles = 0;
    for node in &nodes[first..] {
        let (child, count) = (node[3] as usize, node[7] as usize);
        triangles += count;
        if count == 0 {
            seen[child..child + 2].iter_mut().for_each(|seen| *seen += 1);
        }
        assert!([0, 1, 2, 4, 5, 6].iter().all(|word| node[*word] == 0), "no box");
    }
    // One mesh of all that is not instanced, and its root is nobody's child.
    assert_eq!(seen[first..].iter().filter(|seen| **seen != 1).count(), 1);
    let size = made.description["Triangle"]["size"].as_u64().expect("a size") as usize;
    assert_eq!(
        triangles,
        buffer(&made, "triangles").expect("triangles").len() / size
    );
}

/// The host fills tiles of each level, which lie beside each other in the pool, from textures of any size.
#[test]
fn tiles_hold_the_whole_map() {
    let made = gathered(true);
    let size = &made.description["textures"]["map_tiles"]["size"];
    let [across, down] = [0, 1].map(|axis| size[axis].as_u64().expect("a size") as usize);
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(buffer(&made, "tiles0").expect("a map"));
    let tiles: Vec<&[u32]> = words.chunks_exact(8).collect();
    let mut texels = 0;
    let mut corners = Vec::new();
    for tile in &tiles {
        let [column, row] = [0, 1].map(|axis| tile[axis] as usize);
        let [first_x, first_y, width, height] = [4, 5, 6, 7].map(|word| f32::from_bits(tile[word]) as usize);
        let [wide, high] = [width - first_x, height - first_y].map(|left| left.min(64));
        assert!(column + wide < across && row + high < down);
        // E of a stored value of 1: stored values are halves.
        let largest = scene(true).1[0].total().into_iter().flatten().fold(0.0, f32::max);
        assert!(largest / f32::from_bits(tile[3]) <= 32768.0);
        texels += wide * high;
        corners.push([column, row, tile[2] as usize]);
    }
    assert_eq!(texels, SIDE * SIDE, "one level, as it is small");
    corners.dedup();
    assert_eq!(corners.len(), tiles.len());
}

#[test]
fn a_scene_without_mirrors_and_glass_traces_nothing() {
    let made = gathered(false);
    let wanted = [
        ("depths", 0),
        ("traced", 0),
        ("surfaces", 1),
        ("plain", 1),
        ("colours", 1),
    ];
    assert_eq!(drawn(&made), BTreeMap::from(wanted));
    assert!(made.description["local"].is_null() && buffer(&made, "nodes").is_none());
}
