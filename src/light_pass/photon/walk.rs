//! The path of one photon: at every surface one branch, drawn in proportion to its share of the light.

use glam::DVec2;

use super::bundle::{Bundle, Origin};
use super::launch::{LAMP_DIMENSION, Start};
use super::paths::{Chain, ChainStep};
use super::spectrum::{Hue, PhotonSpectrum};
use super::squares::Guide;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_SLOT;
use crate::geometry::sampling::{GOLDEN_64, even_number, even_point, mix64};
use crate::illumination::accumulator::FluxUnit;
use crate::illumination::{Receiver, Side};
use crate::light_pass::ledger_sum::{Account, LedgerSum};
use crate::optics::{ColourMatrix, LinearSrgb};
use crate::transport::{Branch, EffectSet, Event, MediumStack, Meeting, Tracer};

/// Fraction of its initial flux (largest channel) below which a photon plays Russian roulette. Survivors return to this
/// fraction.
const ROULETTE_BELOW: f64 = 0.1;

/// The same for photons with guides, which choose faint branches on purpose.
const GUIDED_ROULETTE_BELOW: f64 = 1e-3;

/// Part of a choice that is left to the shares of flux; guides decide the rest. Weights are at most its reciprocal.
const UNGUIDED: f64 = 0.5;

/// Dimension of [`even_point`] from which wavelengths are drawn.
pub(super) const WAVELENGTH_DIMENSION: u32 = 1 << 16;

/// Flux that a photon deposits on a diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub receiver: Receiver,
    pub place: PhotonArrival,
    /// Incident flux before the albedo, as if it were the only photon [W per channel of the light].
    pub flux_w: LinearSrgb,
    /// `None` for all wavelengths.
    pub band: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
pub enum PhotonArrival {
    Surface {
        /// Index within the object's mesh.
        triangle: usize,
        barycentric: [f64; 3],
    },
    /// Where the flux of a bundle is removed.
    Map {
        /// [texels].
        place: DVec2,
        /// Index among the bundles that the photon follows.
        bundle: usize,
    },
}

/// Bundles that a photon follows, and ways that it is led along.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Followed<'a> {
    pub(super) bundles: &'a [Bundle],
    /// One bit for each bundle that exists where the photon starts.
    pub(super) mask: u64,
    pub(super) guides: &'a [Guide],
    /// Where the photon starts in its square.
    pub(super) within: DVec2,
    /// Unit squares of the launch domain that the photon stands for.
    pub(super) scale: f64,
    /// Where it starts on the lamp, in half-axes from its centre.
    pub(super) lamp: DVec2,
}

/// What all photons of a light share.
#[derive(Clone, Copy, Debug)]
pub struct PhotonRules<'a> {
    pub tracer: &'a Tracer,
    /// Of dispersed light.
    pub spectrum: Option<&'a PhotonSpectrum>,
    pub effects: EffectSet,
    /// Maximum number of specular events on a path.
    pub max_depth: u32,
    /// Unit of the ledger's counts, for flux as if each photon were the only one.
    pub unit: FluxUnit,
    pub seed: u64,
}

impl<'a> PhotonRules<'a> {
    /// All wavelengths together.
    pub(super) fn whole_hue(&self) -> Hue<'a> {
        match self.spectrum {
            Some(spectrum) => spectrum.whole(),
            None => Hue {
                tracer: self.tracer,
                channels: ColourMatrix::IDENTITY,
                band: None,
                ends: [0.0; 2],
            },
        }
    }
}

/// Traces photons one after the other and books their flux.
#[derive(Debug)]
pub struct PhotonWalk<'a> {
    rules: PhotonRules<'a>,
    pub ledger: LedgerSum,
    /// Rays traced so far.
    pub segments: u64,
}

/// A straight part of a photon's path.
struct Leg {
    ray: Ray,
    media: MediumStack,
    /// Slot of the triangle that it leaves. All tracers of a light have the same hierarchy.
    left: u32,
}

/// The photon that is being traced.
struct Photon<'b> {
    hue: &'b Hue<'b>,
    /// All wavelengths.
    whole_hue: &'b Hue<'b>,
    /// Its single wavelength, once the light is dispersed.
    own_hue: Option<&'b Hue<'b>>,
    flux_w: LinearSrgb,
    index: u32,
    choice: Choice,
    followed: Followed<'b>,
    /// Bit mask of the guides that it has followed so far.
    guided: u64,
    /// Probability of its random choices so far.
    probability: f64,
    /// Whether it is still direct light.
    is_straight: bool,
}

impl<'a> PhotonWalk<'a> {
    pub fn new(rules: PhotonRules<'a>) -> Self {
        Self {
            rules,
            ledger: LedgerSum::default(),
            segments: 0,
        }
    }

