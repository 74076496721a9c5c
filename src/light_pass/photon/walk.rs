//! The path of one photon: at every surface one branch, drawn in proportion to its share of the light.

use glam::DVec2;

use super::bundles::{Bundle, Carried, Step};
use super::launch::{LAMP_DIMENSION, Start};
use super::spectrum::{Hue, PhotonSpectrum};
use crate::geometry::Ray;
use crate::geometry::sampling::{even_number, even_point};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Receiver, Side};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::optics::{ColourMatrix, LinearSrgb};
use crate::transport::{Branch, EffectSet, Event, MediumStack, Meeting, Tracer};

/// A photon whose flux (largest channel) has become less than this part of what it started with goes on by chance, with
/// this part of it or not at all.
const ROULETTE_BELOW: f64 = 0.1;

/// Dimension of [`even_point`] that wavelengths are drawn from.
pub(super) const WAVELENGTH_DIMENSION: u32 = 1 << 16;

/// What a photon leaves on a diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Whose light it becomes.
    pub receiver: Receiver,
    /// Where.
    pub place: PhotonArrival,
    /// Incident flux [W per channel of the light] if it were the only photon, before the albedo.
    pub flux_w: LinearSrgb,
    /// Band of its wavelength, where it has one.
    pub band: Option<usize>,
}

/// Where a photon arrives.
#[derive(Clone, Copy, Debug)]
pub enum PhotonArrival {
    Surface {
        /// Index into the object's triangles.
        triangle: usize,
        /// Of the triangle's corners.
        barycentric: [f64; 3],
    },
    /// On the map [texels], where the flux of a bundle is removed.
    Map(DVec2),
}

/// What all photons of a light share.
#[derive(Clone, Copy, Debug)]
pub struct PhotonRules<'a> {
    /// The scene.
    pub tracer: &'a Tracer,
    /// Of a light whose wavelengths go different ways.
    pub spectrum: Option<&'a PhotonSpectrum>,
    /// What paths may need.
    pub effects: EffectSet,
    /// Most specular events.
    pub max_depth: u32,
    /// Of the accounts: that of a single photon.
    pub unit: FluxUnit,
    /// Of everything random.
    pub seed: u64,
}

/// Follows photons, one after the other, and books what becomes of their flux.
#[derive(Debug)]
pub struct PhotonWalk<'a> {
    rules: PhotonRules<'a>,
    /// Accounts of all photons so far.
    pub ledger: LedgerSum,
    /// Closest-hit queries so far.
    pub segments: u64,
}

/// The photon under way.
struct Photon<'a> {
    hue: Hue<'a>,
    /// What it becomes where wavelengths part.
    own_hue: Option<Hue<'a>>,
    flux_w: LinearSrgb,
    index: u32,
    choice: Choice,
    carried: Carried<'a>,
    /// Those that it has followed so far, a bit each.
    followed: u32,
    /// Probability of having been drawn to go this way.
    probability: f64,
    /// Whether it is direct light still.
    is_straight: bool,
}

impl<'a> PhotonWalk<'a> {
    /// With empty accounts.
    pub fn new(rules: PhotonRules<'a>) -> Self {
        Self {
            rules,
            ledger: LedgerSum::default(),
            segments: 0,
        }
    }

    #[inline]
    fn book(&mut self, account: Account, channels: &ColourMatrix, flux_w: LinearSrgb) {
        if flux_w != LinearSrgb::BLACK {
            let count = self.rules.unit.count(self.apply(channels, flux_w));
            self.ledger.book(account, count);
        }
    }

    /// Flux in the channels of the light.
    fn apply(&self, channels: &ColourMatrix, flux_w: LinearSrgb) -> LinearSrgb {
        match self.rules.spectrum {
            Some(_) => channels.apply(flux_w),
            None => flux_w,
        }
    }

    /// Follows the photon of an index, if there is one, to its end; hits on diffuse surfaces after at least one specular event
    /// are handed to `arrive`. `Deposited` is not booked here but by who places the flux.
    pub(super) fn follow(
        &mut self,
        index: u32,
        start: Option<Start>,
        mut carried: Carried<'a>,
        mut arrive: impl FnMut(Hit),
    ) {
        let whole = match self.rules.spectrum {
            Some(spectrum) => spectrum.whole(),
            None => Hue {
                tracer: self.rules.tracer,
                channels: ColourMatrix::IDENTITY,
                band: None,
                ends: [0.0; 2],
            },
        };
        let own_hue = self.rules.spectrum.and_then(|spectrum| {
            let place = even_point(index, WAVELENGTH_DIMENSION, self.rules.seed).x;
            spectrum.one(place)
        });
        if let Some(hue) = own_hue {
            carried.origin.ends = hue.ends;
        }
        let mut photon = Photon {
            hue: whole,
            own_hue,
            flux_w: start.map_or(LinearSrgb::BLACK, |start| start.flux_w),
            choice: Choice::new(index, self.rules.seed),
            index,
            carried,
            followed: (1 << carried.bundles.len()) - 1,
            probability: 1.0,
            is_straight: true,
        };
        let brightest_w = photon.flux_w.max_channel();
        let Some(start) = start.filter(|_| brightest_w > 0.0 && photon.flux_w.is_finite()) else {
            return photon.leave_all(&mut arrive);
        };
        if self.rules.spectrum.is_some_and(PhotonSpectrum::starts_parted) {
            self.part(&mut photon);
        }
        let (mut ray, mut media) = (start.ray, start.media);
        for depth in 0.. {
            let Some(branch) = self.step(&mut photon, depth, &ray, &media, &mut arrive) else {
                return;
            };
            if depth >= self.rules.max_depth {
                return self.book(Account::Depth, &photon.hue.channels, photon.flux_w);
            }
            if !self.survives(&mut photon, ROULETTE_BELOW * brightest_w) {
                return;
            }
            (ray, media) = (branch.ray, branch.media);
        }
    }

