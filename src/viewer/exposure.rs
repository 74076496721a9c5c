//! The exposure that the window chooses by itself: measured when there is light, then steady.

use std::time::Duration;

/// Most that better maps of the same scene move it [stops].
const MAX_STOPS: f64 = 0.5;
/// Beyond this, the first maps said nothing of the light that there is [stops].
const MISTAKEN_STOPS: f64 = 2.0;
/// Less than this is not worth another picture [stops].
const MIN_STOPS: f64 = 0.1;
/// By then, all but 1/e of a move is made [s].
const PACE_S: f64 = 0.2;
/// One picture makes no more of a move than that of so long.
const LONGEST_STEP: Duration = Duration::from_millis(100);
/// What is left of a move when it ends [stops].
const END_STOPS: f64 = 0.02;

/// Chooses exposures.
#[derive(Clone, Debug)]
pub struct AutoExposure {
    must_measure: bool,
    /// The first that suited these maps [stops].
    first: Option<f64>,
    /// Where it goes [stops].
    goal: f64,
    /// As it was set last [stops]: another value is somebody else's.
    set: f64,
}

impl AutoExposure {
    /// Measures the first picture, or leaves the exposure alone until it is asked to.
    pub fn new(measures: bool) -> Self {
        Self {
            must_measure: measures,
            first: None,
            goal: 0.0,
            set: 0.0,
        }
    }

    /// Measures the next picture, whatever was chosen before.
    pub fn ask(&mut self) {
        *self = Self::new(true);
    }

    /// Whether a picture with light is to be measured: the first one, and those of better maps while the exposure is
    /// as it was chosen here. `shown`: the present one [stops].
    pub fn wants(&self, has_better_maps: bool, shown: f64) -> bool {
        self.must_measure || has_better_maps && self.is_own(shown)
    }

    fn is_own(&self, shown: f64) -> bool {
        self.first.is_some() && shown == self.set
    }

    /// Takes up what suits a picture that was shown with an exposure; returns that of the next one [stops]. The first is
    /// shown at once.
    pub fn take(&mut self, suits: f64, shown: f64) -> f64 {
        let Some(first) = self.first else {
            *self = Self {
                must_measure: false,
                first: Some(suits),
                goal: suits,
                set: suits,
            };
            return suits;
        };
        let goal = if (suits - first).abs() > MISTAKEN_STOPS {
            suits
        } else {
            suits.clamp(first - MAX_STOPS, first + MAX_STOPS)
        };
        if (goal - self.goal).abs() > MIN_STOPS {
            self.goal = goal;
        }
        shown
    }

    /// The exposure [stops] so long after a picture with another one.
    pub fn next(&mut self, shown: f64, since: Duration) -> f64 {
        if !self.is_own(shown) {
            return shown;
        }
        let since_s = since.min(LONGEST_STEP).as_secs_f64();
        let left = (self.goal - self.set) * (-since_s / PACE_S).exp();
        self.set = if left.abs() < END_STOPS {
            self.goal
        } else {
            self.goal - left
        };
        self.set
    }

    /// Where it goes [stops].
    pub fn goal(&self) -> f64 {
        self.goal
    }

    /// Whether it is on its way.
    pub fn is_moving(&self, shown: f64) -> bool {
        self.is_own(shown) && self.set != self.goal
    }
}
