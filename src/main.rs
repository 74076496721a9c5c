//! The `nephroid` program: parse, a validated job before any long work, run, exit code.

mod cli;
mod memory;

use std::process::ExitCode;

#[global_allocator]
static MEMORY: memory::FirstSentence = memory::FirstSentence;

fn main() -> ExitCode {
    cli::run()
}
