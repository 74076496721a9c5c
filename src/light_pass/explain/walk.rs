//! Follows one light ray to a receiver and records its surfaces.

use glam::{DVec2, DVec3};

use super::target::Target;
use super::{Limits, PathVertex};
use crate::geometry::Ray;
use crate::illumination::{Receiver, Side};
use crate::light_pass::launch::Launch;
use crate::light_pass::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::transport::{Event, MediumStack, Tracer};

/// Maximum number of queued segments of one light ray.
const MAX_WAITING: usize = 512;

/// Light that reaches the receiver over at least one specular surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    pub(super) way: PathSignature,
    /// Relative to the texel's corner [texels].
    pub(super) place: DVec2,
    /// Flux per unit square of the light's domain [W].
    pub(super) flux_w: LinearSrgb,
}

/// A complete path.
#[derive(Clone, Debug)]
pub(super) struct WalkedPath {
    pub(super) start: DVec3,
    pub(super) vertices: Vec<PathVertex>,
    pub(super) end: DVec3,
    pub(super) place: DVec2,
}

/// Traces rays of one wavefront to one target.
pub(super) struct LightPathWalker<'a> {
    pub(super) tracer: &'a Tracer,
    pub(super) launch: &'a Launch,
    pub(super) target: &'a Target,
    pub(super) limits: Limits,
}

#[derive(Clone, Copy)]
struct Segment {
    ray: Ray,
    flux_w: LinearSrgb,
    media: MediumStack,
    way: PathSignature,
    depth: u32,
    /// Index of its last vertex.
    from: Option<usize>,
    /// Whether it is still direct light.
    is_straight: bool,
}

/// A vertex and the index of the one before it.
struct Step {
    vertex: PathVertex,
    before: Option<usize>,
}

impl LightPathWalker<'_> {
    /// All arrivals of a ray at the target.
    pub(super) fn arrivals(&self, face: usize, square: DVec2) -> Vec<Arrival> {
        let mut found = Vec::new();
        self.walk(face, square, |arrival, _, _, _| found.push(arrival));
        found
    }

    /// The path of a ray that has the wanted signature; `None` if the ray takes no such path.
    pub(super) fn way(&self, face: usize, square: DVec2, wanted: PathSignature) -> Option<WalkedPath> {
        let mut found = None;
        self.walk(face, square, |arrival, end, last, steps| {
            if arrival.way == wanted {
                let mut vertices = Vec::new();
                let mut next = last;
                while let Some(index) = next {
                    let step: &Step = &steps[index];
                    vertices.push(step.vertex);
                    next = step.before;
                }
                vertices.reverse();
                found = Some(WalkedPath {
                    start: self.launch.ray(face, square).origin,
                    vertices,
                    end,
                    place: arrival.place,
                });
            }
        });
        found
    }

    fn walk(
        &self,
        face: usize,
        square: DVec2,
        mut arrive: impl FnMut(Arrival, DVec3, Option<usize>, &[Step]),
    ) {
        let ray = self.launch.ray(face, square);
        let flux_w = self.launch.flux_density_w(square, ray.direction);
        if !(flux_w.is_finite() && flux_w.max_channel() > 0.0) {
            return;
        }
        let floor_w = flux_w.luminance() * self.limits.branch_threshold;
        let mut steps: Vec<Step> = Vec::new();
        let mut waiting = vec![Segment {
            ray,
            flux_w,
            media: *self.launch.media(),
            way: PathSignature::default(),
            depth: 0,
            from: None,
            is_straight: true,
        }];
        while let Some(segment) = waiting.pop() {
            let Some(hit) = self.tracer.closest_hit(&segment.ray) else {
                continue;
            };
            let scene = self.tracer.scene();
            let transmittance = segment.media.transmittance(scene, hit.distance_m);
            let incident = segment.flux_w * transmittance;
            let direction = segment.ray.direction;
            let interaction = self.tracer.interact(&hit, direction, &segment.media);
            let receiver = Receiver::new(hit.object, Side::met(direction, hit.geometric_normal));
            let taken = incident * interaction.deposit;
            if !segment.is_straight && receiver == self.target.receiver && taken.max_channel() > 0.0 {
                let arrival = Arrival {
                    way: segment.way,
                    place: self.target.landing(&segment.ray, &hit),
                    flux_w: taken,
                };
                arrive(arrival, hit.point, segment.from, &steps);
            }
            let group = self.tracer.smoothing_group(hit.object, hit.triangle);
            let branches = [interaction.reflection, interaction.transmission];
            for branch in branches.into_iter().flatten() {
                let flux_w = incident * branch.share;
                let is_followed = flux_w.is_finite()
                    && flux_w.luminance() > floor_w
                    && segment.depth < self.limits.max_depth
                    && waiting.len() < MAX_WAITING;
                if is_followed {
                    steps.push(Step {
                        vertex: PathVertex {
                            object: hit.object,
                            triangle: hit.triangle,
                            point: hit.point,
                            incident: direction,
                            outgoing: branch.ray.direction,
                            normal: branch.normal,
                            ior_ratio: branch.ior_ratio,
                            event: branch.event,
                        },
                        before: segment.from,
                    });
                    waiting.push(Segment {
                        ray: branch.ray,
                        flux_w,
                        media: branch.media,
                        way: segment.way.at(hit.object, group).event(branch.event),
                        depth: segment.depth + 1,
                        from: Some(steps.len() - 1),
                        is_straight: segment.is_straight && branch.event == Event::Passage,
                    });
                }
            }
        }
    }
}
