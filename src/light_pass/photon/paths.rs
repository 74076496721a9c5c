//! The light of one point of the launch domain, along all of its paths.

use glam::DVec2;

use super::launch::{LAMP_MIDDLE, PhotonLaunch};
use super::receivers::Receivers;
use super::spectrum::PhotonSpectrum;
use super::walk::PhotonRules;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_SLOT;
use crate::illumination::{Receiver, Side};
use crate::light_pass::path::PathSignature;
use crate::optics::LinearSrgb;
use crate::transport::{Branch, Event, MediumStack, Meeting, SurfaceHit, Tracer};

/// Longer paths are left to photons.
pub(super) const MAX_STEPS: usize = 12;

/// Maximum number of paths of a point that wait to be followed; further ones are left to photons.
const MAX_WAITING: usize = 30;

/// Paths with less than this part of the emitted flux are left to photons. Between 0.01 and 0.001 it hardly matters on
/// glass, as guides lead photons along what is left out.
const MIN_SHARE: f64 = 0.003;

/// Approximate segments of a photon on a path that was not followed.
const LOST_SEGMENTS: f64 = 10.0;

/// The specular events of a path, at most [`MAX_STEPS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Chain {
    length: u8,
    /// One bit an event.
    reflections: u16,
    objects: [u32; MAX_STEPS],
}

impl Chain {
    pub(super) fn len(&self) -> usize {
        usize::from(self.length)
    }

    /// Object and kind of an event, if the path has it.
    #[inline]
    pub(super) fn step(&self, depth: usize) -> Option<ChainStep> {
        (depth < self.len()).then(|| ChainStep {
            object: self.objects[depth],
            is_reflected: self.reflections >> depth & 1 != 0,
        })
    }

    /// With one more event, unless it is full.
    fn with(mut self, object: usize, is_reflected: bool) -> Self {
        if self.len() < MAX_STEPS {
            self.objects[self.len()] = object as u32;
            self.reflections |= u16::from(is_reflected) << self.length;
            self.length += 1;
        }
        self
    }
}

/// A specular event on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChainStep {
    pub(super) object: u32,
    pub(super) is_reflected: bool,
}

/// What a path is known by: equal for points whose light goes the same way to the same island of a receiver's map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Route {
    pub(super) signature: PathSignature,
    pub(super) chain: Chain,
    pub(super) receiver: Receiver,
    /// Island of the receiver's chart.
    pub(super) island: u32,
    /// Whether a surface on the way separates wavelengths.
    pub(super) is_dispersed: bool,
    /// From the last surface on the way to the receiver, at one point of the path [m].
    pub(super) leg_m: f32,
}

/// Light of a point at the end of one path.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathEnd {
    pub(super) route: Route,
    /// On the map [texels].
    pub(super) place: DVec2,
    /// Per unit square of the launch domain [W].
    pub(super) flux_w: LinearSrgb,
}

/// The light of one point, along all of its paths; flux per unit square of the launch domain [W].
#[derive(Debug, Default)]
pub(super) struct PointPaths {
    pub(super) ends: Vec<PathEnd>,
    /// Emitted, largest channel.
    pub(super) start_w: f64,
    /// Left to photons: the way so far, and its flux, largest channel.
    pub(super) lost: Vec<(Chain, f64)>,
    /// Mean segments of a photon.
    pub(super) segments: f64,
    /// Segments that were traced.
    pub(super) traced: u32,
}

impl PointPaths {
    pub(super) fn end(&self, signature: PathSignature) -> Option<&PathEnd> {
        self.ends.iter().find(|end| end.route.signature == signature)
    }

    /// Leaves light to photons. They also book flux that is not finite.
    fn lose(&mut self, flux_w: LinearSrgb, chain: Chain) {
        if flux_w.is_finite() {
            self.lost.push((chain, flux_w.max_channel()));
        }
    }
}

/// Light of a path that is to be continued.
struct QueuedLight {
    ray: Ray,
    /// Slot of the triangle that it leaves.
    left: u32,
    media: MediumStack,
    flux_w: LinearSrgb,
    signature: PathSignature,
    chain: Chain,
    /// Whether it has only passed holes, and is still direct light.
    is_straight: bool,
    is_dispersed: bool,
}

/// Follows the light of points.
#[derive(Clone, Copy)]
pub(super) struct PathFinder<'a> {
    pub(super) launch: &'a PhotonLaunch<'a>,
    pub(super) rules: PhotonRules<'a>,
    pub(super) receivers: &'a Receivers<'a>,
}

