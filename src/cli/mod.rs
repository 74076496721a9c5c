//! The command line: parse, a validated [`Job`] before any long work, run, exit code.

mod args;
mod bake;
mod bake_options;
mod compare;
mod export;
mod export_glb;
mod export_textures;
mod inspect;
mod job;
mod merge;
mod render;
#[cfg(feature = "gpu")]
mod render_path;
mod shard;
mod study;
mod terminal;
mod values;
mod view;

use std::process::ExitCode;

use job::Job;
use nephroid::error::{Error, ErrorKind, Result};
#[cfg(feature = "viewer")]
use nephroid::viewer::is_orphaned as is_of_lost_window;
use terminal::Interrupt;
use terminal::Terminal;

/// Parses, runs, and says how it went: 0 done, 1 failed, 2 bad usage, 128 + signal when a signal stopped it.
pub fn run() -> ExitCode {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        // Those of damaged files become errors, that of a lost window its end.
        if !nephroid::scene::is_guarded() && !is_of_lost_window(info) {
            usual(info);
        }
    }));
    let (terminal, job) = match args::parse() {
        Ok(args::Parsed::Run(terminal, job)) => (terminal, job),
        Ok(args::Parsed::Printed) => return ExitCode::SUCCESS,
        Err(error) => return report(&error),
    };
    match execute(&terminal, *job) {
        Ok(code) => code,
        Err(error) => report(&error),
    }
}

#[cfg(not(feature = "viewer"))]
fn is_of_lost_window(_: &std::panic::PanicHookInfo<'_>) -> bool {
    false
}

/// Runs a job; a signal decides the exit code even where what there was could still be written.
fn execute(terminal: &Terminal, job: Job) -> Result<ExitCode> {
    let interrupt = Interrupt::install()?;
    let outcome = job.run(terminal, &interrupt);
    match (interrupt.exit_code(), outcome) {
        (Some(code), Ok(())) => Ok(code),
        (Some(code), Err(error)) => {
            report(&error);
            Ok(code)
        }
        (None, outcome) => outcome.map(|()| ExitCode::SUCCESS),
    }
}

fn report(error: &Error) -> ExitCode {
    terminal::print_error(error);
    match error.kind {
        ErrorKind::Usage => ExitCode::from(2),
        ErrorKind::Failure | ErrorKind::Cancelled => ExitCode::FAILURE,
    }
}
