//! The energy ledger: emitted = deposited + absorbed + escaped + truncated, for each light.

use std::iter::Sum;
use std::ops::AddAssign;

use serde::{Serialize, Serializer};

/// What was given up, by cause [W, luminous-equivalent].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Truncated {
    /// Paths longer than the depth limit.
    pub depth: f64,
    /// Branches below the threshold.
    pub threshold: f64,
    /// Paths that met a number that is not finite.
    pub non_finite: f64,
    /// Light that no deposit could place.
    pub unresolved: f64,
    /// What separate refinement left open.
    pub quadrature: f64,
    /// Light of effects that the user switched off.
    pub switched_off: f64,
}

impl Truncated {
    /// Over all causes [W].
    pub fn total(&self) -> f64 {
        self.depth + self.threshold + self.non_finite + self.unresolved + self.quadrature + self.switched_off
    }
}

/// Accounts of the caustic layer [W, luminous-equivalent]; each is summed on its own, none is a remainder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EnergyLedger {
    /// Flux whose first hit is a specular surface.
    pub emitted: f64,
    /// Flux incident on diffuse surfaces, before their albedo.
    pub deposited: f64,
    /// Taken by metals, tints, volumes.
    pub absorbed: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Given up by us; also told as a sum.
    #[serde(flatten, serialize_with = "with_total")]
    pub truncated: Truncated,
    /// What is conserved only in expectation, of either sign: photons that chance ended less what it gave to others.
    pub sampling: f64,
}

fn with_total<S: Serializer>(by_cause: &Truncated, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct LedgerText {
        truncated: f64,
        truncated_by_cause: Truncated,
    }
    let told = LedgerText {
        truncated: by_cause.total(),
        truncated_by_cause: *by_cause,
    };
    told.serialize(serializer)
}

impl AddAssign for Truncated {
    fn add_assign(&mut self, other: Self) {
        self.depth += other.depth;
        self.threshold += other.threshold;
        self.non_finite += other.non_finite;
        self.unresolved += other.unresolved;
        self.quadrature += other.quadrature;
        self.switched_off += other.switched_off;
    }
}

impl AddAssign for EnergyLedger {
    fn add_assign(&mut self, other: Self) {
        self.emitted += other.emitted;
        self.deposited += other.deposited;
        self.absorbed += other.absorbed;
        self.escaped += other.escaped;
        self.truncated += other.truncated;
        self.sampling += other.sampling;
    }
}

impl<'a> Sum<&'a EnergyLedger> for EnergyLedger {
    fn sum<I: Iterator<Item = &'a Self>>(ledgers: I) -> Self {
        ledgers.fold(Self::default(), |mut sum, ledger| {
            sum += *ledger;
            sum
        })
    }
}

impl EnergyLedger {
    /// |emitted − Σ| / emitted; 0 where nothing was emitted.
    pub fn relative_imbalance(&self) -> f64 {
        if self.emitted == 0.0 {
            return 0.0;
        }
        let sum = self.deposited + self.absorbed + self.escaped + self.truncated.total() + self.sampling;
        (self.emitted - sum).abs() / self.emitted
    }
}

/// What carried the light that diffuse surfaces got [W].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CarriedFlux {
    /// Patches of the wavefront.
    pub patches: f64,
    /// Bundles, which photons correct.
    pub bundles: f64,
    /// Photons, less what they took away from bundles: of either sign.
    pub photons: f64,
    /// The paper's kernels.
    pub splats: f64,
}

impl CarriedFlux {
    /// Of all lights.
    pub fn sum(ledgers: &[LightLedger]) -> Self {
        let sum = |part: fn(&Self) -> f64| ledgers.iter().map(|light| part(&light.carried_w)).sum();
        Self {
            patches: sum(|carried| carried.patches),
            bundles: sum(|carried| carried.bundles),
            photons: sum(|carried| carried.photons),
            splats: sum(|carried| carried.splats),
        }
    }

    /// "bundles 82.0 %, photons 18.0 %" of what was deposited [W]; `None` where nothing was.
    pub fn in_words(&self, deposited_w: f64) -> Option<String> {
        let parts = [
            ("patches", self.patches),
            ("bundles", self.bundles),
            ("photons", self.photons),
            ("splats", self.splats),
        ];
        let carried = parts.iter().filter(|(_, watts)| *watts != 0.0);
        let words: Vec<String> = carried
            .map(|(what, watts)| format!("{what} {:.1} %", 100.0 * watts / deposited_w))
            .collect();
        (!words.is_empty()).then(|| words.join(", "))
    }
}

/// The ledger of one light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightLedger {
    /// The light's name.
    pub light: String,
    /// Its accounts.
    pub energy_w: EnergyLedger,
    /// What was deposited, by what carried it.
    pub carried_w: CarriedFlux,
    /// Flux of launched rays whose first hit was not specular [W].
    pub not_emitted_w: f64,
    /// What was emitted, as radiant flux [W]; `None` of light that is not traced by wavelength.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emitted_radiant_w: Option<f64>,
    /// What was deposited, as radiant flux [W]; `None` where the bands of the spectrum are not kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deposited_radiant_w: Option<f64>,
}

impl LightLedger {
    /// With radiant flux: that of the light over its luminous-equivalent watts, and what its bands deposited [W].
    #[must_use]
    pub fn with_radiant(self, radiant: Option<f64>, deposited_radiant_w: Option<f64>) -> Self {
        Self {
            emitted_radiant_w: radiant.map(|radiant| radiant * self.energy_w.emitted),
            deposited_radiant_w,
            ..self
        }
    }
}
