//! The two streams: results on stdout, everything else on stderr.

use std::io::{ErrorKind, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use nephroid::error::{Error, Result, Warning};
use nephroid::progress::{Control, Progress, Stage};

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

/// Redraws per second.
const REFRESH_HZ: u8 = 10;

/// Shows the stage and how far it is; draws nothing where no bar is wanted.
pub struct StageBar {
    bar: ProgressBar,
    stage: Mutex<Option<Stage>>,
}

impl StageBar {
    /// A bar, not yet drawn.
    pub fn new(terminal: &Terminal) -> Self {
        let target = if terminal.shows_progress() {
            ProgressDrawTarget::stderr_with_hz(REFRESH_HZ)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let style = ProgressStyle::with_template(
            "{prefix:8} {wide_bar} {percent:>3} %  {elapsed} (left {eta}) {msg}",
        )
        .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        if terminal.shows_progress() {
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        Self {
            bar,
            stage: Mutex::new(None),
        }
    }
}

impl Progress for StageBar {
    fn advance(&self, stage: Stage, done: u64, total: u64) {
        if let Ok(mut current) = self.stage.lock()
            && *current != Some(stage)
        {
            *current = Some(stage);
            self.bar.set_prefix(stage.name());
            self.bar.reset_eta();
        }
        self.bar.set_length(total);
        self.bar.set_position(done);
    }

    fn expect(&self, line: &str) {
        self.bar.set_message(line.to_string());
    }
}

impl Drop for StageBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;

/// Exit codes are 128 + signal, as shells have it.
const SIGNAL_BASE: u8 = 128;

/// Listens to signals for as long as the process runs.
#[derive(Debug)]
pub struct Interrupt {
    control: Arc<Control>,
    exit_code: Arc<AtomicU8>,
}

impl Interrupt {
    /// Starts listening.
    ///
    /// # Errors
    /// A system that refuses the handlers.
    pub fn install() -> Result<Self> {
        let refused = |error: std::io::Error| {
            Error::failure(
                "signals",
                format!("no handler could be installed ({error})"),
                "start the program from an ordinary shell",
            )
        };
        let interrupt = Self {
            control: Arc::new(Control::default()),
            exit_code: Arc::new(AtomicU8::new(0)),
        };
        // Else the system ends the process in the middle of a file; so the write fails, with a sentence.
        #[cfg(unix)]
        signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map_err(refused)?;
        let mut signals = Signals::new([SIGINT, SIGTERM]).map_err(refused)?;
        let (control, exit_code) = (interrupt.control.clone(), interrupt.exit_code.clone());
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(move || {
                for signal in signals.forever() {
                    let code = SIGNAL_BASE + u8::try_from(signal).unwrap_or(0);
                    if exit_code.swap(code, Ordering::SeqCst) != 0 {
                        std::process::exit(i32::from(code));
                    }
                    control.cancel();
                }
            })
            .map_err(refused)?;
        Ok(interrupt)
    }

    /// What the first signal cancels.
    pub fn control(&self) -> &Control {
        &self.control
    }

    /// The same, for those that outlive the borrow.
    #[cfg(feature = "viewer")]
    pub fn shared_control(&self) -> Arc<Control> {
        self.control.clone()
    }

    /// Between two pieces of work: an error where a signal came.
    ///
    /// # Errors
    /// Cancelled; `location` says during what.
    pub fn check(&self, location: &str) -> Result<()> {
        if self.control.is_cancelled() {
            return Err(Error::cancelled(location));
        }
        Ok(())
    }

    /// Ends the process, with the code that a signal calls for or 0. What libraries tidy up at an ordinary end is left:
    /// threads of graphics drivers may be at work on it.
    #[cfg(feature = "viewer")]
    pub fn leave(&self) -> ! {
        signal_hook::low_level::exit(self.exit_code.load(Ordering::SeqCst).into())
    }

    /// The exit code that a signal calls for, if one came.
    pub fn exit_code(&self) -> Option<ExitCode> {
        match self.exit_code.load(Ordering::SeqCst) {
            0 => None,
            code => Some(ExitCode::from(code)),
        }
    }
}