    /// To the next surface, and the way on from there.
    fn step(
        &mut self,
        photon: &mut Photon<'a>,
        depth: u32,
        ray: &Ray,
        media: &MediumStack,
        arrive: &mut impl FnMut(Hit),
    ) -> Option<Branch> {
        self.segments += 1;
        let Some(hit) = photon.hue.tracer.closest_hit(ray) else {
            photon.leave_all(arrive);
            let account = if depth == 0 {
                Account::NotEmitted
            } else {
                Account::Escaped
            };
            self.book(account, &photon.hue.channels, photon.flux_w);
            return None;
        };
        let scene = photon.hue.tracer.scene();
        let material = scene.material_of(hit.object);
        if photon.is_straight && !material.surface.is_specular() {
            photon.leave_all(arrive);
            self.book(Account::NotEmitted, &photon.hue.channels, photon.flux_w);
            if depth > 0 {
                self.book(Account::Emitted, &photon.hue.channels, photon.flux_w * -1.0);
            }
            return None;
        }
        let effects = self.rules.effects;
        let (sent_w, sent_hue) = (photon.flux_w, photon.hue);
        if effects.absorption && media.absorbs(scene) {
            photon.flux_w = photon.flux_w * media.transmittance(scene, hit.distance_m);
        }
        if material.is_dispersive() {
            self.part(photon);
        }
        let micro = (effects.lobes && material.is_rough())
            .then(|| even_point(photon.index, LAMP_DIMENSION + 1 + depth, self.rules.seed));
        let tracer = photon.hue.tracer;
        let meeting = tracer.meet(effects, &hit, ray.direction, media, micro);
        let deposit_w = photon.flux_w * meeting.deposit;
        if photon.followed != 0 {
            photon.part_at(depth as usize, hit.object, &meeting, arrive);
        }
        if photon.is_straight {
            // What a surface takes on the first hit is direct light.
            self.book(Account::NotEmitted, &sent_hue.channels, deposit_w);
            let sent_w = if depth == 0 { sent_w } else { LinearSrgb::BLACK };
            self.book(Account::Emitted, &sent_hue.channels, sent_w - deposit_w);
        } else if deposit_w.max_channel() > 0.0 {
            arrive(Hit {
                receiver: Receiver::new(hit.object, Side::met(ray.direction, hit.geometric_normal)),
                place: PhotonArrival::Surface {
                    triangle: hit.triangle,
                    barycentric: hit.barycentric,
                },
                flux_w: self.apply(&photon.hue.channels, deposit_w),
                band: photon.hue.band,
            });
        }
        self.book(Account::Absorbed, &sent_hue.channels, sent_w - photon.flux_w);
        self.book(
            Account::Absorbed,
            &photon.hue.channels,
            photon.flux_w * meeting.absorbed,
        );
        self.book(
            Account::SwitchedOff,
            &photon.hue.channels,
            photon.flux_w * meeting.switched_off,
        );
        self.choose(photon, depth as usize, &meeting)
    }

    /// Gives a photon that has all wavelengths one of them.
    fn part(&mut self, photon: &mut Photon<'a>) {
        if photon.hue.band.is_some() {
            return;
        }
        if let Some(one) = photon.own_hue {
            self.book(Account::Sampling, &photon.hue.channels, photon.flux_w);
            self.book(Account::Sampling, &one.channels, photon.flux_w * -1.0);
            photon.hue = one;
        }
    }

    /// Draws the way on by the flux that goes there.
    fn choose(&mut self, photon: &mut Photon<'a>, depth: usize, meeting: &Meeting) -> Option<Branch> {
        let carried = |share: Option<LinearSrgb>| {
            let flux_w = share.map_or(LinearSrgb::BLACK, |share| photon.flux_w * share);
            (flux_w, flux_w.to_array().iter().sum::<f64>())
        };
        let (reflected_w, reflected) = carried(meeting.reflected);
        let (transmitted_w, transmitted) = carried(meeting.transmitted);
        let both = reflected + transmitted;
        if both <= 0.0 {
            return None;
        }
        let share = reflected / both;
        let is_reflected = share >= 1.0 || (share > 0.0 && photon.choice.falls_below(share));
        let probability = if is_reflected { share } else { 1.0 - share };
        let (branch, flux_w) = if is_reflected {
            (meeting.reflection()?, reflected_w * probability.recip())
        } else {
            (meeting.transmission()?, transmitted_w * probability.recip())
        };
        if photon.followed != 0 {
            photon.follow_only(depth, is_reflected, probability);
        }
        if !(flux_w.is_finite() && branch.ray.direction.is_finite() && branch.ray.origin.is_finite()) {
            let lost_w = (reflected_w + transmitted_w).map(|w| if w.is_finite() { w } else { 0.0 });
            self.book(Account::NonFinite, &photon.hue.channels, lost_w);
            return None;
        }
        self.book(
            Account::Sampling,
            &photon.hue.channels,
            reflected_w + transmitted_w - flux_w,
        );
        photon.flux_w = flux_w;
        photon.is_straight &= branch.event == Event::Passage;
        Some(branch)
    }

