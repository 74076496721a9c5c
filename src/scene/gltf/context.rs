//! What a load has found so far, and the memory that it may still take.

use std::collections::HashSet;

use crate::error::{Error, Result, Warning};

/// Remedy where the file itself is at fault.
const EXPORT_AGAIN: &str = "export the file again";

/// Largest number of warnings: more would bury the ones that matter.
const MAX_WARNINGS: usize = 60;

/// Largest number of places that a warning names; further ones are counted.
const MAX_LOCATIONS: usize = 4;

/// A warning of one or several places.
#[derive(Debug)]
struct SharedWarning {
    what: String,
    remedy: String,
    /// The first ones.
    named: Vec<String>,
    locations: HashSet<String>,
}

impl SharedWarning {
    fn add(&mut self, location: String) {
        if self.locations.insert(location.clone()) && self.named.len() < MAX_LOCATIONS {
            self.named.push(location);
        }
    }
}

/// Warnings and memory budget of a load. A warning of several places is given once.
#[derive(Debug)]
pub struct LoadContext {
    warnings: Vec<SharedWarning>,
    left_out: usize,
    limit_bytes: u64,
    left_bytes: u64,
}

impl Default for LoadContext {
    /// Without a memory limit.
    fn default() -> Self {
        Self::new(u64::MAX)
    }
}

impl LoadContext {
    pub fn new(limit_bytes: u64) -> Self {
        Self {
            warnings: Vec::new(),
            left_out: 0,
            limit_bytes,
            left_bytes: limit_bytes,
        }
    }

    /// Warns of something repaired or ignored.
    pub fn warn(&mut self, location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) {
        let (location, what, remedy) = (location.into(), what.into(), remedy.into());
        let mut known = self.warnings.iter_mut();
        if let Some(known) = known.find(|known| known.what == what && known.remedy == remedy) {
            known.add(location);
        } else if self.warnings.len() < MAX_WARNINGS {
            let mut first = SharedWarning {
                what,
                remedy,
                named: Vec::new(),
                locations: HashSet::new(),
            };
            first.add(location);
            self.warnings.push(first);
        } else {
            self.left_out += 1;
        }
    }

    /// Warns of a fault of the file that was repaired or ignored.
    pub fn warn_damaged(&mut self, location: impl Into<String>, what: impl Into<String>) {
        self.warn(location, what, EXPORT_AGAIN);
    }

    /// All warnings, in the order of their first occurrence.
    pub fn into_warnings(self) -> Vec<Warning> {
        let warning = |known: SharedWarning| {
            let mut location = known.named.join(", ");
            if known.locations.len() > known.named.len() {
                location += &format!(" and {} more", known.locations.len() - known.named.len());
            }
            Warning::new(location, known.what, known.remedy)
        };
        let mut warnings: Vec<Warning> = self.warnings.into_iter().map(warning).collect();
        if self.left_out > 0 {
            let what = format!("{} more warnings were left out", self.left_out);
            warnings.push(Warning::new("glTF", what, "see to these first"));
        }
        warnings
    }

    /// Remaining memory [bytes].
    pub fn left(&self) -> u64 {
        self.left_bytes
    }

    /// Reserves memory before it is allocated.
    ///
    /// # Errors
    /// More than is left.
    pub fn take(&mut self, bytes: u64, what: &str) -> Result<()> {
        let refused = || {
            let megabytes = self.limit_bytes / 1_000_000;
            let fault = format!("would take more memory than the limit of {megabytes} MB");
            Error::failure(what, fault, "raise the limit or use a smaller scene")
        };
        self.left_bytes = self.left_bytes.checked_sub(bytes).ok_or_else(refused)?;
        Ok(())
    }
}

/// The error for a file whose contents do not fit together.
pub fn damaged(location: impl Into<String>, what: impl Into<String>) -> Error {
    Error::failure(location, what, EXPORT_AGAIN)
}