    pub(super) fn seed(&self) -> u64 {
        self.rules.seed
    }

    #[inline]
    fn book(&mut self, account: Account, channels: &ColourMatrix, flux_w: LinearSrgb) {
        if flux_w != LinearSrgb::BLACK {
            let count = self.rules.unit.count(self.apply(channels, flux_w));
            self.ledger.book(account, count);
        }
    }

    /// Converts flux to the channels of the light.
    fn apply(&self, channels: &ColourMatrix, flux_w: LinearSrgb) -> LinearSrgb {
        match self.rules.spectrum {
            Some(_) => channels.apply(flux_w),
            None => flux_w,
        }
    }

    /// Traces the photon of an index to its end; without a `start` it only removes its bundles' flux. Hits on diffuse
    /// surfaces after at least one specular event go to `arrive`. Whoever places their flux books it as `Deposited`.
    pub(super) fn follow(
        &mut self,
        index: u32,
        start: Option<Start>,
        followed: Followed<'_>,
        mut arrive: impl FnMut(Hit),
    ) {
        // The wavelength is drawn in advance: dispersed bundles that the photon leaves on its way are removed at it
        // too.
        let whole_hue = self.rules.whole_hue();
        let own_hue = self.rules.spectrum.and_then(|spectrum| {
            let place = even_point(index, WAVELENGTH_DIMENSION, self.rules.seed).x;
            spectrum.one(place)
        });
        let mut photon = Photon {
            hue: &whole_hue,
            whole_hue: &whole_hue,
            own_hue: own_hue.as_ref(),
            flux_w: start.map_or(LinearSrgb::BLACK, |start| start.flux_w),
            choice: Choice::new(index, self.rules.seed),
            index,
            followed,
            guided: match followed.guides.len() as u32 {
                0 => 0,
                guides => u64::MAX >> (u64::BITS - guides),
            },
            probability: 1.0,
            is_straight: true,
        };

        // Where no light starts, bundles may predict some nonetheless, and all of it is removed.
        let brightest_w = photon.flux_w.max_channel();
        let Some(start) = start.filter(|_| brightest_w > 0.0 && photon.flux_w.is_finite()) else {
            return photon.leave_all(&mut arrive);
        };

        // Separate maps for each band need single wavelengths from the start: all that is booked is of this hue.
        if self.rules.spectrum.is_some_and(PhotonSpectrum::starts_parted) {
            photon.hue = photon.own_hue.unwrap_or(photon.hue);
        }

        // Guides lead into faint branches on purpose; early roulette would undo that.
        let roulette_below = if followed.guides.is_empty() {
            ROULETTE_BELOW
        } else {
            GUIDED_ROULETTE_BELOW
        };

        // The path ends where nothing goes on, at the depth limit, or by roulette.
        let mut leg = Leg {
            ray: start.ray,
            media: start.media,
            left: NO_SLOT,
        };
        for depth in 0.. {
            let Some(next) = self.step(&mut photon, depth, &leg, &mut arrive) else {
                return;
            };
            if depth >= self.rules.max_depth {
                return self.book(Account::Depth, &photon.hue.channels, photon.flux_w);
            }
            if !self.survives(&mut photon, roulette_below * brightest_w) {
                return;
            }
            leg = next;
        }
    }

