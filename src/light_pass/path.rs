//! Traces one light ray through specular surfaces, along every branch above the threshold, and books its flux.

use std::rc::Rc;

use glam::{DVec2, DVec3};

use super::ledger_sum::{Account, LedgerSum};
use crate::geometry::Ray;
use crate::geometry::sampling::{GOLDEN_64, even_point, mix64};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Receiver, Side};
use crate::optics::{ColourMatrix, LinearSrgb};
use crate::transport::{Branch, EffectSet, Event, MediumStack, SurfaceHit, Tracer};

/// Hash of the sequence of (object, smoothing group, event) along a path: equal for neighbouring rays that took the
/// same path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PathSignature(pub u64);

impl PathSignature {
    /// At a surface: an object and the smoothing group that was hit.
    #[must_use]
    pub fn at(self, object: usize, group: u32) -> Self {
        self.mixed((object as u64) << 32 | u64::from(group))
    }

    /// After an event at the surface of [`Self::at`].
    #[must_use]
    pub fn event(self, event: Event) -> Self {
        self.mixed(event as u64 + 1)
    }

    fn mixed(self, word: u64) -> Self {
        // Distinct sequences collide with probability 2⁻⁶⁴.
        Self(mix64((self.0 ^ word).wrapping_add(GOLDEN_64)))
    }
}

/// Flux that reached a diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    pub receiver: Receiver,
    /// Index into the object's triangles.
    pub triangle: u32,
    pub signature: PathSignature,
    /// Second and third barycentric coordinate.
    pub barycentric: DVec2,
    /// [m].
    pub point: DVec3,
    /// Incident flux [W per channel of the light], before the albedo.
    pub flux_w: LinearSrgb,
    /// Length of the path from the light [m].
    pub path_m: f64,
}

#[derive(Clone, Copy, Debug)]
pub struct PathLimits {
    /// Most specular events.
    pub max_depth: u32,
    /// Smallest share of the ray's flux (luminance) at which a branch is traced.
    pub branch_threshold: f64,
    pub effects: EffectSet,
    /// Seed of the microfacets that are met on rough surfaces; without one, these are smooth.
    pub microfacets: Option<u64>,
}

impl PathLimits {
    /// With every effect, and rough surfaces as if they were smooth.
    pub fn smooth(max_depth: u32, branch_threshold: f64) -> Self {
        Self {
            max_depth,
            branch_threshold,
            effects: EffectSet::EVERYTHING,
            microfacets: None,
        }
    }
}

/// A specular surface on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathVertex {
    /// Index into `Scene::objects`.
    pub object: usize,
    /// Index within the object's mesh.
    pub triangle: usize,
    /// [m].
    pub point: DVec3,
    /// Unit vector, the direction of the incident light.
    pub incident: DVec3,
    /// Unit vector, the direction in which it continues.
    pub outgoing: DVec3,
    /// Unit normal of the surface, on the side of the incident light.
    pub normal: DVec3,
    /// Refractive index of the side that light leaves over that of the side it enters; 1 if it is reflected or passes
    /// straight.
    pub ior_ratio: f64,
    pub event: Event,
}

/// The last vertex of a path and those before it.
#[derive(Debug)]
pub struct Trail {
    vertex: PathVertex,
    before: Option<Rc<Self>>,
}

/// A ray to be traced, or the one on which an arrival came.
#[derive(Debug)]
pub struct Segment {
    pub ray: Ray,
    flux_w: LinearSrgb,
    media: MediumStack,
    signature: PathSignature,
    depth: u32,
    path_m: f64,
    /// Whether it is still direct light.
    is_straight: bool,
    /// `None` at the light, and where no vertices are kept.
    trail: Option<Rc<Trail>>,
}

impl Segment {
    /// The specular surfaces before it, from the light on; empty unless the tracer keeps them.
    pub fn vertices(&self) -> Vec<PathVertex> {
        let trail = std::iter::successors(self.trail.as_deref(), |trail| trail.before.as_deref());
        let mut vertices: Vec<PathVertex> = trail.map(|trail| trail.vertex).collect();
        vertices.reverse();
        vertices
    }
}

