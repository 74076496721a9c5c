//! The two streams: results on stdout, everything else on stderr.

use std::io::{ErrorKind, IsTerminal, Write};

use nephroid::error::{Error, Result, Warning};
use serde::Serialize;

/// What may be printed.
#[derive(Clone, Copy, Debug)]
pub struct Terminal {
    /// No progress on stderr; warnings and errors stay.
    pub quiet: bool,
    /// Results as one JSON document.
    pub json: bool,
}

impl Terminal {
    /// Prints the result of a command: text for people, or the JSON document when that was asked for.
    ///
    /// # Errors
    /// A stdout that cannot be written. A reader that went away is no error.
    pub fn print_result(&self, text: &str, document: &impl Serialize) -> Result<()> {
        if self.json {
            let json = serde_json::to_string_pretty(document).map_err(|error| {
                Error::failure(
                    "stdout",
                    format!("the result is not valid JSON ({error})"),
                    "leave --json out",
                )
            })?;
            print(&json)
        } else {
            print(text.trim_end())
        }
    }

    /// Prints warnings to stderr.
    pub fn print_warnings(&self, warnings: &[Warning]) {
        for warning in warnings {
            print_stderr(&format!("warning: {warning}"));
        }
    }

    /// Prints a line that people should see, but that is no result, to stderr.
    pub fn print_note(&self, note: &str) {
        print_stderr(note);
    }

    /// Whether a progress bar is wanted and can be shown.
    pub fn shows_progress(&self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }
}

/// Prints to stdout with a newline at the end.
///
/// # Errors
/// A stdout that cannot be written. A reader that went away is no error.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    let written = writeln!(stdout, "{text}").and_then(|()| stdout.flush());
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Error::failure(
            "stdout",
            format!("the result could not be written ({error})"),
            "make room or send it elsewhere",
        )),
        _ => Ok(()),
    }
}

/// Prints an error to stderr as one line.
pub fn print_error(error: &Error) {
    print_stderr(&format!("error: {error}"));
}

/// One line on stderr, whatever line breaks and control characters came in with names from files. Where stderr cannot
/// be written there is nobody left to tell.
fn print_stderr(line: &str) {
    let line: String = line
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}
