//! Errors and warnings as data: what happened, where, and what to do about it.

use serde::Serialize;

/// Whether the command was wrong (exit code 2) or the work failed (exit code 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The command line or a setting was wrong: exit code 2.
    Usage,
    /// The input or the system failed us: exit code 1.
    Failure,
    /// The user or the system asked to stop: exit code 130 or 143.
    Cancelled,
}

/// One failure, reported once, as one sentence: `location: what; remedy`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{location}: {what}; {remedy}")]
pub struct Error {
    /// Decides the exit code.
    pub kind: ErrorKind,
    /// A file, a node, an option: where it happened.
    pub location: String,
    /// What is wrong, in the user's terms.
    pub what: String,
    /// What the user can do about it.
    pub remedy: String,
}

/// Most characters of a part of a sentence, and those of its end that are kept where there are more: what files and
/// users call things may have any length.
const MAX_CHARACTERS: usize = 600;
const KEPT_END: usize = 150;

/// The text without its middle, where it is too long for a sentence.
fn shortened(text: String) -> String {
    let count = text.chars().count();
    if count <= MAX_CHARACTERS {
        return text;
    }
    let start: String = text.chars().take(MAX_CHARACTERS - KEPT_END).collect();
    let end: String = text.chars().skip(count - KEPT_END).collect();
    format!("{start} … {end}")
}

/// Shorthand for a result with our [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// The input or the system failed us (exit code 1).
    pub fn failure(location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Failure,
            location: shortened(location.into()),
            what: shortened(what.into()),
            remedy: remedy.into(),
        }
    }

    /// The command line or a setting was wrong (exit code 2).
    pub fn usage(location: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Usage,
            location: shortened(location.into()),
            what: shortened(what.into()),
            remedy: remedy.into(),
        }
    }

    /// The work was cancelled before it gave a result.
    pub fn cancelled(location: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Cancelled,
            location: location.into(),
            what: "cancelled before it was done".into(),
            remedy: "start it again to finish".into(),
        }
    }
}

/// Something repaired or ignored, that the user should know of: never an error, never silent.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct Warning {
    /// A file, a node, an option: where it was met.
    pub location: String,
    /// What was met and what was done about it.
    pub what: String,
    /// What the user can do about it.
    pub remedy: String,
}

impl Warning {
    /// A warning of what was met, where, and what to do.
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
