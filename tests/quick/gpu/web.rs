//! What a browser gets of a scene: draws within their buffers, modules that hold, and the light of the maps layer by
//! layer. Pictures are compared by `tests/run --interop`.

use std::collections::HashMap;
use std::io::Read as _;

use nephroid::export::chains::encode;
use nephroid::illumination::{IlluminationMap, Layer};

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

/// The description, and the bytes that it names.
struct Unpacked {
    description: Value,
    contents: Vec<u8>,
}

impl Unpacked {
    fn of(packed: &[u8]) -> Self {
        let mut file = Vec::new();
        let read = flate2::read::GzDecoder::new(packed).read_to_end(&mut file);
        read.expect("gzip");
        let (length, rest) = file.split_at(4);
        let length = u32::from_le_bytes(length.try_into().expect("four bytes")) as usize;
        Self {
            description: serde_json::from_slice(&rest[..length]).expect("JSON"),
            contents: rest[length..].to_vec(),
        }
    }

    /// Bytes at a place; those of records lie by their place in a record, and their words are differences.
    fn part(&self, place: &Value) -> Vec<u8> {
        let [first, length] = [0, 1].map(|which| place[which].as_u64().expect("a number") as usize);
        let stored = &self.contents[first..first + length];
        let Some(record) = place[2].as_u64().map(|record| record as usize) else {
            return stored.to_vec();
        };
        let byte = |at: usize| stored[at % record * (length / record) + at / record];
        let mut words: Vec<u32> = Vec::new();
        for word in 0..length / 4 {
            let change = u32::from_le_bytes([0, 1, 2, 3].map(|part| byte(4 * word + part)));
            let before = word.checked_sub(record / 4).map_or(0, |before| words[before]);
            words.push(change.wrapping_add(before));
        }
        bytemuck::cast_slice(&words).to_vec()
    }

    fn buffer(&self, name: &str) -> Vec<u8> {
        self.part(&self.description["contents"][name])
    }
}

fn packed(has_ball: bool) -> Option<Unpacked> {
    let (scene, maps) = scene(has_ball);
    encode(&scene, &maps)
        .expect("it is small")
        .map(|bytes| Unpacked::of(&bytes))
}

#[test]
fn draws_lie_within_their_buffers() {
    let packed = packed(true).expect("glass");
    let about = &packed.description;
    let number = |value: &Value| value.as_u64().expect("a number") as usize;
    let record = about["vertices"][2]["arrayStride"].as_u64().expect("a stride") as usize;
    let (indices, objects) = (
        packed.buffer("indices").len() / 4,
        packed.buffer("objects").len() / record,
    );
    let mut drawn = HashMap::new();
    for (list, draws) in about["draws"].as_object().expect("lists") {
        for draw in draws.as_array().expect("draws") {
            let [pipeline, index_count, object_count, first_index, first_object] =
                std::array::from_fn(|which: usize| number(&draw[which]));
            let surface = &about["surfaces"][pipeline];
            assert!(about["programs"][surface["program"].as_str().expect("a name")].is_string());
            assert!(first_index + index_count <= indices && first_object + object_count <= objects);
            *drawn.entry(list.as_str()).or_insert(0) += object_count;
        }
    }
    // The floor and the ball: both hide, the ball is traced and composed, the floor shows itself.
    assert_eq!(
        drawn,
        HashMap::from([("depths", 2), ("traced", 1), ("composed", 1), ("own", 1)])
    );
    let corners = packed.buffer("corners").len() / number(&about["vertices"][0]["arrayStride"]);
    let words = packed.buffer("indices");
    let largest = words
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().expect("four bytes")))
        .max();
    assert_eq!(largest.expect("triangles") as usize + 1, corners);
}

/// The host fills tiles of each level, which lie beside each other in the pool, from textures of any size.
#[test]
fn tiles_hold_the_whole_map() {
    let packed = packed(true).expect("glass");
    let about = &packed.description;
    let size = &about["textures"]["map_tiles"]["size"];
    let [across, down] = [0, 1].map(|axis| size[axis].as_u64().expect("a size") as usize);
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&packed.part(&about["maps"][0]));
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
fn a_scene_without_mirrors_and_glass_has_none() {
    assert!(packed(false).is_none());
}
