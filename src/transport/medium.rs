//! The stack of media that a path is inside of, and the media that a point lies in.

use super::Tracer;
use crate::geometry::Ray;
use crate::optics::LinearSrgb;
use crate::scene::{Scene, Volume};
use glam::DVec3;

/// Most nested bodies that a path keeps track of.
const CAPACITY: usize = 8;

/// Bodies that the path is inside of, each by the object that stands for it, innermost last. Entering a body pushes it,
/// leaving it removes its topmost entry. The medium is the one on top, or vacuum when empty. Where bodies overlap, the
/// medium is thus the one entered last, and leaving the other one within it does not refract. A body beyond the
/// capacity is not recorded: the path then leaves it into the medium on top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MediumStack {
    objects: [u32; CAPACITY],
    depth: u8,
}

impl MediumStack {
    /// Refractive index of the medium on top [1].
    pub fn ior(&self, scene: &Scene) -> f64 {
        self.top().map_or(1.0, |object| scene.material_of(object).ior)
    }

    /// The bodies, outermost first.
    pub fn objects(&self) -> &[u32] {
        &self.objects[..usize::from(self.depth)]
    }

    /// The object of the innermost body.
    pub fn top(&self) -> Option<usize> {
        self.depth
            .checked_sub(1)
            .map(|top| self.objects[usize::from(top)] as usize)
    }

    /// The media after entering a body.
    #[must_use]
    #[inline]
    pub fn entered(mut self, object: usize) -> Self {
        if usize::from(self.depth) < CAPACITY {
            self.objects[usize::from(self.depth)] = object as u32;
            self.depth += 1;
        }
        self
    }

    /// The media after leaving a body; unchanged where the path was not inside it (an open sheet, or a start
    /// inside).
    #[must_use]
    #[inline]
    pub fn left(mut self, object: usize) -> Self {
        let depth = usize::from(self.depth);
        // The usual case, without a search.
        if self.top() == Some(object) {
            self.depth -= 1;
        } else if let Some(found) = self.objects[..depth]
            .iter()
            .rposition(|&entry| entry as usize == object)
        {
            self.objects.copy_within(found + 1..depth, found);
            self.depth -= 1;
        }
        self
    }

    /// Whether the medium on top absorbs light.
    pub fn absorbs(&self, scene: &Scene) -> bool {
        let volume = self.top().and_then(|object| scene.material_of(object).volume);
        volume.is_some_and(|volume| volume.attenuation_distance_m.is_finite())
    }

    /// Transmittance of a distance [m] in the medium on top.
    pub fn transmittance(&self, scene: &Scene, distance_m: f64) -> LinearSrgb {
        match self.top().and_then(|object| scene.material_of(object).volume) {
            Some(volume) => volume.transmittance(distance_m),
            None => LinearSrgb::WHITE,
        }
    }
}

impl Volume {
    /// Beer–Lambert law: colour^(distance/attenuation distance).
    pub fn transmittance(&self, distance_m: f64) -> LinearSrgb {
        if self.attenuation_distance_m.is_infinite() {
            return LinearSrgb::WHITE;
        }
        self.attenuation_colour
            .map(|channel| channel.powf(distance_m / self.attenuation_distance_m))
    }
}

/// Surfaces crossed above the point before the search ends.
const MAX_CROSSINGS: usize = 100_000;

/// Media around a point, outermost first: bodies that an upward ray leaves more often than it enters. Upward, so that
/// an open sheet of water with its normals up counts as the water below it.
pub fn media_at(tracer: &Tracer, point: DVec3) -> MediumStack {
    // Crossings are counted by body: an entry on the way cancels the exit that follows it.
    let scene = tracer.scene();
    let mut entered = vec![0u32; scene.objects.len()];
    let mut left_from_inside = Vec::new();
    let mut ray = Ray {
        origin: point,
        direction: DVec3::Y,
    };
    for _ in 0..MAX_CROSSINGS {
        let Some(hit) = tracer.closest_hit(&ray) else {
            break;
        };
        let body = scene.body_of(hit.object);
        if scene.material_of(hit.object).is_solid() {
            if hit.geometric_normal.dot(ray.direction) < 0.0 {
                entered[body] += 1;
            } else if entered[body] > 0 {
                entered[body] -= 1;
            } else {
                left_from_inside.push(body);
            }
        }
        ray = hit.spawn(ray.direction);
    }
    // An inside-out body is left before it is entered: the point is not inside it.
    let mut is_within = |object: &usize| {
        let is_balanced = entered[*object] > 0;
        entered[*object] -= u32::from(is_balanced);
        !is_balanced
    };
    left_from_inside.retain(&mut is_within);
    // The body that is left first is innermost.
    left_from_inside
        .into_iter()
        .rev()
        .fold(MediumStack::default(), |media, object| media.entered(object))
}
