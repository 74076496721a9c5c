//! Cached hits of a light's rays. Rays of nested lattices, and rays that an edit does not touch, are followed again
//! without a search.
//!
//! Only hits are kept. Everything that follows from them (directions, derivatives, flux) is worked out anew, so that a
//! ray followed from here is the ray that a search would give, bit for bit.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::geometry::Ray;
use crate::light_pass::path::PathSignature;
use crate::transport::RayHit;

/// Start of a light ray: face of the launch domain, bits of the position in the unit square, and number of the
/// wavelength of a spectral light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RayKey {
    face: u32,
    node: u32,
    square: [u64; 2],
}

/// Memory of a cached ray with this many segments [bytes].
fn bytes_of(segments: usize) -> u64 {
    (segments * size_of::<CachedHit>() + size_of::<(RayKey, KeptRay)>()) as u64
}

impl RayKey {
    /// For a ray that starts at a point of a face's unit square; `node` is 0 without a wavelength.
    pub fn new(face: usize, node: u32, square: DVec2) -> Self {
        Self {
            face: face as u32,
            node,
            square: square.to_array().map(f64::to_bits),
        }
    }
}

/// Hit of one segment of a path.
#[derive(Clone, Copy, Debug)]
pub struct CachedHit {
    /// Path up to the start of the segment.
    pub signature: PathSignature,
    /// `None` where it hit nothing.
    pub place: Option<RayHit>,
}

/// All hits of one light ray, along all its branches.
#[derive(Clone, Debug)]
pub struct TracedRay {
    pub key: RayKey,
    /// In the order in which its branches were traced.
    pub hits: Box<[CachedHit]>,
}

#[derive(Clone, Debug)]
struct KeptRay {
    /// Number of the last edit before it was traced.
    edit: u32,
    hits: Box<[CachedHit]>,
}

/// Edits of an object.
#[derive(Clone, Copy, Debug)]
struct Edited {
    object: u32,
    /// Last edit of its shape or placement, and its bounding box since then [m].
    shape: Option<(u32, [DVec3; 2])>,
    /// Last edit that changed how light leaves it.
    material: Option<u32>,
}

/// Cached rays of one light.
#[derive(Clone, Debug, Default)]
pub struct RayCache {
    rays: HashMap<RayKey, KeptRay>,
    bytes: u64,
    /// Number of the last edit.
    edit: u32,
    edited: Vec<Edited>,
}

/// A cached ray in the present scene.
#[derive(Clone, Copy, Debug)]
pub struct CachedRay<'a> {
    ray: &'a KeptRay,
    edited: &'a [Edited],
}

impl RayCache {
    /// Approximate memory [bytes].
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub fn len(&self) -> usize {
        self.rays.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// The ray with a start; `None` if it is not cached.
    pub fn get(&self, key: &RayKey) -> Option<CachedRay<'_>> {
        Some(CachedRay {
            ray: self.rays.get(key)?,
            edited: &self.edited,
        })
    }

    /// Caches a ray's hits unless the total would exceed `most_bytes`.
    pub fn insert(&mut self, fresh: TracedRay, most_bytes: u64) {
        let old = self
            .rays
            .get(&fresh.key)
            .map_or(0, |ray| bytes_of(ray.hits.len()));
        let new = self.bytes - old + bytes_of(fresh.hits.len());
        if new <= most_bytes {
            self.bytes = new;
            let ray = KeptRay {
                edit: self.edit,
                hits: fresh.hits,
            };
            self.rays.insert(fresh.key, ray);
        }
    }

    /// Begins an edit, to which all changes belong until the next one begins.
    pub fn begin_edit(&mut self) {
        self.edit += 1;
    }

    /// An object has a new shape or placement, within the box between two corners [m].
    pub fn shape_changed(&mut self, object: usize, bounds: (DVec3, DVec3)) {
        let edit = self.edit;
        self.edited_mut(object).shape = Some((edit, [bounds.0, bounds.1]));
    }

    /// Light leaves an object in other directions than before.
    pub fn material_changed(&mut self, object: usize) {
        let edit = self.edit;
        self.edited_mut(object).material = Some(edit);
    }

    fn edited_mut(&mut self, object: usize) -> &mut Edited {
        let object = object as u32;
        let place = self.edited.iter().position(|edited| edited.object == object);
        let place = place.unwrap_or_else(|| {
            self.edited.push(Edited {
                object,
                shape: None,
                material: None,
            });
            self.edited.len() - 1
        });
        &mut self.edited[place]
    }
}

impl CachedRay<'_> {
    /// Hit of the segment that starts after `signature`; outer `None` if it is not cached.
    pub fn hit(&self, signature: PathSignature) -> Option<Option<RayHit>> {
        let hit = self.ray.hits.iter().find(|hit| hit.signature == signature)?;
        Some(hit.place)
    }

    /// Whether a segment along the very ray that was traced still hits the same place.
    pub fn holds(&self, ray: &Ray, place: Option<RayHit>) -> bool {
        let reach_m = place.map_or(f64::INFINITY, |place| place.distance_m);
        let met = place.map(|place| place.object);
        self.edited.iter().all(|edited| match edited.shape {
            Some((edit, bounds)) if edit > self.ray.edit => {
                met != Some(edited.object) && !meets_box(ray, bounds, reach_m)
            }
            _ => true,
        })
    }

    /// Whether light still leaves an object as it did.
    pub fn leaves_alike(&self, object: u32) -> bool {
        let is_new = |edited: &&Edited| edited.material.is_some_and(|edit| edit > self.ray.edit);
        !self
            .edited
            .iter()
            .filter(is_new)
            .any(|edited| edited.object == object)
    }
}

/// Relative margin of boxes, which covers the rounding of hits.
const BOX_MARGIN: f64 = 1e-9;

/// Whether a ray hits a box before a distance [m]; conservative.
fn meets_box(ray: &Ray, [low, high]: [DVec3; 2], reach_m: f64) -> bool {
    let margin = BOX_MARGIN * (low.abs().max(high.abs()).max_element() + ray.origin.abs().max_element());
    let (mut enter, mut leave) = (0.0_f64, reach_m * (1.0 + BOX_MARGIN) + margin);
    for axis in 0..3 {
        let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
        let (near, far) = (low[axis] - margin - origin, high[axis] + margin - origin);
        if direction == 0.0 {
            if near > 0.0 || far < 0.0 {
                return false;
            }
        } else {
            let (a, b) = (near / direction, far / direction);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
    }
    enter <= leave * (1.0 + BOX_MARGIN) + margin
}
