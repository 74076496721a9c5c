//! Automatic exposure of the window: measured once there is light, then constant.

use std::time::Duration;

/// Limit of how far better maps of the same scene may move the exposure from the first measurement [stops].
const MAX_STOPS: f64 = 0.5;
/// A deviation from the first measurement above this means that the first maps were useless: the limit is lifted
/// [stops].
const MISTAKEN_STOPS: f64 = 2.0;
/// Smallest change of the goal that is worth redrawing the picture [stops].
const MIN_STOPS: f64 = 0.1;
/// Time constant of the exponential approach to the goal [s].
const PACE_S: f64 = 0.2;
/// Upper limit of the time step between two pictures.
const LONGEST_STEP: Duration = Duration::from_millis(100);
/// Distance from the goal at which the exposure snaps to it [stops].
const END_STOPS: f64 = 0.02;

/// Measures the exposure and moves it smoothly.
#[derive(Clone, Debug)]
pub struct AutoExposure {
    must_measure: bool,
    /// The first measurement on these maps [stops]; `None` before it.
    first: Option<f64>,
    /// Exposure that is approached [stops].
    goal: f64,
    /// Exposure that was set last [stops]. If the picture shows any other value, the user has changed it.
    set: f64,
}

impl AutoExposure {
    /// With `measures`, measures the first picture; otherwise leaves the exposure alone until [`ask`](Self::ask).
    pub fn new(measures: bool) -> Self {
        Self {
            must_measure: measures,
            first: None,
            goal: 0.0,
            set: 0.0,
        }
    }

    /// Measures the next picture and discards earlier measurements.
    pub fn ask(&mut self) {
        *self = Self::new(true);
    }

    /// Whether to measure a picture that shows light: the first one, and pictures of better maps unless the user has
    /// changed the exposure. `shown`: present exposure [stops].
    pub fn wants(&self, has_better_maps: bool, shown: f64) -> bool {
        self.must_measure || has_better_maps && self.is_own(shown)
    }

    fn is_own(&self, shown: f64) -> bool {
        self.first.is_some() && shown == self.set
    }

    /// Takes a measured exposure `suits`, of a picture drawn with exposure `shown`. Returns the exposure of the next
    /// picture [stops]. The first measurement is applied at once, later ones through [`next`](Self::next).
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

    /// Exposure of the next picture [stops], `since` after a picture with exposure `shown` [stops].
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

    /// Exposure that is approached [stops].
    pub fn goal(&self) -> f64 {
        self.goal
    }

    /// Whether the exposure has yet to reach its goal.
    pub fn is_moving(&self, shown: f64) -> bool {
        self.is_own(shown) && self.set != self.goal
    }
}