/// Traces light rays of one light; reused from ray to ray.
#[derive(Debug)]
pub struct PathTracer<'a> {
    tracer: &'a Tracer,
    pub limits: PathLimits,
    /// `None` if the ledger stays empty.
    unit: Option<FluxUnit>,
    /// From the flux of paths to the light's channels.
    channels: ColourMatrix,
    keeps_vertices: bool,
    waiting: Vec<Segment>,
    /// Of all rays so far.
    pub ledger: LedgerSum,
    /// Closest-hit queries so far.
    pub segments: u64,
}

impl<'a> PathTracer<'a> {
    /// With an empty ledger, for linear sRGB.
    pub fn new(tracer: &'a Tracer, limits: PathLimits, unit: FluxUnit) -> Self {
        Self {
            unit: Some(unit),
            ..Self::without_ledger(tracer, limits)
        }
    }

    /// The same, but nothing is booked.
    pub fn without_ledger(tracer: &'a Tracer, limits: PathLimits) -> Self {
        Self {
            tracer,
            limits,
            unit: None,
            channels: ColourMatrix::IDENTITY,
            keeps_vertices: false,
            waiting: Vec::new(),
            ledger: LedgerSum::default(),
            segments: 0,
        }
    }

    /// For light in other channels than linear sRGB.
    #[must_use]
    pub fn with_channels(self, channels: ColourMatrix) -> Self {
        Self { channels, ..self }
    }

    /// Keeps the vertices of each path, and tells paths apart by the smoothing groups that they meet.
    #[must_use]
    pub fn with_vertices(self) -> Self {
        Self {
            keeps_vertices: true,
            ..self
        }
    }

    /// Traces a ray that carries `flux_w` from the light, which lies within `media`. Arrivals at diffuse surfaces after
    /// at least one specular event are passed to `arrive`, with the segment that they come on. `Deposited` is not
    /// booked here, but by whoever places the flux.
    pub fn trace(
        &mut self,
        ray: Ray,
        flux_w: LinearSrgb,
        media: &MediumStack,
        mut arrive: impl FnMut(Arrival, &Segment),
    ) {
        if !(flux_w.is_finite() && flux_w.max_channel() > 0.0) {
            return;
        }
        let floor_w = flux_w.luminance() * self.limits.branch_threshold;
        let first = Segment {
            ray,
            flux_w,
            media: *media,
            signature: PathSignature::default(),
            depth: 0,
            path_m: 0.0,
            is_straight: true,
            trail: None,
        };
        self.waiting.push(first);
        while let Some(segment) = self.waiting.pop() {
            self.step(&segment, floor_w, &mut arrive);
        }
    }

    fn book(&mut self, account: Account, flux_w: LinearSrgb) {
        if let Some(unit) = self.unit {
            self.ledger.book(account, unit.count(self.channels.apply(flux_w)));
        }
    }