    /// Traces to the next surface and returns the leg that is followed from there; `None` at the end of the path.
    #[inline(always)]
    fn step(
        &mut self,
        photon: &mut Photon,
        depth: u32,
        Leg { ray, media, left }: &Leg,
        arrive: &mut impl FnMut(Hit),
    ) -> Option<Leg> {
        // Light that leaves the scene arrives nowhere: all that bundles predict for it is removed.
        self.segments += 1;
        let Some(hit) = photon.hue.tracer.next_hit(ray, *left) else {
            photon.leave_all(arrive);
            let account = if depth == 0 {
                Account::NotEmitted
            } else {
                Account::Escaped
            };
            self.book(account, &photon.hue.channels, photon.flux_w);
            return None;
        };

        // Light that meets a diffuse surface first is direct light, which is another layer's. If it came through holes,
        // it was booked as emitted there, which is taken back.
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

        // The medium absorbs along the leg (Beer–Lambert); a dispersive surface leaves a single wavelength.
        let effects = self.rules.effects;
        let (sent_w, sent_hue) = (photon.flux_w, photon.hue);
        if effects.absorption && media.absorbs(scene) {
            photon.flux_w = photon.flux_w * media.transmittance(scene, hit.distance_m);
        }
        if material.is_dispersive() {
            self.part(photon);
        }

        // A rough surface shows one microfacet, from dimensions of its own at each depth.
        let micro = (effects.lobes && material.is_rough())
            .then(|| even_point(photon.index, LAMP_DIMENSION + 1 + depth, self.rules.seed));
        let tracer = photon.hue.tracer;
        let mut meeting = Meeting::new(&hit, ray.direction, media);
        tracer.meet(effects, micro, &mut meeting);

        // Bundles that end here or go elsewhere are left before the photon arrives: near predictions can be moved
        // there.
        let deposit_w = photon.flux_w * meeting.deposit;
        if photon.followed.mask != 0 {
            photon.leave_at(depth as usize, hit.object, &meeting, arrive);
        }

        // The diffuse part of a surface takes its share, and the rest goes on.
        if photon.is_straight {
            // Before any specular event, deposits are direct light.
            if depth == 0 {
                self.book(Account::Emitted, &sent_hue.channels, sent_w);
            }
            self.book(Account::Emitted, &photon.hue.channels, deposit_w * -1.0);
            self.book(Account::NotEmitted, &photon.hue.channels, deposit_w);
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

        // What the medium took is booked in the hue that was sent, what the surface takes in the hue that is left.
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

        // One of the branches goes on, drawn at random.
        let (ray, media) = self.choose(photon, (depth as usize, hit.object), &meeting)?;
        let left = hit.slot;
        Some(Leg { ray, media, left })
    }

    /// Reduces a photon of all wavelengths to its own one.
    fn part(&mut self, photon: &mut Photon) {
        if photon.hue.band.is_some() {
            return;
        }
        if let Some(one) = photon.own_hue {
            self.book(Account::Sampling, &photon.hue.channels, photon.flux_w);
            self.book(Account::Sampling, &one.channels, photon.flux_w * -1.0);
            photon.hue = one;
        }
    }

    /// Draws reflection or transmission at an object, in proportion to flux and towards guides; `None` if neither
    /// carries any.
    #[inline(always)]
    fn choose(
        &mut self,
        photon: &mut Photon,
        (depth, object): (usize, usize),
        meeting: &Meeting,
    ) -> Option<(Ray, MediumStack)> {
        // Branches are weighed by their flux, summed over the channels.
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

        // Guides make ways more probable on which bundles leave light; dividing by the probability keeps the mean.
        let share = photon.guided_share(depth, object, reflected / both);
        let is_reflected = share >= 1.0 || (share > 0.0 && photon.choice.falls_below(share));
        let probability = if is_reflected { share } else { 1.0 - share };
        let (share_w, branch) = if is_reflected {
            (reflected_w, meeting.reflection()?)
        } else {
            (transmitted_w, meeting.transmission()?)
        };
        let flux_w = share_w * probability.recip();
        let Branch {
            ray, media, event, ..
        } = branch;

        // Bundles of the other branch are dropped, not removed: photons that take it remove them, divided by its
        // probability.
        if photon.followed.mask != 0 {
            photon.follow_only(depth, is_reflected, probability);
        }
        if photon.guided != 0 {
            photon.follow_guides(depth, object, is_reflected);
        }

        // Numbers that are not finite would spoil every sum: the path ends, and its light is booked.
        if !(flux_w.is_finite() && ray.direction.is_finite() && ray.origin.is_finite()) {
            let lost_w = (reflected_w + transmitted_w).map(|w| if w.is_finite() { w } else { 0.0 });
            self.book(Account::NonFinite, &photon.hue.channels, lost_w);
            return None;
        }

        // A random choice conserves flux in the mean alone.
        self.book(
            Account::Sampling,
            &photon.hue.channels,
            reflected_w + transmitted_w - flux_w,
        );
        photon.flux_w = flux_w;
        photon.is_straight &= event == Event::Passage;
        Some((ray, media))
    }

    /// Russian roulette for photons of little flux.
    #[inline]
    fn survives(&mut self, photon: &mut Photon, least_w: f64) -> bool {
        let probability = photon.flux_w.max_channel() / least_w;
        if probability >= 1.0 {
            return true;
        }
        let survives = photon.choice.falls_below(probability);
        photon.probability *= probability;
        let before_w = photon.flux_w;
        photon.flux_w = if survives {
            before_w * probability.recip()
        } else {
            LinearSrgb::BLACK
        };
        self.book(Account::Sampling, &photon.hue.channels, before_w - photon.flux_w);
        survives
    }
}

impl Photon<'_> {
    /// Separates the photon from all bundles that it has followed.
    #[inline]
    fn leave_all(&mut self, arrive: &mut impl FnMut(Hit)) {
        if self.followed.mask != 0 {
            self.leave_where(|_| true, arrive);
        }
    }

