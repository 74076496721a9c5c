//! The `nephroid` program: parse, a validated job before any long work, run, exit code.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
