//! The command line: a command is one struct that is parsed, checked before any long work, and run.

mod bake;
mod bake_options;
mod compare;
mod console;
mod export;
mod help;
mod inspect;
mod loaded;
mod merge;
mod moments;
mod options;
mod picture;
mod render;
#[cfg(feature = "gpu")]
mod render_path;
mod study;
mod values;
mod view;

use std::process::ExitCode;

use clap::error::ErrorKind as ClapErrorKind;
use clap::{Parser, Subcommand};
use nephroid::error::{Error, ErrorKind, Result};
#[cfg(feature = "viewer")]
use nephroid::viewer::is_orphaned as is_of_lost_window;

use bake::BakeArguments;
use compare::CompareArguments;
use console::Console;
use export::ExportArguments;
use inspect::InspectArguments;
use merge::MergeArguments;
use options::RunOptions;
use render::RenderArguments;
use study::StudyArguments;
use view::ViewArguments;

/// Bakes light through glass, mirrors and water into maps, and lets you walk through the result.
#[derive(Debug, Parser)]
#[command(
    name = "nephroid",
    version,
    args_conflicts_with_subcommands = true,
    max_term_width = 100
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    view: ViewArguments,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Open a window on a scene and bake it (the default command)
    View(ViewArguments),
    /// Bake illumination maps and a manifest into a folder
    Bake(BakeArguments),
    /// Render a picture or a film
    Render(RenderArguments),
    /// List contents, effects, warnings and expected cost of a scene
    Inspect(InspectArguments),
    /// Measure a map against a reference
    Compare(CompareArguments),
    /// Write baked maps as glTF or textures for other programs
    Export(ExportArguments),
    /// Combine the shards of a bake into maps
    Merge(MergeArguments),
    /// Measure accuracy against cost: tables, plots, pictures
    Study(StudyArguments),
}

type Run<'a> = Box<dyn Fn(&Console) -> Result<()> + 'a>;

impl Arguments {
    /// The options and the action of the command.
    fn command(&self) -> (&RunOptions, Run<'_>) {
        match &self.command {
            None => (&self.view.run, Box::new(|console| self.view.run(console))),
            Some(Command::View(view)) => (&view.run, Box::new(|console| view.run(console))),
            Some(Command::Bake(bake)) => (&bake.run, Box::new(|console| bake.run(console))),
            Some(Command::Render(render)) => (&render.run, Box::new(|console| render.run(console))),
            Some(Command::Inspect(inspect)) => (&inspect.run, Box::new(|console| inspect.run(console))),
            Some(Command::Compare(compare)) => (&compare.run, Box::new(|console| compare.run(console))),
            Some(Command::Export(export)) => (&export.run, Box::new(|console| export.run(console))),
            Some(Command::Merge(merge)) => (&merge.run, Box::new(|console| merge.run(console))),
            Some(Command::Study(study)) => (study.run_options(), Box::new(|console| study.run(console))),
        }
    }
}

/// Parses, runs and reports. Exit codes: 0 done, 1 failed, 2 bad usage, 128 + signal if a signal ended it.
pub fn run() -> ExitCode {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        // Panics over damaged files become errors, and one over a lost window ends the program: neither is printed.
        if !nephroid::scene::is_guarded() && !is_of_lost_window(info) {
            usual(info);
        }
    }));
    parse_and_run().unwrap_or_else(|error| report(&error))
}

#[cfg(not(feature = "viewer"))]
fn is_of_lost_window(_: &std::panic::PanicHookInfo<'_>) -> bool {
    false
}

/// A signal decides the exit code even if results could still be written.
fn parse_and_run() -> Result<ExitCode> {
    // clap reports help and the version as errors, but they are results, and go to stdout.
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error)
            if matches!(
                error.kind(),
                ClapErrorKind::DisplayHelp | ClapErrorKind::DisplayVersion
            ) =>
        {
            let text = match error.kind() {
                ClapErrorKind::DisplayHelp => help::text(std::env::args_os().skip(1)),
                _ => error.render().to_string(),
            };
            console::print(text.trim_end())?;
            return Ok(ExitCode::SUCCESS);
        }
        Err(error) => return Err(in_one_sentence(&error)),
    };

    // Log and cache belong to the process, and are set up before any work.
    let (options, command) = arguments.command();
    env_logger::Builder::new().filter_level(options.log).init();
    if !options.no_cache {
        nephroid::files::cache::enable();
    }

    // Work that a signal ended may fail or end well, but shells are told of the signal.
    let console = Console::open(options)?;
    let outcome = command(&console);
    match console.exit_code() {
        None => outcome.map(|()| ExitCode::SUCCESS),
        Some(code) => {
            if let Err(error) = outcome {
                report(&error);
            }
            Ok(code)
        }
    }
}

fn report(error: &Error) -> ExitCode {
    console::print_error(error);
    match error.kind {
        ErrorKind::Usage => ExitCode::from(2),
        ErrorKind::Failure | ErrorKind::Cancelled => ExitCode::FAILURE,
    }
}

/// Clap's report as one line, without its usage block.
fn in_one_sentence(error: &clap::Error) -> Error {
    if error.kind() == ClapErrorKind::InvalidUtf8 {
        let words: Vec<String> = std::env::args_os()
            .filter_map(|word| word.into_string().err())
            .map(|word| format!("`{}`", word.display()))
            .collect();
        return Error::usage(words.join(", "), "this name is not UTF-8", "rename the file");
    }
    let report = error.render().to_string();
    let what: Vec<&str> = report
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty())
        .collect();
    let what = what.join(" ");
    Error::usage(
        "command line",
        what.trim_start_matches("error: "),
        "see nephroid --help",
    )
}
