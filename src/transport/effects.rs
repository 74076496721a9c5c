//! Which effects the paths of a light pass may need, as types: code that follows light is compiled for each set that a
//! plan can come to, and asks nothing on the way.

use std::fmt::Debug;
use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::Event;
use crate::plan::{Effect, EffectPlan};

/// A set of effects, known to the compiler.
pub trait PathEffects: Copy + Debug + Default + Send + Sync + 'static {
    /// Light goes through surfaces.
    const TRANSMISSION: bool;
    /// Surfaces send light back.
    const REFLECTION: bool;
    /// Bodies absorb light along the way.
    const ABSORPTION: bool;
    /// Textures tint what goes on from specular surfaces.
    const TEXTURES: bool;
    /// Rough surfaces spread what they send on.
    const LOBES: bool;
}

/// A set of effects by its members.
#[derive(Clone, Copy, Debug, Default)]
pub struct Specialised<
    const TRANSMISSION: bool,
    const REFLECTION: bool,
    const ABSORPTION: bool,
    const TEXTURES: bool,
    const LOBES: bool,
>;

impl<
    const TRANSMISSION: bool,
    const REFLECTION: bool,
    const ABSORPTION: bool,
    const TEXTURES: bool,
    const LOBES: bool,
> PathEffects for Specialised<TRANSMISSION, REFLECTION, ABSORPTION, TEXTURES, LOBES>
{
    const TRANSMISSION: bool = TRANSMISSION;
    const REFLECTION: bool = REFLECTION;
    const ABSORPTION: bool = ABSORPTION;
    const TEXTURES: bool = TEXTURES;
    const LOBES: bool = LOBES;
}

/// Every effect: code that is ready for any scene.
pub type Everything = Specialised<true, true, true, true, true>;

/// A set of effects, as a plan decides it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EffectSet {
    /// Light goes through surfaces.
    pub transmission: bool,
    /// Surfaces send light back.
    pub reflection: bool,
    /// Bodies absorb light along the way.
    pub absorption: bool,
    /// Textures tint what goes on from specular surfaces.
    pub textures: bool,
    /// Rough surfaces spread what they send on.
    pub lobes: bool,
    /// Normals are bent by what no mesh shows. Tracers know it, not the code: see [`super::Tracer::without_bumps`].
    pub bumps: bool,
}

/// Work that is compiled for each set of effects.
pub trait ForEffects {
    /// What it gives.
    type Output;

    /// Does it for one set.
    fn run<E: PathEffects>(self) -> Self::Output;
}

impl EffectSet {
    /// Every effect.
    pub const EVERYTHING: Self = Self {
        transmission: true,
        reflection: true,
        absorption: true,
        textures: true,
        lobes: true,
        bumps: true,
    };

    /// The effects that are on in a plan.
    pub fn of(plan: &EffectPlan) -> Self {
        Self {
            transmission: plan.is_on(Effect::Refraction),
            reflection: plan.is_on(Effect::Reflection),
            absorption: plan.is_on(Effect::Absorption),
            textures: plan.is_on(Effect::Textures),
            lobes: plan.is_on(Effect::Roughness),
            bumps: plan.is_on(Effect::Bumps),
        }
    }

    /// Runs the code that was compiled for this set.
    pub fn specialise<W: ForEffects>(self, work: W) -> W::Output {
        match (self.transmission, self.reflection) {
            (true, true) => self.with::<W, true, true>(work),
            (true, false) => self.with::<W, true, false>(work),
            (false, true) => self.with::<W, false, true>(work),
            (false, false) => self.with::<W, false, false>(work),
        }
    }

    fn with<W: ForEffects, const T: bool, const R: bool>(self, work: W) -> W::Output {
        match (self.absorption, self.textures) {
            (true, true) => self.with_lobes::<W, T, R, true, true>(work),
            (true, false) => self.with_lobes::<W, T, R, true, false>(work),
            (false, true) => self.with_lobes::<W, T, R, false, true>(work),
            (false, false) => self.with_lobes::<W, T, R, false, false>(work),
        }
    }

    fn with_lobes<W: ForEffects, const T: bool, const R: bool, const A: bool, const X: bool>(
        self,
        work: W,
    ) -> W::Output {
        if self.lobes {
            work.run::<Specialised<T, R, A, X, true>>()
        } else {
            work.run::<Specialised<T, R, A, X, false>>()
        }
    }
}

/// What paths did, by effect; counted where it is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathCounts {
    /// Segments that were searched after light went through a surface.
    pub transmitted: u64,
    /// Segments that were searched after a surface sent light back.
    pub reflected: u64,
    /// Segments whose light an absorbing body weakened.
    pub attenuated: u64,
    /// Textures looked up at specular surfaces.
    pub textured: u64,
    /// Specular surfaces met whose normals are bent.
    pub bent: u64,
    /// Micro-facets met on rough surfaces.
    pub scattered: u64,
    /// Light rays of one wavelength.
    pub of_a_wavelength: u64,
}

impl PathCounts {
    /// Counts a searched segment that an event began.
    pub fn count_segment(&mut self, event: Event) {
        if event.is_transmission() {
            self.transmitted += 1;
        } else {
            self.reflected += 1;
        }
    }
}

impl AddAssign for PathCounts {
    fn add_assign(&mut self, other: Self) {
        self.transmitted += other.transmitted;
        self.reflected += other.reflected;
        self.attenuated += other.attenuated;
        self.textured += other.textured;
        self.bent += other.bent;
        self.scattered += other.scattered;
        self.of_a_wavelength += other.of_a_wavelength;
    }
}
