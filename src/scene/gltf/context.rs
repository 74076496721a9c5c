//! What a load has found so far, and the memory that it may still take.

use crate::error::{Error, Result, Warning};

/// Remedy where the file itself is at fault.
const EXPORT_AGAIN: &str = "export the file again";

/// Largest number of warnings: more would bury the ones that matter.
const MAX_WARNINGS: usize = 60;

/// Largest number of places that a warning names; further ones are counted.
const MAX_LOCATIONS: usize = 4;

/// Warnings and memory budget of a load. A warning of several places is given once.
#[derive(Debug)]
pub struct LoadContext {
    /// What, remedy, and all locations.
    warnings: Vec<(String, String, Vec<String>)>,
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
        if let Some((.., locations)) = known.find(|known| known.0 == what && known.1 == remedy) {
            if !locations.contains(&location) {
                locations.push(location);
            }
        } else if self.warnings.len() < MAX_WARNINGS {
            self.warnings.push((what, remedy, vec![location]));
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
        let warning = |(what, remedy, locations): (String, String, Vec<String>)| {
            let named = locations.len().min(MAX_LOCATIONS);
            let mut location = locations[..named].join(", ");
            if locations.len() > named {
                location += &format!(" and {} more", locations.len() - named);
            }
            Warning::new(location, what, remedy)
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
