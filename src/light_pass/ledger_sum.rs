//! Accumulates the ledger: exact integer counts per channel and account.

use super::ledger::{CarriedFlux, EnergyLedger, LightLedger, Truncated};
use crate::illumination::accumulator::{FluxCount, FluxUnit};
use crate::optics::LinearSrgb;

/// What becomes of flux.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Account {
    /// First hit was specular.
    Emitted,
    /// First hit was not specular.
    NotEmitted,
    /// Reached a diffuse surface.
    Deposited,
    /// Became heat.
    Absorbed,
    /// Left the scene.
    Escaped,
    /// Beyond the depth limit.
    Depth,
    /// Below the branch threshold.
    Threshold,
    /// Met a non-finite number.
    NonFinite,
    /// No deposit could place it.
    Unresolved,
    /// Of an effect that is switched off.
    SwitchedOff,
    /// Conserved in expectation only: lost in random choices less gained, of either sign.
    Sampling,
    /// Deposited by bundles. The other accounts already contain it.
    Bundled,
}

const ACCOUNTS: usize = Account::Bundled as usize + 1;

/// Exact sums of all accounts of one light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LedgerSum {
    counts: [[i128; 3]; ACCOUNTS],
}

impl LedgerSum {
    /// The counts of all accounts, in the order of [`Account`].
    pub fn counts(&self) -> impl Iterator<Item = i128> + '_ {
        self.counts.iter().flatten().copied()
    }

    pub fn counts_mut(&mut self) -> impl Iterator<Item = &mut i128> {
        self.counts.iter_mut().flatten()
    }

    pub fn book(&mut self, account: Account, count: FluxCount) {
        for (sum, channel) in self.counts[account as usize].iter_mut().zip(count) {
            *sum += i128::from(channel);
        }
    }

    pub fn book_sum(&mut self, account: Account, counts: [i128; 3]) {
        for (sum, channel) in self.counts[account as usize].iter_mut().zip(counts) {
            *sum += channel;
        }
    }

    /// Adds another part of the same light's ledger.
    pub fn merge(&mut self, other: &Self) {
        for (sums, parts) in self.counts.iter_mut().zip(other.counts) {
            for (sum, part) in sums.iter_mut().zip(parts) {
                *sum += part;
            }
        }
    }

    /// The same accounts in other channels: applies a linear function to each triple of counts and rounds to the
    /// nearest count.
    #[must_use]
    pub fn transformed(&self, f: impl Fn(LinearSrgb) -> LinearSrgb) -> Self {
        let transform = |counts: [i128; 3]| {
            f(LinearSrgb::from(counts.map(|count| count as f64)))
                .to_array()
                .map(|channel| channel.round() as i128)
        };
        Self {
            counts: self.counts.map(transform),
        }
    }

    /// An account's flux [W, luminous-equivalent] for a light of this strength, if the counts are for unit strength.
    pub fn watts(&self, account: Account, unit: FluxUnit, strength: LinearSrgb) -> f64 {
        let flux_w =
            LinearSrgb::from(self.counts[account as usize].map(|channel| channel as f64 * unit.watts()));
        (flux_w * strength).luminance()
    }

    /// The largest channel of an account [W, of a light of unit strength].
    pub fn watts_of_largest(&self, account: Account, unit: FluxUnit) -> f64 {
        let counts = self.counts[account as usize].map(|channel| channel as f64);
        counts.into_iter().fold(f64::MIN, f64::max) * unit.watts()
    }

    /// The ledger in watts.
    pub fn report(&self, light: &str, unit: FluxUnit, strength: LinearSrgb) -> LightLedger {
        let watts = |account| self.watts(account, unit, strength);
        LightLedger {
            light: light.to_owned(),
            energy_w: EnergyLedger {
                emitted: watts(Account::Emitted),
                deposited: watts(Account::Deposited),
                absorbed: watts(Account::Absorbed),
                escaped: watts(Account::Escaped),
                truncated: Truncated {
                    depth: watts(Account::Depth),
                    threshold: watts(Account::Threshold),
                    non_finite: watts(Account::NonFinite),
                    unresolved: watts(Account::Unresolved),
                    switched_off: watts(Account::SwitchedOff),
                },
                sampling: watts(Account::Sampling),
            },
            carried_w: CarriedFlux::default(),
            not_emitted_w: watts(Account::NotEmitted),
            emitted_radiant_w: None,
            deposited_radiant_w: None,
        }
    }
}
