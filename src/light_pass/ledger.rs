//! The energy ledger: emitted = deposited + absorbed + escaped + truncated, for each light.

use std::iter::Sum;
use std::ops::AddAssign;

use serde::{Serialize, Serializer};

/// Flux that was given up, by cause [W, luminous-equivalent].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Truncated {
    /// Paths longer than the depth limit.
    pub depth: f64,
    /// Branches below the threshold.
    pub threshold: f64,
    /// Paths that met a non-finite number.
    pub non_finite: f64,
    /// Flux that no deposit could place.
    pub unresolved: f64,
    /// Flux of effects that the user switched off.
    pub switched_off: f64,
}

impl Truncated {
    pub fn total(&self) -> f64 {
        self.depth + self.threshold + self.non_finite + self.unresolved + self.switched_off
    }
}

/// Accounts of the caustic layer [W, luminous-equivalent]. Each is summed on its own; none is a remainder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct EnergyLedger {
    /// Flux whose first hit is a specular surface.
    pub emitted: f64,
    /// Flux incident on diffuse surfaces, before their albedo.
    pub deposited: f64,
    /// Absorbed by metals, tints and volumes.
    pub absorbed: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Given up; serialised by cause and as a sum.
    #[serde(flatten, serialize_with = "with_total")]
    pub truncated: Truncated,
    /// Flux conserved only in expectation, of either sign: lost with photons that were ended at random, less gained by
    /// those that go on.
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
    /// |emitted − Σ| / emitted; 0 if nothing was emitted.
    pub fn relative_imbalance(&self) -> f64 {
        if self.emitted == 0.0 {
            return 0.0;
        }
        let sum = self.deposited + self.absorbed + self.escaped + self.truncated.total() + self.sampling;
        (self.emitted - sum).abs() / self.emitted
    }
}

/// Deposited flux, by what carried it [W].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CarriedFlux {
    /// Bundles, before photons correct them.
    pub bundles: f64,
    /// Photons, less the flux of bundles that they removed; of either sign.
    pub photons: f64,
    /// The paper's kernels.
    pub splats: f64,
}

impl CarriedFlux {
    /// Sum over lights.
    pub fn sum(ledgers: &[LightLedger]) -> Self {
        let sum = |part: fn(&Self) -> f64| ledgers.iter().map(|light| part(&light.carried_w)).sum();
        Self {
            bundles: sum(|carried| carried.bundles),
            photons: sum(|carried| carried.photons),
            splats: sum(|carried| carried.splats),
        }
    }

    /// Text such as "bundles 82.0 %, photons 18.0 %", of the deposited flux; `None` if nothing was carried.
    pub fn in_words(&self, deposited_w: f64) -> Option<String> {
        let parts = [
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
    pub light: String,
    pub energy_w: EnergyLedger,
    /// Deposited flux, by what carried it.
    pub carried_w: CarriedFlux,
    /// Flux of launched rays whose first hit was not specular [W].
    pub not_emitted_w: f64,
    /// Emitted radiant flux [W]; `None` for light that is not traced by wavelength.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emitted_radiant_w: Option<f64>,
    /// Deposited radiant flux [W]; `None` unless the bands of the spectrum are kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deposited_radiant_w: Option<f64>,
}

impl LightLedger {
    /// Adds radiant flux. `radiant`: the light's radiant over its luminous-equivalent watts; `deposited_radiant_w`:
    /// what its bands deposited [W].
    #[must_use]
    pub fn with_radiant(self, radiant: Option<f64>, deposited_radiant_w: Option<f64>) -> Self {
        Self {
            emitted_radiant_w: radiant.map(|radiant| radiant * self.energy_w.emitted),
            deposited_radiant_w,
            ..self
        }
    }
}
