//! Every watt accounted for.

use serde::{Deserialize, Serialize};

/// What was given up, by cause [W, luminous-equivalent].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
}

impl Truncated {
    /// Over all causes [W].
    pub fn total(&self) -> f64 {
        self.depth + self.threshold + self.non_finite + self.unresolved + self.quadrature
    }
}

/// Accounts of the caustic layer [W, luminous-equivalent]; each is summed on its own, none is a remainder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EnergyLedger {
    /// Flux whose first hit is a specular surface.
    pub emitted: f64,
    /// Flux incident on diffuse surfaces, before their albedo.
    pub deposited: f64,
    /// Taken by metals, tints, volumes.
    pub absorbed: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Given up by us.
    pub truncated: Truncated,
}

impl EnergyLedger {
    /// |emitted − Σ| / emitted; 0 where nothing was emitted.
    pub fn relative_imbalance(&self) -> f64 {
        if self.emitted == 0.0 {
            return 0.0;
        }
        let sum = self.deposited + self.absorbed + self.escaped + self.truncated.total();
        (self.emitted - sum).abs() / self.emitted
    }
}

/// The ledger of one light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightLedger {
    /// The light's name.
    pub light: String,
    /// Its accounts.
    pub energy_w: EnergyLedger,
    /// Flux of launched rays whose first hit was not specular [W].
    pub not_emitted_w: f64,
}