impl PathFinder<'_> {
    /// The light of a point of a root's square, from the middle of the lamp and at the middle wavelength.
    pub(super) fn paths(&self, root: usize, square: DVec2) -> PointPaths {
        self.trace(self.middle_tracer(), root, square, LAMP_MIDDLE)
    }

    /// Light from half-way out along both axes of an extended light; `None` for light from one point or direction.
    pub(super) fn at_lamp_sides(&self, root: usize, square: DVec2) -> Option<[PointPaths; 2]> {
        self.launch.lamp_outline()?;
        let half_way = [DVec2::new(0.75, 0.5), DVec2::new(0.5, 0.75)];
        Some(half_way.map(|lamp| self.trace(self.middle_tracer(), root, square, lamp)))
    }

    /// Light at the first and the last wavelength of a spectrum; `None` for light that is not dispersed.
    pub(super) fn at_spectrum_ends(&self, root: usize, square: DVec2) -> Option<[PointPaths; 2]> {
        let [_, first, last] = self.rules.spectrum?.tracers()?;
        Some([first, last].map(|tracer| self.trace(tracer, root, square, LAMP_MIDDLE)))
    }

    fn middle_tracer(&self) -> &Tracer {
        let tracers = self.rules.spectrum.and_then(PhotonSpectrum::tracers);
        tracers.map_or(self.rules.tracer, |[middle, ..]| middle)
    }

    fn trace(&self, tracer: &Tracer, root: usize, square: DVec2, lamp: DVec2) -> PointPaths {
        let mut paths = PointPaths::default();
        let Some(start) = self.launch.start_at(root, square, lamp) else {
            return paths;
        };
        if !(start.flux_w.max_channel() > 0.0 && start.flux_w.is_finite()) {
            return paths;
        }
        paths.start_w = start.flux_w.max_channel();
        let mut waiting = Vec::with_capacity(8);
        waiting.push(QueuedLight {
            ray: start.ray,
            left: NO_SLOT,
            media: start.media,
            flux_w: start.flux_w,
            signature: PathSignature::default(),
            chain: Chain::default(),
            is_straight: true,
            is_dispersed: self.rules.spectrum.is_some_and(PhotonSpectrum::starts_parted),
        });
        while let Some(light) = waiting.pop() {
            paths.traced += 1;
            paths.segments += light.flux_w.max_channel() / paths.start_w;
            if let Some(hit) = tracer.next_hit(&light.ray, light.left) {
                self.meet(tracer, light, &hit, &mut paths, &mut waiting);
            }
        }
        let lost_w: f64 = paths.lost.iter().map(|(_, flux_w)| flux_w).sum();
        paths.segments += LOST_SEGMENTS * lost_w / paths.start_w;
        paths
    }

    /// Ends a path at a surface, or continues it with what the surface passes on.
    fn meet(
        &self,
        tracer: &Tracer,
        light: QueuedLight,
        hit: &SurfaceHit,
        paths: &mut PointPaths,
        waiting: &mut Vec<QueuedLight>,
    ) {
        // Direct light belongs to another layer. Rough surfaces scatter into more directions than bundles can follow.
        let effects = self.rules.effects;
        let material = tracer.scene().material_of(hit.object);
        if light.is_straight && !material.surface.is_specular() {
            return;
        }
        if effects.lobes && material.is_rough() {
            paths.lose(light.flux_w, light.chain);
            return;
        }

        // The medium absorbs along the way (Beer–Lambert); the surface splits what is left.
        let mut flux_w = light.flux_w;
        if effects.absorption && light.media.absorbs(tracer.scene()) {
            flux_w = flux_w * light.media.transmittance(tracer.scene(), hit.distance_m);
        }
        let mut meeting = Meeting::new(hit, light.ray.direction, &light.media);
        tracer.meet(effects, None, &mut meeting);
        let least_w = MIN_SHARE * paths.start_w;

        // What a diffuse surface takes, if it has a map.
        let taken_w = flux_w * meeting.deposit;
        if !light.is_straight && taken_w.max_channel() > 0.0 {
            let is_followed = taken_w.max_channel() >= least_w && taken_w.is_finite();
            match self.end(&light, hit).filter(|_| is_followed) {
                Some(end) => paths.ends.push(PathEnd {
                    flux_w: taken_w,
                    ..end
                }),
                None => paths.lose(taken_w, light.chain),
            }
        }

        // Photons give up longer paths as well.
        if light.chain.len() >= self.rules.max_depth as usize {
            return;
        }

        // What a specular surface reflects and transmits.
        let signature = light
            .signature
            .at(hit.object, tracer.smoothing_group(hit.object, hit.triangle));
        let is_dispersed = light.is_dispersed || material.is_dispersive();
        let mut go_on = |branch: Branch| {
            let flux_w = flux_w * branch.share;
            let chain = light.chain.with(hit.object, branch.event.is_reflection());
            let is_followed = light.chain.len() < MAX_STEPS
                && waiting.len() < MAX_WAITING
                && flux_w.is_finite()
                && flux_w.max_channel() >= least_w;
            if !is_followed {
                paths.lose(flux_w, chain);
                return;
            }
            waiting.push(QueuedLight {
                ray: branch.ray,
                left: hit.slot,
                media: branch.media,
                flux_w,
                signature: signature.event(branch.event),
                chain,
                is_straight: light.is_straight && branch.event == Event::Passage,
                is_dispersed,
            });
        };
        meeting.reflection().into_iter().for_each(&mut go_on);
        meeting.transmission().into_iter().for_each(&mut go_on);
    }

    /// The end of a path at a hit; `None` on a surface without a map.
    fn end(&self, light: &QueuedLight, hit: &SurfaceHit) -> Option<PathEnd> {
        let receiver = Receiver::new(hit.object, Side::met(light.ray.direction, hit.geometric_normal));
        let chart = self.receivers.get(receiver)?;
        let islands = chart.chart.islands();
        let island = islands.map_or(0, |islands| islands.of_triangle(hit.triangle));
        Some(PathEnd {
            route: Route {
                signature: light.signature.at(receiver.index(), island),
                chain: light.chain,
                receiver,
                island,
                is_dispersed: light.is_dispersed,
                leg_m: hit.distance_m as f32,
            },
            place: chart.place(hit.triangle, hit.barycentric),
            flux_w: LinearSrgb::BLACK,
        })
    }
}
