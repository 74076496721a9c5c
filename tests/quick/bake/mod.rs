//! Bakes of reference scenes: against an independent solver, against the law of energy, against themselves.

mod effects;
mod mixture;
mod photon;
mod reference;