    fn step(&mut self, segment: &Segment, floor_w: f64, arrive: &mut impl FnMut(Arrival, &Segment)) {
        // Light that meets nothing at all was never caustic light; after an event it has escaped.
        self.segments += 1;
        let Some(hit) = self.tracer.closest_hit(&segment.ray) else {
            let account = if segment.depth == 0 {
                Account::NotEmitted
            } else {
                Account::Escaped
            };
            return self.book(account, segment.flux_w);
        };

        // The medium absorbs along the segment before the surface splits what is left.
        let mut flux_w = segment.flux_w;
        let effects = self.limits.effects;
        if effects.absorption && segment.media.absorbs(self.tracer.scene()) {
            flux_w = flux_w * segment.media.transmittance(self.tracer.scene(), hit.distance_m);
        }
        let path_m = segment.path_m + hit.distance_m;
        // Each event along a path samples a microfacet of its own, independently.
        let micro = self
            .limits
            .microfacets
            .map(|seed| even_point(0, segment.depth, seed));
        let interaction =
            self.tracer
                .interact_with(effects, &hit, segment.ray.direction, &segment.media, micro);

        // What light deposits while it is straight belongs to the direct layer; all later deposits are caustic light.
        let deposit_w = flux_w * interaction.deposit;
        if segment.is_straight {
            // Flux deposited at the first hit is direct light, and so is what a body around the light absorbs of it.
            let is_specular = self.tracer.scene().material_of(hit.object).surface.is_specular();
            let direct_w = if is_specular { deposit_w } else { segment.flux_w };
            self.book(Account::NotEmitted, direct_w);
            let sent_w = if segment.depth == 0 {
                segment.flux_w
            } else {
                LinearSrgb::BLACK
            };
            self.book(Account::Emitted, sent_w - direct_w);
            if !is_specular {
                return;
            }
        } else if deposit_w.max_channel() > 0.0 {
            let arriving_w = self.channels.apply(deposit_w);
            arrive(arrival(&hit, segment, arriving_w, path_m), segment);
        }

        // What is neither deposited nor sent on is booked under its cause, so that the ledger balances.
        let on_the_way_w = segment.flux_w - flux_w;
        self.book(Account::Absorbed, on_the_way_w + flux_w * interaction.absorbed);
        self.book(Account::SwitchedOff, flux_w * interaction.switched_off);
        for branch in [interaction.reflection, interaction.transmission]
            .into_iter()
            .flatten()
        {
            self.follow(&branch, &hit, flux_w, path_m, segment, floor_w);
        }
    }

    fn follow(
        &mut self,
        branch: &Branch,
        hit: &SurfaceHit,
        incident_w: LinearSrgb,
        path_m: f64,
        from: &Segment,
        floor_w: f64,
    ) {
        // A branch that is not traced is booked under its cause, so that no flux goes missing from the ledger.
        let flux_w = incident_w * branch.share;
        if flux_w.max_channel() <= 0.0 {
            return;
        }
        if !(flux_w.is_finite() && branch.ray.direction.is_finite() && branch.ray.origin.is_finite()) {
            return self.book(
                Account::NonFinite,
                flux_w.map(|w| if w.is_finite() { w } else { 0.0 }),
            );
        }
        if from.depth + 1 > self.limits.max_depth {
            return self.book(Account::Depth, flux_w);
        }
        if flux_w.luminance() < floor_w {
            return self.book(Account::Threshold, flux_w);
        }

        // Smoothing groups tell apart paths over different faces of one body.
        let group = if self.keeps_vertices {
            self.tracer.smoothing_group(hit.object, hit.triangle)
        } else {
            0
        };
        self.waiting.push(Segment {
            ray: branch.ray,
            flux_w,
            media: branch.media,
            signature: from.signature.at(hit.object, group).event(branch.event),
            depth: from.depth + 1,
            path_m,
            is_straight: from.is_straight && branch.event == Event::Passage,
            trail: self
                .keeps_vertices
                .then(|| Rc::new(Trail::new(hit, branch, from))),
        });
    }
}

impl Trail {
    fn new(hit: &SurfaceHit, branch: &Branch, from: &Segment) -> Self {
        Self {
            vertex: PathVertex {
                object: hit.object,
                triangle: hit.triangle,
                point: hit.point,
                incident: from.ray.direction,
                outgoing: branch.ray.direction,
                normal: branch.normal,
                ior_ratio: branch.ior_ratio,
                event: branch.event,
            },
            before: from.trail.clone(),
        }
    }
}

fn arrival(hit: &SurfaceHit, segment: &Segment, flux_w: LinearSrgb, path_m: f64) -> Arrival {
    Arrival {
        receiver: Receiver::new(hit.object, Side::met(segment.ray.direction, hit.geometric_normal)),
        triangle: hit.triangle as u32,
        signature: segment.signature,
        barycentric: DVec2::new(hit.barycentric[1], hit.barycentric[2]),
        point: hit.point,
        flux_w,
        path_m,
    }
}
