//! The scene: surfaces, materials, lights, cameras. All coordinates are scene coordinates in metres, y up: world
//! coordinates less [`Scene::origin_world`], which is zero unless the scene lies far from the world's origin.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::sync::Arc;

use glam::DVec3;

use crate::error::Warning;
use crate::files::cache::ContentHash;
use crate::geometry::enclosure::Bounds;
use crate::optics::LinearSrgb;

pub mod adjacency;
mod animation;
pub mod builtin;
pub mod camera;
pub mod camera_path;
pub mod changes;
pub mod contacts;
mod dark;
pub mod edit;
pub mod emitter;
pub mod environment;
mod glow;
mod glow_sampler;
mod gltf;
pub mod instances;
pub mod light;
pub mod load;
pub mod material;
pub mod mesh;
pub mod normal_map;
pub mod object;
pub mod texture;
pub mod turntable;
pub mod watertight;
pub mod waves;

pub use adjacency::Adjacency;
pub use animation::{Animated, Clip, ClipNode, Interpolation, Track};
pub use camera::Camera;
pub use camera_path::{CameraPath, PathPlan};
pub use edit::{Edit, EditState, LightEdit, MaterialEdit, why_light_stays};
pub use environment::{Environment, SmoothIrradiance};
pub use glow::{Glow, GlowPart};
pub use gltf::guard::is_guarded;
pub use gltf::{Glb, Opened};
pub use light::{Light, LightKind, LightList, LightSize, PanelShape};
pub use load::{LoadOptions, open_document};
pub use material::AlphaMask;
pub use material::{Material, Mixture, SurfaceKind, Variation, Volume};
pub use mesh::{InScene, Mesh};
pub use normal_map::NormalMap;
pub use object::{Motion, Object};
pub use texture::{Texture, TextureRef};
pub use waves::{Wave, Waves};

/// A whole scene, sanitised: every number in it is finite and every index valid.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Short name for titles and files: the stem of the file's name, or the name of the built-in.
    pub name: String,
    /// Source as the user named it: a path or `builtin:NAME`.
    pub source: String,
    /// World position of the scene's origin [m].
    pub origin_world: DVec3,
    /// Surfaces, in file order.
    pub objects: Vec<Object>,
    /// Materials; never empty if there are objects.
    pub materials: Vec<Material>,
    /// Images that materials refer to; shared between a scene and its edited copies.
    pub textures: Vec<Arc<Texture>>,
    /// Per-triangle emission of objects with an emission texture, by object index.
    pub glows: BTreeMap<usize, Arc<Glow>>,
    /// Meshes at rest of objects whose vertices are displaced by waves, by object index.
    pub swells: BTreeMap<usize, Arc<Mesh>>,
    /// Animation of objects, lights and cameras.
    pub clip: Option<Arc<Clip>>,
    /// Lights of non-zero power.
    pub lights: Vec<Light>,
    /// Additions and removals of lights since loading.
    pub light_list: LightList,
    /// Radiance from infinity; `None` is black.
    pub environment: Option<Arc<Environment>>,
    /// Cameras, in file order.
    pub cameras: Vec<Camera>,
    /// Repairs made and content ignored on loading.
    pub warnings: Vec<Warning>,
}

impl Scene {
    /// Material of an object.
    pub fn material_of(&self, object: usize) -> &Material {
        &self.materials[self.objects[object].material]
    }

    /// The scene of the eye pass: each material has the class that the eye sees.
    #[must_use]
    pub fn as_seen(&self) -> Self {
        let mut seen = self.clone();
        for material in &mut seen.materials {
            material.surface = material.seen_surface();
            material.coat_roughness_limit = material::GLOSSY_ROUGHNESS_LIMIT;
        }
        seen
    }

    /// The object that stands for the body of glass that an object bounds: itself, unless several objects bound it.
    pub fn body_of(&self, object: usize) -> usize {
        self.objects[object].body.unwrap_or(object)
    }

    /// Index of a light in the scene as loaded; `None` if it was added since.
    pub fn original_light_index(&self, light: usize) -> Option<usize> {
        let list = &self.light_list;
        let loaded = 0..self.lights.len() - list.added.len() + list.removed.len();
        loaded.filter(|place| !list.removed.contains(place)).nth(light)
    }

    /// A light as it was in `loaded` or, if it was added since, as it was added.
    pub fn original_light<'a>(&'a self, light: usize, loaded: &'a Self) -> &'a Light {
        match self.original_light_index(light) {
            Some(place) => &loaded.lights[place],
            None => &self.light_list.added[light + self.light_list.added.len() - self.lights.len()],
        }
    }

    /// Whether any object is dispersive.
    pub fn parts_wavelengths(&self) -> bool {
        (0..self.objects.len()).any(|object| self.material_of(object).is_dispersive())
    }

