//! Hard cases by name: a scene, settings, and a law that must hold, with the worst that was seen and its bound. A law
//! follows from physics or from what a bake promises; none is a figure that was once measured.

pub mod bench;
mod dielectrics;
mod file;
mod files;
mod geometry;
mod invariance;
mod laws;
mod lights;
mod maps;
mod mirrors;
mod numbers;
pub mod random;
mod scenes;
pub mod table;

use std::time::Instant;

pub use bench::{Bench, Effort, Finding};

use crate::error::Result;
use crate::progress::{Control, Progress};

/// What a case is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// Mirrors, glass, and the light between them.
    Optics,
    /// Meshes, charts and where they lie.
    Geometry,
    /// What surfaces are made of, and lamps.
    Materials,
    /// Scales, counts and sizes that numbers have to bear.
    Numbers,
    /// What must not change a map, or must change it just so.
    Laws,
}

impl Group {
    /// All of them, in their order.
    pub const ALL: [Self; 5] = [
        Self::Optics,
        Self::Geometry,
        Self::Materials,
        Self::Numbers,
        Self::Laws,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Optics => "optics",
            Self::Geometry => "geometry",
            Self::Materials => "materials",
            Self::Numbers => "numbers",
            Self::Laws => "laws",
        }
    }
}

/// One hard case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name, in words joined by hyphens.
    pub name: &'static str,
    /// What it is about.
    pub group: Group,
    /// Least effort that includes it.
    pub effort: Effort,
    check: fn(&mut Bench) -> Result<()>,
}

/// What a case came to.
#[derive(Clone, Debug, serde::Serialize)]
pub struct CaseReport {
    /// The case's name.
    pub case: &'static str,
    /// What it is about.
    pub group: Group,
    /// Its laws, in the order of their proof.
    pub findings: Vec<Finding>,
    /// Bakes that it took.
    pub bakes: usize,
    /// What ledgers leave open at worst, of what was emitted, or maps of what was deposited; `None` without a bake.
    /// Infinite where a value of a map is not finite or below zero.
    pub books_open: Option<f64>,
    /// Wall-clock time [s].
    pub seconds: f64,
}

impl CaseReport {
    /// Whether every law holds and all books are closed.
    pub fn holds(&self) -> bool {
        self.findings.iter().all(Finding::holds)
            && self.books_open.is_none_or(|open| open <= bench::BOOKS_BOUND)
    }
}

impl Case {
    const fn quick(name: &'static str, group: Group, check: fn(&mut Bench) -> Result<()>) -> Self {
        Self {
            name,
            group,
            effort: Effort::Quick,
            check,
        }
    }

    const fn long(name: &'static str, group: Group, check: fn(&mut Bench) -> Result<()>) -> Self {
        Self {
            name,
            group,
            effort: Effort::Long,
            check,
        }
    }

    /// Puts it to the test, on so many threads (0: one per core).
    ///
    /// # Errors
    /// Bakes that fail altogether; stopped before the end.
    pub fn check(
        &self,
        (effort, threads): (Effort, usize),
        progress: &dyn Progress,
        control: &Control,
    ) -> Result<CaseReport> {
        let began = Instant::now();
        let mut bench = Bench::new((effort, threads), progress, control);
        (self.check)(&mut bench)?;
        Ok(CaseReport {
            case: self.name,
            group: self.group,
            books_open: bench.books_open(),
            bakes: bench.bakes,
            findings: bench.findings,
            seconds: began.elapsed().as_secs_f64(),
        })
    }
}

/// The catalogue, group by group.
pub fn cases() -> Vec<Case> {
    let all = [
        mirrors::CASES,
        dielectrics::CASES,
        geometry::CASES,
        files::CASES,
        lights::CASES,
        numbers::CASES,
        maps::CASES,
        invariance::CASES,
        random::CASES,
    ];
    let mut cases = all.concat();
    cases.sort_by_key(|case| Group::ALL.iter().position(|group| *group == case.group));
    cases
}
