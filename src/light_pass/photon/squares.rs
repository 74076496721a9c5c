//! A quadtree over the launch domain: its squares, and the plan of how many photons start in each.
//!
//! Every square has nine points, whose light is followed along all paths. Each path is a bundle; what bundles get wrong
//! is left to photons, and how much that is decides how many photons start in a square.

use std::collections::HashMap;
use std::sync::Arc;

use super::bundle::{Bundle, Shape};
use super::domain::{DomainPoint, PointHash, SquarePlace};
use super::paths::{Chain, PointPaths};

/// A square is cut if that saves more segments than this many points take.
const CUT_COST: f64 = 30.0;

/// Number of photons that a square's plan counts for against photons that were traced.
const PLAN_PHOTONS: f64 = 4.0;

/// Minimum number of audits. With a fifth of it, bakes of random scenes to 20 % state a third of the error that is
/// visible, since few photons meet the light in dark places.
const MIN_AUDITS: f64 = 16384.0;

/// Where photons of the last level found a larger squared error than planned, there is light that points have missed:
/// the next one audits as many times as often, at most.
const MOST_AUDITED: f64 = 4.0;

/// Audits know no smaller part to arrive of the light that is looked at closely than this: of a receiver seen edge-on,
/// they would never end.
const LEAST_AUDITED: f64 = 0.01;

/// Squares beside an edge are audited four times as often, and at least for this goal: the corner of a receiver may
/// reach in between all their points, a thousandth of its light, or a caster may hide a sliver of itself. A few photons
/// would miss it, both halves would agree, and no error would tell.
const GOAL_BESIDE_EDGES: f64 = 0.02;

/// The light of points, each traced once.
pub(super) type Points = HashMap<DomainPoint, Arc<PointPaths>, PointHash>;

/// A way on which bundles leave light to photons.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guide {
    pub(super) chain: Chain,
    pub(super) weight: f64,
}

/// Roots of the variance of a photon that stands for the whole square, added up over paths. All but `lost` are weighted
/// by the texels that they fall into [W/m].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Residual {
    /// Of whole bundles.
    pub(super) displaced: f64,
    /// Of bundles that not all points have, if the square is cut, and if it is not.
    pub(super) cut: f64,
    pub(super) uncut: f64,
    /// Light that bundles do not follow [W].
    pub(super) lost_w: f64,
}

/// What photons of a square found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    pub(super) photons: f64,
    /// Sum over photons of the squared contribution of each, as if it stood for the whole square [W²/m²].
    pub(super) squares: f64,
    /// Variance of the mean of both halves, of the photons that these hold [W²/m²].
    pub(super) of_mean: f64,
}

impl Found {
    pub(super) fn variance(&self) -> f64 {
        if self.photons > 0.0 {
            self.squares / self.photons
        } else {
            0.0
        }
    }

    /// What half of the maps adds to the variance of the mean, if it holds these photons.
    pub(super) fn of_half(&self) -> f64 {
        0.25 * self.variance() / self.photons.max(1.0)
    }

    pub(super) fn of_quarter(&self) -> Self {
        Self {
            photons: 0.25 * self.photons,
            squares: self.squares / 64.0,
            of_mean: 0.0,
        }
    }
}

/// A square of the domain.
#[derive(Debug)]
pub(super) struct Square {
    pub(super) place: SquarePlace,
    pub(super) points: [Arc<PointPaths>; 9],
    /// Brightest first.
    pub(super) bundles: Vec<Bundle>,
    pub(super) guides: Vec<Guide>,
    /// Emitted flux [W, largest channel].
    pub(super) start_w: f64,
    /// Flux that arrives at the end of its bundles [W, largest channel].
    pub(super) arriving_w: f64,
    pub(super) residual: Residual,
    /// Mean segments of a photon.
    pub(super) segments: f64,
    /// Mean segments traced for a point.
    pub(super) traced: f64,
    pub(super) is_cut: bool,
    pub(super) is_finished: bool,
    pub(super) is_beside_edge: bool,
    pub(super) found: Found,
}