    /// Russian roulette with what has become too little to follow.
    fn survives(&mut self, photon: &mut Photon<'a>, least_w: f64) -> bool {
        let probability = photon.flux_w.max_channel() / least_w;
        if probability >= 1.0 {
            return true;
        }
        let survives = photon.choice.falls_below(probability);
        photon.probability *= probability;
        let (before_w, channels) = (photon.flux_w, photon.hue.channels);
        photon.flux_w = if survives {
            before_w * probability.recip()
        } else {
            LinearSrgb::BLACK
        };
        self.book(Account::Sampling, &channels, before_w - photon.flux_w);
        survives
    }
}

impl Photon<'_> {
    /// Parts from all bundles that it has followed.
    #[inline]
    fn leave_all(&mut self, arrive: &mut impl FnMut(Hit)) {
        if self.followed != 0 {
            self.leave_where(|_| true, arrive);
        }
    }

    /// Parts from some of the bundles that it has followed: their flux is removed where they say that it arrives.
    fn leave_where(&mut self, is_left: impl Fn(&Bundle) -> bool, arrive: &mut impl FnMut(Hit)) {
        let carried = self.carried;
        for (number, bundle) in carried.bundles.iter().enumerate() {
            let bit = 1 << number;
            if self.followed & bit != 0 && is_left(bundle) {
                self.followed &= !bit;
                let flux_w = bundle.flux_w() * (-carried.scale / self.probability);
                arrive(Hit {
                    receiver: bundle.receiver,
                    place: PhotonArrival::Map(bundle.place(&carried)),
                    flux_w: self.own_hue.map_or(flux_w, |hue| hue.channels.apply(flux_w)),
                    band: self.own_hue.and_then(|hue| hue.band),
                });
            }
        }
    }

    /// Parts from the bundles that end at a surface, have not met it, or go on from it where no light goes.
    fn part_at(&mut self, depth: usize, object: usize, meeting: &Meeting, arrive: &mut impl FnMut(Hit)) {
        let flux_w = self.flux_w;
        let goes =
            |share: Option<LinearSrgb>| share.is_some_and(|share| (flux_w * share).max_channel() > 0.0);
        let (is_reflected, is_transmitted) = (goes(meeting.reflected), goes(meeting.transmitted));
        let follows = |step: &Step| {
            let goes_on = if step.is_reflected {
                is_reflected
            } else {
                is_transmitted
            };
            step.object as usize == object && goes_on
        };
        self.leave_where(|bundle| !bundle.steps.get(depth).is_some_and(follows), arrive);
    }

    /// Was drawn to go one of two ways: bundles that go the other one are left to photons that do.
    fn follow_only(&mut self, depth: usize, is_reflected: bool, probability: f64) {
        for (number, bundle) in self.carried.bundles.iter().enumerate() {
            let step = bundle.steps.get(depth);
            if step.is_none_or(|step| step.is_reflected != is_reflected) {
                self.followed &= !(1 << number);
            }
        }
        self.probability *= probability;
    }
}

/// Part of the interval [0, 1) in which a choice has no certain digits left.
const MIN_WIDTH: f64 = 1e-7;

/// What makes all decisions of a photon: one number that is even among those of its neighbours. Within the part of the
/// interval that a decision took it is even again, and serves for the next one.
struct Choice {
    number: f64,
    /// How much of the first interval is left.
    width: f64,
    random: Random,
}

impl Choice {
    fn new(index: u32, seed: u64) -> Self {
        Self {
            number: even_number(index, seed),
            width: 1.0,
            random: Random::new(index, seed),
        }
    }

    /// Decides with a probability in (0, 1).
    fn falls_below(&mut self, probability: f64) -> bool {
        let is_below = self.number < probability;
        let (first, part) = if is_below {
            (0.0, probability)
        } else {
            (probability, 1.0 - probability)
        };
        self.number = (self.number - first) / part;
        self.width *= part;
        if self.width < MIN_WIDTH {
            (self.number, self.width) = (self.random.next(), 1.0);
        }
        is_below
    }
}

/// Numbers in [0, 1) that belong to one photon (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators",
/// 2014).
struct Random(u64);

impl Random {
    fn new(index: u32, seed: u64) -> Self {
        Self(seed.rotate_left(32) ^ u64::from(index).wrapping_mul(0xd134_2543_de82_ef95))
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * (-53_f64).exp2()
    }
}
