//! Bakes of reference scenes: against an independent solver, against the law of energy, against themselves.

mod effects;
mod instances;
mod photon;
mod reference;