/// How many photons the squares need for a goal.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plan {
    /// Photons of a square per root of variance, times the root of segments [m/W].
    pub(super) per_root: f64,
    /// Weight of light without a known receiver [1/m].
    pub(super) lost_weight: f64,
    /// Number of texels of all receivers.
    pub(super) texels: f64,
    /// [`Squares::surprise`].
    pub(super) surprise: f64,
    /// All emitted flux, and that of squares that are looked at closely [W].
    pub(super) start_w: f64,
    pub(super) close_start_w: f64,
    /// Flux that arrives on maps [W, largest channel]: as photons found or, before any were traced, all that bundles
    /// carry or leave.
    pub(super) arriving_w: f64,
    /// Factor from squared errors [W²/m²] to squared relative errors of all maps.
    pub(super) relative: f64,
    /// Part of the light that bundles follow to its end; 0 if photons alone found any.
    pub(super) bundled_part: f64,
    /// Goal that the photons of this plan reach: the one asked for, or a larger one if that would take too many.
    pub(super) goal: f64,
}

impl Plan {
    /// Photons of a square, without audits.
    pub(super) fn photons_for(&self, root: f64, square: &Square) -> f64 {
        if root > 0.0 {
            self.per_root * root / square.segments.sqrt()
        } else {
            0.0
        }
    }

    pub(super) fn photons_for_variance(&self, variance: f64, square: &Square) -> f64 {
        self.photons_for(variance.sqrt(), square)
    }

    /// Photons of a square.
    pub(super) fn photons(&self, square: &Square) -> f64 {
        self.photons_for(square.root(self), square) + self.audits(square)
    }

    /// Photons of a square that look everywhere, enough for what is dim but seen. Where light is known to arrive, a
    /// single one that contradicts its bundle adds at most a quarter of the goal to the error.
    pub(super) fn audits(&self, square: &Square) -> f64 {
        let goal = if square.is_beside_edge {
            (0.25 * self.goal).min(GOAL_BESIDE_EDGES)
        } else {
            self.goal
        };
        let audits = 4.0 * self.surprise.clamp(1.0, MOST_AUDITED) * self.texels.sqrt() / goal;
        let everywhere = audits.max(MIN_AUDITS) * square.start_w / self.start_w.max(f64::MIN_POSITIVE);
        let lit = if square.is_looked_at_closely() {
            audits * square.start_w / self.arriving_w.max(LEAST_AUDITED * self.close_start_w)
        } else {
            0.0
        };
        everywhere.max(lit)
    }

    pub(super) fn is_worth_a_cut(&self, square: &Square) -> bool {
        let saved = square.residual.uncut - square.residual.cut;
        self.per_root * saved * square.segments.sqrt() > CUT_COST * square.traced
    }
}

impl Square {
    /// Root of the variance of a photon that stands for the whole square [W/m].
    pub(super) fn root(&self, plan: &Plan) -> f64 {
        let planned = self.planned_root(plan);
        let sum = PLAN_PHOTONS * planned * planned + self.found.squares;
        (sum / (PLAN_PHOTONS + self.found.photons)).sqrt()
    }

    fn planned_root(&self, plan: &Plan) -> f64 {
        let Residual {
            displaced,
            cut,
            uncut,
            lost_w,
        } = self.residual;
        let edges = if self.is_cut || plan.is_worth_a_cut(self) {
            cut
        } else {
            uncut
        };
        displaced + edges + lost_w * plan.lost_weight
    }

    /// Variance after photons were traced, which may be those of another half [W²/m²].
    pub(super) fn variance_with(&self, found: Found, plan: &Plan) -> f64 {
        let before = self.root(plan);
        (PLAN_PHOTONS * before * before + found.squares) / (PLAN_PHOTONS + found.photons)
    }

    /// Whether light is known to arrive, or may be overlooked.
    pub(super) fn is_looked_at_closely(&self) -> bool {
        self.arriving_w > 0.0 || self.is_beside_edge
    }

    /// Root of the variance that finer squares reduce [W/m].
    pub(super) fn dividable_root(&self, plan: &Plan) -> f64 {
        let lost = self.residual.lost_w * plan.lost_weight;
        (self.root(plan) - lost).max(0.0)
    }

    /// Leaves a bundle to photons.
    pub(super) fn give_up(&mut self, bundle: usize) {
        let bundle = &mut self.bundles[bundle];
        bundle.shape = Shape::Nothing;
        self.residual.lost_w += bundle.flux_w;
    }
}

/// The squares of one light.
#[derive(Debug, Default)]
pub(super) struct Squares {
    pub(super) squares: Vec<Square>,
    pub(super) points: Points,
    pub(super) plan: Plan,
    /// Photons of the last level.
    pub(super) photons: f64,
    /// Flux that arrived in the last level [W, largest channel].
    pub(super) arrived_w: Option<f64>,
    /// Squared error that photons of the last level found, relative to the planned one.
    pub(super) surprise: f64,
}