    /// Separates the photon from some of the bundles that it has followed: their flux is removed at their predicted
    /// arrival.
    fn leave_where(&mut self, is_left: impl Fn(&Chain) -> bool, arrive: &mut impl FnMut(Hit)) {
        let followed = self.followed;
        for (number, bundle) in followed.bundles.iter().enumerate() {
            // Each bundle is left once.
            let bit = 1 << number;
            if self.followed.mask & bit == 0 || !is_left(&bundle.route.chain) {
                continue;
            }
            self.followed.mask &= !bit;
            // Light that no surface disperses stays whole.
            let hue = self
                .own_hue
                .filter(|_| bundle.route.is_dispersed)
                .unwrap_or(self.whole_hue);

            // The prediction is for the photon's own point of the lamp and wavelength, so that only what is wrong with
            // it differs.
            let origin = Origin {
                lamp: followed.lamp,
                ends: hue.ends,
            };
            let Some(predicted) = bundle.at(followed.within, &origin) else {
                continue;
            };

            // Photons that chose otherwise do not remove it: those that are still here do so in their stead.
            let flux_w = predicted.flux_w * (-followed.scale / self.probability);
            arrive(Hit {
                receiver: bundle.receiver(),
                place: PhotonArrival::Map {
                    place: predicted.place,
                    bundle: number,
                },
                flux_w: if self.own_hue.is_some() {
                    hue.channels.apply(flux_w)
                } else {
                    flux_w
                },
                band: hue.band,
            });
        }
    }

    /// Separates the photon from bundles that end here, miss this surface, or go on from it where no light goes.
    fn leave_at(&mut self, depth: usize, object: usize, meeting: &Meeting, arrive: &mut impl FnMut(Hit)) {
        let flux_w = self.flux_w;
        let goes =
            |share: Option<LinearSrgb>| share.is_some_and(|share| (flux_w * share).max_channel() > 0.0);
        let (is_reflected, is_transmitted) = (goes(meeting.reflected), goes(meeting.transmitted));
        let follows = |step: ChainStep| {
            let goes_on = if step.is_reflected {
                is_reflected
            } else {
                is_transmitted
            };
            step.object as usize == object && goes_on
        };
        self.leave_where(|chain| !chain.step(depth).is_some_and(follows), arrive);
    }

    /// Drops the bundles that took the other outcome of a random choice: photons with that outcome remove their flux.
    fn follow_only(&mut self, depth: usize, is_reflected: bool, probability: f64) {
        for (number, bundle) in self.followed.bundles.iter().enumerate() {
            let step = bundle.route.chain.step(depth);
            if step.is_none_or(|step| step.is_reflected != is_reflected) {
                self.followed.mask &= !(1 << number);
            }
        }
        self.probability *= probability;
    }

    /// Probability of reflection where it carries this share of the flux: higher towards ways on which bundles leave
    /// light.
    fn guided_share(&self, depth: usize, object: usize, share: f64) -> f64 {
        if self.guided == 0 || share <= 0.0 || share >= 1.0 {
            return share;
        }
        let mut weights = [0.0; 2];
        for (number, guide) in self.followed.guides.iter().enumerate() {
            if self.guided >> number & 1 != 0
                && let Some(step) = guide.chain.step(depth)
                && step.object as usize == object
            {
                weights[usize::from(step.is_reflected)] += guide.weight;
            }
        }
        let sum = weights[0] + weights[1];
        if sum > 0.0 {
            UNGUIDED * share + (1.0 - UNGUIDED) * weights[1] / sum
        } else {
            share
        }
    }

    /// Drops the guides that go another way.
    fn follow_guides(&mut self, depth: usize, object: usize, is_reflected: bool) {
        let taken = ChainStep {
            object: object as u32,
            is_reflected,
        };
        for (number, guide) in self.followed.guides.iter().enumerate() {
            if guide.chain.step(depth) != Some(taken) {
                self.guided &= !(1 << number);
            }
        }
    }
}

/// Width of the interval below which a choice has too few significant digits left.
const MIN_WIDTH: f64 = 1e-7;

/// Makes all decisions of a photon from one low-discrepancy number. Within the part of the interval that a decision
/// selects, the number is uniform again and serves the next decision.
struct Choice {
    number: f64,
    /// Width of the remaining part of the first interval.
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

    /// True with a probability in (0, 1).
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

/// Random numbers in [0, 1) of one photon (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators",
/// 2014).
struct Random(u64);

impl Random {
    fn new(index: u32, seed: u64) -> Self {
        Self(seed.rotate_left(32) ^ u64::from(index).wrapping_mul(0xd134_2543_de82_ef95))
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(GOLDEN_64);
        (mix64(self.0) >> 11) as f64 * (-53_f64).exp2()
    }
}
