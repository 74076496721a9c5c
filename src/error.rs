//! Errors and warnings as data: what happened, where, and what to do about it.

use serde::Serialize;

/// Kind of a failure, which determines the exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The command line or a setting is wrong: exit code 2.
    Usage,
    /// The input or the system is at fault: exit code 1.
    Failure,
    /// The user or the system asked to stop: exit code 130 or 143.
    Cancelled,
}

/// A failure, reported once, in one sentence: `location: what; remedy`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{location}: {what}; {remedy}")]
pub struct Error {
    /// Determines the exit code.
    pub kind: ErrorKind,
    /// Where it happened: a file, a node, an option.
    pub location: String,
    /// What is wrong, in the user's terms.
    pub what: String,
    /// What the user can do about it.
    pub remedy: String,
}

/// Maximum number of characters of each part of the sentence, and how many of them are kept from its end if there are
/// more. Names in files and from users may have any length.
const MAX_CHARACTERS: usize = 600;
const KEPT_END: usize = 150;

/// Elides the middle of a text that is too long for a sentence.
fn shortened(text: String) -> String {
    let count = text.chars().count();
    if count <= MAX_CHARACTERS {
        return text;
    }
    let start: String = text.chars().take(MAX_CHARACTERS - KEPT_END).collect();
    let end: String = text.chars().skip(count - KEPT_END).collect();
    format!("{start} … {end}")
}

/// A result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A fault of the input or the system (exit code 1).
    pub fn failure(location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Failure,
            location: shortened(location.into()),
            what: shortened(what.into()),
            remedy: remedy.into(),
        }
    }

    /// A mistake in the command line or a setting (exit code 2).
    pub fn usage(location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Usage,
            location: shortened(location.into()),
            what: shortened(what.into()),
            remedy: remedy.into(),
        }
    }

    /// The same error, found elsewhere.
    #[must_use]
    pub fn at(self, location: impl Into<String>) -> Self {
        let location = shortened(location.into());
        Self { location, ..self }
    }

    /// The work was cancelled before it produced a result.
    pub fn cancelled(location: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Cancelled,
            location: location.into(),
            what: "cancelled before it was done".into(),
            remedy: "start it again to finish".into(),
        }
    }
}

/// Something that was repaired or ignored and that the user should know about: never an error, never silent.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct Warning {
    /// Where it was found: a file, a node, an option.
    pub location: String,
    /// What was found and what was done about it.
    pub what: String,
    /// What the user can do about it.
    pub remedy: String,
}

impl Warning {
    /// A warning of what was found, where, and what to do.
    pub fn new(location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            location: shortened(location.into()),
            what: shortened(what.into()),
            remedy: remedy.into(),
        }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}; {}", self.location, self.what, self.remedy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_has_an_end_whatever_things_are_called() {
        let long = "名".repeat(5000);
        let sentence = Error::failure(long.clone(), format!("is {long}"), "rename it").to_string();
        assert!(sentence.chars().count() < 1300, "{}", sentence.chars().count());
        assert!(sentence.contains(" … ") && sentence.ends_with("; rename it"));
        assert_eq!(Error::usage("a", "b".repeat(600), "c").what, "b".repeat(600));
    }
}
