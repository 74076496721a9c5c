//! What every change has to pass, in minutes.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

mod bake {
    //! Bakes of reference scenes: against an independent solver, against the law of energy, against themselves.

    mod glowing;
    mod instances;
    mod mixture;
    mod photon;
    mod reference;
}

mod cli;
mod export;
mod eye;

#[cfg(feature = "gpu")]
mod gpu {
    //! The graphics device: shaders, struct layouts, limits, and one picture against the CPU's.
    //!
    //! An adapter is required, a software one will do: with CI=true its absence is a failure, else a skip that says so.

    mod device;
    mod picture;
    #[allow(dead_code, reason = "full tests use the rest")]
    mod rig;
    mod web;
}

mod laws;
mod physics;
mod scene;
#[cfg(feature = "viewer")]
mod viewer;

use support::prelude;
