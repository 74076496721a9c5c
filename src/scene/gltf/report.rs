//! Warnings of a load, and its memory limits.

use crate::error::{Error, Result, Warning};

/// Collects warnings; a warning of several places is given once.
#[derive(Debug, Default)]
pub struct Report {
    found: Vec<CheckResult>,
    left_out: usize,
}

#[derive(Debug)]
struct CheckResult {
    what: String,
    remedy: String,
    locations: Vec<String>,
}

/// Largest number of warnings: more would bury the ones that matter.
const MAX_FINDINGS: usize = 60;

/// Largest number of places that a warning names; further ones are counted.
const MAX_LOCATIONS: usize = 4;

impl Report {
    /// Warns of something repaired or ignored.
    pub fn warn(&mut self, location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) {
        let (location, what, remedy) = (location.into(), what.into(), remedy.into());
        let same = |known: &&mut CheckResult| known.what == what && known.remedy == remedy;
        if let Some(known) = self.found.iter_mut().find(same) {
            if !known.locations.contains(&location) {
                known.locations.push(location);
            }
        } else if self.found.len() < MAX_FINDINGS {
            self.found.push(CheckResult {
                what,
                remedy,
                locations: vec![location],
            });
        } else {
            self.left_out += 1;
        }
    }

    /// All warnings, in the order of their first occurrence.
    pub fn into_warnings(self) -> Vec<Warning> {
        let mut warnings: Vec<Warning> = self.found.into_iter().map(CheckResult::into_warning).collect();
        if self.left_out > 0 {
            warnings.push(Warning::new(
                "glTF",
                format!("{} more warnings were left out", self.left_out),
                "see to these first",
            ));
        }
        warnings
    }
}

impl CheckResult {
    fn into_warning(self) -> Warning {
        let named = self.locations.len().min(MAX_LOCATIONS);
        let mut location = self.locations[..named].join(", ");
        if self.locations.len() > named {
            location += &format!(" and {} more", self.locations.len() - named);
        }
        Warning::new(location, self.what, self.remedy)
    }
}

/// Memory that loading may still take [bytes].
#[derive(Debug)]
pub struct Budget {
    limit: u64,
    left: u64,
}

impl Budget {
    pub fn new(limit: u64) -> Self {
        Self { limit, left: limit }
    }

    /// Remaining memory [bytes].
    pub fn left(&self) -> u64 {
        self.left
    }

    /// Reserves memory before it is allocated.
    ///
    /// # Errors
    /// More than is left.
    pub fn take(&mut self, bytes: u64, what: &str) -> Result<()> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(Error::failure(
                what,
                format!(
                    "would take more memory than the limit of {} MB",
                    self.limit / 1_000_000
                ),
                "raise the limit or use a smaller scene",
            )),
        }
    }
}
