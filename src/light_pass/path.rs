//! Traces one light ray through specular surfaces, along every branch above the threshold, and books its flux.

use glam::{DVec2, DVec3};

use super::ledger_sum::{Account, LedgerSum};
use crate::geometry::Ray;
use crate::geometry::sampling::{GOLDEN_64, mix64};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Receiver, Side};
use crate::optics::{ColourMatrix, LinearSrgb};
use crate::transport::{Branch, EffectSet, Event, MediumStack, Microfacets, SurfaceHit, Tracer};

/// Hash of the sequence of (object, event) along a path: equal for neighbouring rays that took the same path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PathSignature(pub u64);

impl PathSignature {
    /// After one more event at an object.
    #[must_use]
    pub fn with(self, object: usize, event: Event) -> Self {
        self.mixed((object as u64) << 3 | event as u64)
    }

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
    /// Samples of the microfacets of rough surfaces; without them, these are smooth.
    pub microfacets: Option<Microfacets>,
}

/// A ray that waits to be traced.
#[derive(Clone, Copy, Debug)]
struct Segment {
    ray: Ray,
    flux_w: LinearSrgb,
    media: MediumStack,
    signature: PathSignature,
    depth: u32,
    path_m: f64,
    /// Whether it is still direct light.
    is_straight: bool,
}

/// Traces light rays of one light; reused from ray to ray.
#[derive(Debug)]
pub struct PathTracer<'a> {
    tracer: &'a Tracer,
    pub limits: PathLimits,
    unit: FluxUnit,
    /// From the flux of paths to the light's channels.
    channels: ColourMatrix,
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
            tracer,
            limits,
            unit,
            channels: ColourMatrix::IDENTITY,
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

    /// Traces a ray that carries `flux_w` from the light, which lies within `media`. Arrivals at diffuse surfaces after
    /// at least one specular event are passed to `arrive`. `Deposited` is not booked here, but by whoever places the
    /// flux.
    pub fn trace(
        &mut self,
        ray: Ray,
        flux_w: LinearSrgb,
        media: &MediumStack,
        mut arrive: impl FnMut(Arrival),
    ) {
        if !flux_w.is_finite() {
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
        };
        self.waiting.push(first);
        while let Some(segment) = self.waiting.pop() {
            self.step(segment, floor_w, &mut arrive);
        }
    }

    fn book(&mut self, account: Account, flux_w: LinearSrgb) {
        self.ledger
            .book(account, self.unit.count(self.channels.apply(flux_w)));
    }

    fn step(&mut self, segment: Segment, floor_w: f64, arrive: &mut impl FnMut(Arrival)) {
        self.segments += 1;
        let Some(hit) = self.tracer.closest_hit(&segment.ray) else {
            let account = if segment.depth == 0 {
                Account::NotEmitted
            } else {
                Account::Escaped
            };
            return self.book(account, segment.flux_w);
        };
        let mut flux_w = segment.flux_w;
        let effects = self.limits.effects;
        if effects.absorption && segment.media.absorbs(self.tracer.scene()) {
            flux_w = flux_w * segment.media.transmittance(self.tracer.scene(), hit.distance_m);
        }
        let path_m = segment.path_m + hit.distance_m;
        let micro = self.limits.microfacets.map(|facets| facets.at(segment.depth));
        let interaction =
            self.tracer
                .interact_with(effects, &hit, segment.ray.direction, &segment.media, micro);
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
            arrive(arrival(&hit, &segment, arriving_w, path_m));
        }
        let on_the_way_w = segment.flux_w - flux_w;
        self.book(Account::Absorbed, on_the_way_w + flux_w * interaction.absorbed);
        self.book(Account::SwitchedOff, flux_w * interaction.switched_off);
        for branch in [interaction.reflection, interaction.transmission]
            .into_iter()
            .flatten()
        {
            self.follow(&branch, hit.object, flux_w, path_m, &segment, floor_w);
        }
    }

    fn follow(
        &mut self,
        branch: &Branch,
        object: usize,
        incident_w: LinearSrgb,
        path_m: f64,
        from: &Segment,
        floor_w: f64,
    ) {
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
        self.waiting.push(Segment {
            ray: branch.ray,
            flux_w,
            media: branch.media,
            signature: from.signature.with(object, branch.event),
            depth: from.depth + 1,
            path_m,
            is_straight: from.is_straight && branch.event == Event::Passage,
        });
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
