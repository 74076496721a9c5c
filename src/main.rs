//! The `nephroid` program: parses the command line, validates the job before any long work, runs it, sets the exit
//! code.

mod cli;
mod memory;

use std::process::ExitCode;

#[global_allocator]
static MEMORY: memory::FirstSentence = memory::FirstSentence;

fn main() -> ExitCode {
    cli::run()
}
