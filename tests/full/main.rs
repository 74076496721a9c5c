//! Everything that takes longer: accuracy against truth, windows driven by hands, damage, faults and signals.

#![allow(clippy::print_stdout, reason = "figures, for those who ask by --nocapture")]

mod bake {
    //! Bakes of reference scenes: against an independent solver, against the law of energy, against themselves.

    mod accuracy;
    mod common;
    mod coverage;
    mod indirect;
    mod live;
    mod motion;
    mod photon;
    mod plan;
    mod probe;
    mod soft;
    mod solver;
    mod sparse;
    mod spectral;
    mod surfaces;
    mod tiles;
}

mod cli {
    //! The program under what systems and users do to it, and on graphics cards.

    #[cfg(unix)]
    mod faults;
    #[cfg(feature = "gpu")]
    mod render_path;
    mod study;
}

mod damage {
    //! Damaged, edited and hostile input: whatever comes of it, there is a result or one clear sentence, in time and in
    //! little memory. Never a panic.
    //!
    //! All damage is seeded: the same in every run. `NEPHROID_MUTATIONS=50` makes 50 times as much of it. What a test fails
    //! over is left in the build folder.

    mod files;
    pub mod mutate;
    mod scenes;
}

mod eye {
    //! Maps on surfaces, the direct layer and the CPU eye pass, on scenes whose answer is known.

    mod chains;
    mod dispersion;
    mod soft_light;
}

#[cfg(feature = "gpu")]
mod gpu {
    //! The graphics device against the CPU, and what it uploads, keeps and makes on demand.
    //!
    //! An adapter is required, a software one will do: with CI=true its absence is a failure, else a skip that says so.

    mod against_cpu;
    mod chains;
    mod flights;
    mod maps;
    mod on_demand;
    mod parted;
    mod rays;
    #[path = "../../quick/gpu/rig.rs"]
    #[allow(dead_code, reason = "quick tests use the rest")]
    mod rig;
    mod views;
}

#[cfg(feature = "viewer")]
mod viewer {
    //! The window under Xvfb, and what takes longer of its parts without a display.

    #[path = "../../quick/viewer/fixtures.rs"]
    #[allow(dead_code, reason = "quick tests use the rest")]
    mod fixtures;
    #[path = "../../quick/viewer/headless.rs"]
    #[allow(dead_code, reason = "quick tests use the rest")]
    mod headless;
    mod parts;
    #[path = "../../quick/viewer/scene_file.rs"]
    #[allow(dead_code, reason = "quick tests use the rest")]
    mod scene_file;
    #[cfg(target_os = "linux")]
    mod window;
}
