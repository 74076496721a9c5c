//! A number for all that a bake can see of a scene, wherever its files lie.

use std::fmt::{self, Write as _};

use super::Scene;
use crate::files::cache::ContentHash;

/// Takes text, eight bytes a word.
#[derive(Default)]
struct Text {
    hash: ContentHash,
    word: [u8; 8],
    filled: usize,
}

impl fmt::Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for &byte in text.as_bytes() {
            self.word[self.filled] = byte;
            self.filled += 1;
            if self.filled == self.word.len() {
                self.hash.take(u64::from_le_bytes(self.word));
                self.filled = 0;
            }
        }
        Ok(())
    }
}

impl Scene {
    /// The same for scenes that are the same in everything that light meets, to the last bit: their numbers are written
    /// out in full, so that no field of a material or a light can be forgotten. Names of files, cameras and warnings do
    /// not count.
    pub fn content_hash(&self) -> u64 {
        let Self {
            name: _,
            source: _,
            origin_world,
            objects,
            materials,
            textures,
            lights,
            light_list: _,
            environment,
            cameras: _,
            warnings: _,
        } = self;
        let mut text = Text::default();
        // Text takes whatever it is given.
        let _ = write!(
            text,
            "{origin_world:?}\n{objects:?}\n{materials:?}\n{textures:?}\n{lights:?}\n{environment:?}"
        );
        let rest = &text.word[..text.filled];
        rest.iter().for_each(|&byte| text.hash.take(u64::from(byte)));
        text.hash.value()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crate::scene::{LoadOptions, Scene, load};

    #[test]
    fn whatever_light_meets_counts() {
        let scene = load("builtin:showroom", &LoadOptions::default()).expect("it is built in");
        let same = Scene {
            name: "other".into(),
            source: "elsewhere".into(),
            ..scene.clone()
        };
        assert_eq!(scene.content_hash(), same.content_hash());
        type Change = fn(&mut Scene);
        let changes: [Change; 5] = [
            |scene| {
                let x = &mut Arc::make_mut(&mut scene.objects[0].mesh).positions[0].x;
                *x = x.next_up();
            },
            |scene| scene.materials[0].ior += 1e-9,
            |scene| scene.lights[0].colour.g = scene.lights[0].colour.g.next_down(),
            |scene| scene.objects.truncate(1),
            |scene| scene.origin_world.z += 1.0,
        ];
        for change in changes {
            let mut other = scene.clone();
            change(&mut other);
            assert_ne!(scene.content_hash(), other.content_hash());
        }
    }
}