    /// Mean radiance emitted by an object's surface [W/(m² sr)]: that of its light, as edited, if it has one.
    pub fn emitted_radiance(&self, object: usize) -> LinearSrgb {
        let is_of_it =
            |light: &&Light| matches!(light.kind, LightKind::Surface { object: of, .. } if of == object);
        match self.lights.iter().find(is_of_it) {
            Some(light) => light.strength(),
            None => {
                let material = self.material_of(object);
                let mean = match (self.glows.get(&object), &material.emission_texture) {
                    (Some(glow), _) => glow.mean,
                    (None, Some(_)) => LinearSrgb::BLACK,
                    (None, None) => LinearSrgb::WHITE,
                };
                material.emitted_radiance * mean
            }
        }
    }

    /// The environment and the factor on its radiance, which is that of the environment's light as edited; `None`
    /// without one.
    pub fn sky(&self) -> Option<(&Arc<Environment>, LinearSrgb)> {
        let environment = self.environment.as_ref()?;
        let mut lights = self.lights.iter();
        let light = lights.find(|light| matches!(light.kind, LightKind::Environment { .. }));
        Some((environment, light.map_or(LinearSrgb::WHITE, Light::strength)))
    }

    /// Bounding box of all surfaces, as minimum and maximum corner [m]; `None` without surfaces.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.objects
            .iter()
            .filter_map(|object| object.bounds())
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Bounding box without objects that surround all others at a distance, such as a sky dome around a house [m];
    /// `None` without vertices.
    pub fn inner_bounds(&self) -> Option<Bounds> {
        self.core(|next, all| (next.1 - next.0).min_element() > DWARFING * diagonal_m(all))
    }

    /// Diagonal of the bounding box without objects that are longer than all others together, such as the ground around
    /// a house [m]; `None` without vertices.
    pub fn core_diagonal_m(&self) -> Option<f64> {
        let core = self.core(|next, all| diagonal_m(next) > DWARFING * diagonal_m(all));
        core.map(|core| diagonal_m(&core))
    }

    /// The box of the smaller objects, up to the last one that does not dwarf the box of all before it.
    fn core(&self, is_dwarfing: impl Fn(&Bounds, &Bounds) -> bool) -> Option<Bounds> {
        let mut boxes: Vec<Bounds> = self.objects.iter().filter_map(|object| object.bounds()).collect();
        boxes.sort_by(|a, b| diagonal_m(a).total_cmp(&diagonal_m(b)));
        let mut boxes = boxes.into_iter();
        let mut all = boxes.next()?;
        let mut core = all;
        for next in boxes {
            let is_core = !is_dwarfing(&next, &all);
            all = (all.0.min(next.0), all.1.max(next.1));
            if is_core {
                core = all;
            }
        }
        Some(core)
    }

    /// Number of triangles of all objects.
    pub fn triangle_count(&self) -> usize {
        self.objects
            .iter()
            .map(|object| object.mesh().triangles.len())
            .sum()
    }
}

fn diagonal_m((low, high): &Bounds) -> f64 {
    low.distance(*high)
}

/// An object so many times longer than the box of all smaller ones dwarfs them: walls are up to three times as long as
/// the furniture between them.
const DWARFING: f64 = 4.0;

/// Hashes text in words of eight bytes.
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
    /// Equal for scenes that are equal, to the last bit, in everything that affects light. Hashes the debug output, so
    /// that no field of a material or a light can be forgotten. Names of files, cameras and warnings do not count.
    pub fn content_hash(&self) -> u64 {
        let Self {
            name: _,
            source: _,
            origin_world,
            objects,
            materials,
            textures,
            // Follow from materials, images and meshes.
            glows: _,
            // Follow from meshes and waves.
            swells: _,
            clip: _,
            lights,
            light_list: _,
            environment,
            cameras: _,
            warnings: _,
        } = self;
        let mut text = Text::default();
        // Writing to `Text` never fails.
        for object in objects {
            let Object {
                name,
                node,
                primitive,
                material,
                body,
                ..
            } = object;
            let mesh = object.copy_in_scene();
            let _ = writeln!(text, "{name:?} {node} {primitive} {material} {body:?} {mesh:?}");
        }
        let _ = write!(
            text,
            "{origin_world:?}\n{materials:?}\n{textures:?}\n{lights:?}\n{environment:?}"
        );

        // What does not fill a word is hashed byte by byte.
        let rest = &text.word[..text.filled];
        rest.iter().for_each(|&byte| text.hash.take(u64::from(byte)));
        text.hash.value()
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::{LoadOptions, Scene};

    #[test]
    fn whatever_light_meets_counts() {
        let scene = Scene::load("builtin:showroom", &LoadOptions::default()).expect("it is built in");
        let same = Scene {
            name: "other".into(),
            source: "elsewhere".into(),
            ..scene.clone()
        };
        assert_eq!(scene.content_hash(), same.content_hash());
        type Change = fn(&mut Scene);
        let changes: [Change; 5] = [
            |scene| {
                let x = &mut scene.objects[0].mesh_in_scene_mut().positions[0].x;
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
