//! Saves an edited scene as a `.glb`: the original file with only the edited parts changed. Unknown content survives,
//! in its order.

use std::mem::discriminant;
use std::path::Path;

use glam::DVec3;

use self::lights::Edited;
use self::placing::NodePlacement;
use super::context::LoadContext;
use super::document::Document;
use super::glb::{self, Glb};
use super::light::{self, Origin};
use super::nodes::PlacedNode;
use super::{File, substance, write};
use crate::error::{Error, Result, Warning};
use crate::files;
use crate::scene::{Light, LightKind, LoadOptions, Motion, Scene};

mod lights;
mod placing;

/// Tolerance for a scene that is read back, relative to its extent for positions and to the value for other numbers:
/// files store lights and materials as 32-bit numbers [1].
const SAME: f64 = 1e-6;

/// Writes `edited`, which was derived from `loaded`, read from `original`, as a `.glb`.
///
/// # Errors
/// A file that changed since it was loaded; an edit that no file can hold; a target that cannot be written.
pub fn save(
    original: &Path,
    target: &Path,
    loaded: &Scene,
    edited: &Scene,
    options: &LoadOptions,
) -> Result<()> {
    // Lights are read again only to learn where the file states each.
    let mut file = File::read(original, options.memory_limit_bytes)?;
    let mut load = LoadContext::default();
    let lights = light::all(&file.document, &file.placed, &file.folder, &mut load)?;
    let origins: Vec<Origin> = lights.into_iter().map(|(_, origin)| origin).collect();

    // Edits are patches of the document, so that content unknown to the program stays as it is.
    let before = file.glb.json.clone();
    let mut patch = Patch {
        loaded,
        edited,
        document: &file.document,
        placing: NodePlacement::new(&file.placed),
        glb: &mut file.glb,
    };
    patch.check_original(&file.placed, &origins, original)?;
    patch.lights(&origins)?;
    patch.materials()?;
    patch.objects()?;
    patch.placing.write(&file.document, patch.glb);

    // An unchanged .glb is copied byte for byte. Nothing is written that does not read back as the edited scene.
    let bytes = match file.is_binary && file.glb.json == before {
        true => file.bytes,
        false => file.glb.into_bytes()?,
    };
    check(&bytes, original, edited, options)?;
    files::write_atomically(target, |writer| writer.write_all(&bytes))
}

/// A file in the course of being written.
struct Patch<'a> {
    loaded: &'a Scene,
    edited: &'a Scene,
    document: &'a Document,
    placing: NodePlacement<'a>,
    glb: &'a mut Glb,
}

impl Patch<'_> {
    /// Refuses a file that another program has changed since it was loaded.
    fn check_original(&self, placed: &[PlacedNode], origins: &[Origin], path: &Path) -> Result<()> {
        let has_nodes = self.loaded.objects.iter().all(|object| {
            let mut placed = placed.iter();
            placed.any(|placed| placed.node == object.node && placed.name == object.name)
        });
        let has_materials = self.loaded.materials.len() >= self.document.root.materials.len();
        if has_nodes && has_materials && self.loaded.lights.len() >= origins.len() {
            return Ok(());
        }
        Err(Error::failure(
            path.display().to_string(),
            "has changed since the scene was loaded",
            "open it again and repeat the edits",
        ))
    }

    fn lights(&mut self, origins: &[Origin]) -> Result<()> {
        // The file states its lights at nodes; the light of a glowing object is the strength of its material.
        let materials = self.document.root.materials.len();
        let shift = self.edited.origin_world;
        for (index, is) in self.edited.lights.iter().enumerate() {
            let place = self.edited.original_light_index(index);
            let (was, origin) = match place {
                Some(place) => (Some(&self.loaded.lights[place]), origins.get(place)),
                None => (None, None),
            };

            // Lights that were added, and the default sun where it must stay, get nodes of their own.
            let is_foreign = origin.is_none() && write::lights::stated(is).is_some();
            match (was, origin) {
                _ if is_foreign && is_to_be_written(index, self.loaded, self.edited) => {
                    lights::check_spectrum(is)?;
                    write::lights::add(is, shift, self.glb);
                }
                (Some(was), _) if was == is => {}
                (Some(was), Some(origin)) => {
                    Edited { was, is }.write(origin, shift, &mut self.placing, self.glb)?;
                }
                (was, _) => {
                    let was = was.unwrap_or(is);
                    Edited { was, is }.write_glow(self.edited, materials, self.glb)?;
                }
            }
        }

        // A removed light is taken from its node; its entry may serve others and stays.
        for place in &self.edited.light_list.removed {
            if let Some(origin) = origins.get(*place) {
                let node = format!("/nodes/{}/extensions/{}", origin.node, origin.list);
                self.glb.remove(&node);
            }
        }
        Ok(())
    }

    fn materials(&mut self) -> Result<()> {
        // Both states are written as glTF, so that only what differs between them is changed in the file.
        let shift = self.edited.origin_world;
        let pairs = self.loaded.materials.iter().zip(&self.edited.materials);
        for (index, (was, is)) in pairs.take(self.document.root.materials.len()).enumerate() {
            let mut unstated = Vec::new();
            let mut before = write::materials::written(was, shift, &mut Vec::new());
            let after = write::materials::written(is, shift, &mut unstated);
            let material = format!("/materials/{index}");

            // A glass that no file can state must not be saved as another one.
            if was.glass != is.glass {
                if let Some(Warning {
                    location,
                    what,
                    remedy,
                }) = unstated.pop()
                {
                    return Err(Error::failure(location, what, remedy));
                }
                // A file may state both, of which only one is read.
                let name = format!("/extras/{}", substance::GLASS_KEY);
                let dispersion = format!("/extensions/{}/dispersion", substance::NAME);
                for stated in [&name, &dispersion] {
                    glb::remove(&mut before, stated);
                }
                self.glb.remove(&format!("{material}{name}"));
                if let Some(stated) = self.glb.json.pointer_mut(&format!("{material}{dispersion}")) {
                    *stated = 0.0.into();
                }
            }
            self.glb.patch(&material, &before, &after);
        }
        Ok(())
    }

    fn objects(&mut self) -> Result<()> {
        for (index, object) in self.edited.objects.iter().enumerate() {
            let motion = object.motion();
            if *motion != Motion::default()
                && let Some(stands) = self.placing.of(object.node)
            {
                let pivot = self.edited.pivot(index) + self.edited.origin_world;
                self.placing
                    .put(object.node, motion.about(pivot) * stands, &object.name)?;
            }
        }
        Ok(())
    }
}

/// Whether a light that is not in the file is written to it: it was added or edited, or there are added lights, with
/// which the file would no longer be given a default sun.
fn is_to_be_written(light: usize, loaded: &Scene, edited: &Scene) -> bool {
    let was = edited
        .original_light_index(light)
        .map(|place| &loaded.lights[place]);
    was != Some(&edited.lights[light]) || !edited.light_list.added.is_empty()
}

/// Reads the new file as any other, and refuses it if the result is not the edited scene.
fn check(bytes: &[u8], original: &Path, edited: &Scene, options: &LoadOptions) -> Result<()> {
    // What counts is the scene that the new file gives, not what was meant to be written.
    let read = super::read_scene(bytes, original, options)?;
    let differs = |what: String| {
        Error::failure(
            what,
            "cannot be saved: the file has something that prevents it",
            "undo its last edit and save again",
        )
    };

    // Both scenes may have moved to different origins, and a file rounds positions.
    let extent_m = edited.bounds().map_or(1.0, |(low, high)| (high - low).length());
    let shift = read.origin_world - edited.origin_world;
    let is_at = |a: DVec3, b: DVec3| (a + shift).distance(b) <= SAME * extent_m;
    for (read, is) in read.objects.iter().zip(&edited.objects) {
        let mut corners = read.in_scene().positions().zip(is.in_scene().positions());
        if !corners.all(|(read, is)| is_at(read, is)) {
            return Err(differs(format!("object `{}`", is.name)));
        }
    }

    // Of a material, what an edit can change is compared, and the class that follows from it.
    for (read, is) in read.materials.iter().zip(&edited.materials) {
        let colours = read
            .base_colour
            .to_array()
            .into_iter()
            .zip(is.base_colour.to_array());
        let numbers = [(read.ior, is.ior), (read.roughness, is.roughness)];
        let is_same = colours.chain(numbers).all(|(read, is)| is_near(read, is))
            && read.surface == is.surface
            && read.metal == is.metal
            && read.waves.is_some() == is.waves.is_some();
        if !is_same {
            return Err(differs(format!("material `{}`", is.name)));
        }
    }
    check_lights(&read, edited, &is_at).map_err(differs)
}

/// Whether two numbers are equal within 32-bit rounding.
fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs()).max(1e-9)
}

/// Checks that the file has exactly the expected lights, in any order; else returns one that is wrong.
fn check_lights(
    read: &Scene,
    edited: &Scene,
    is_at: &impl Fn(DVec3, DVec3) -> bool,
) -> std::result::Result<(), String> {
    let mut left: Vec<&Light> = read.lights.iter().collect();
    let is_same = |read: &Light, is: &Light| {
        let colours = read.colour.to_array().into_iter().zip(is.colour.to_array());
        let strengths = [(read.kind.strength(), is.kind.strength())];
        let places = read.kind.position().into_iter().zip(is.kind.position());
        discriminant(&read.kind) == discriminant(&is.kind)
            && colours.chain(strengths).all(|(read, is)| is_near(read, is))
            && places.into_iter().all(|(read, is)| is_at(read, is))
    };
    for is in &edited.lights {
        if let Some(found) = left.iter().position(|read| is_same(read, is)) {
            left.remove(found);
        } else if !is_of_program(is, read) {
            return Err(format!("light `{}`", is.name));
        }
    }
    match left.first() {
        Some(light) => Err(format!("light `{}`", light.name)),
        None => Ok(()),
    }
}

/// Whether a light belongs to the program and not to the file: the environment, or the default sun of a scene without
/// light.
fn is_of_program(light: &Light, read: &Scene) -> bool {
    let is_sun_of_dark = matches!(light.kind, LightKind::Sun { .. }) && read.lights.is_empty();
    is_sun_of_dark || matches!(light.kind, LightKind::Environment { .. })
}
