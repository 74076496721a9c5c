//! The terminal: results on stdout, messages on stderr, and signals.

use std::io::{ErrorKind, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use serde_json::{Value, json};
#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use nephroid::error::{Error, Result, Warning};
use nephroid::progress::{Control, Progress, Stage};

use super::options::{ProgressForm, RunOptions};

/// Exit codes of signals are 128 + signal, as in shells.
const SIGNAL_BASE: u8 = 128;

/// Output streams and signal handling of the process.
#[derive(Debug)]
pub struct Console {
    /// Hides progress, but not warnings and errors.
    quiet: bool,
    progress: ProgressForm,
    /// Prints results as one JSON document.
    pub json: bool,
    control: Arc<Control>,
    exit_code: Arc<AtomicU8>,
}

impl Console {
    /// Installs the signal handlers.
    ///
    /// # Errors
    /// Handlers that cannot be installed.
    pub fn open(options: &RunOptions) -> Result<Self> {
        let refused = |error: std::io::Error| {
            Error::failure(
                "signals",
                format!("no handler could be installed ({error})"),
                "start the program from an ordinary shell",
            )
        };
        let console = Self {
            quiet: options.quiet,
            progress: options.progress,
            json: options.json,
            control: Arc::default(),
            exit_code: Arc::default(),
        };

        // Without a handler, the file size limit ends the process in the middle of a file; with one, the write fails
        // with an error.
        #[cfg(unix)]
        signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map_err(refused)?;

        // The first signal asks the work to stop in order and to keep complete files; the second ends the process.
        let mut signals = Signals::new([SIGINT, SIGTERM]).map_err(refused)?;
        let (control, exit_code) = (console.control.clone(), console.exit_code.clone());
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
        Ok(console)
    }

    /// Cancelled by the first signal.
    pub fn control(&self) -> &Arc<Control> {
        &self.control
    }

    /// Fails if a signal has arrived; for use between two steps.
    ///
    /// # Errors
    /// Cancelled; `location` names the step.
    pub fn check(&self, location: &str) -> Result<()> {
        if self.control.is_cancelled() {
            return Err(Error::cancelled(location));
        }
        Ok(())
    }

    /// Ends the process with the exit code of the signal, or 0. Skips the cleanup of libraries at exit, because threads
    /// of graphics drivers may still be running.
    #[cfg(feature = "viewer")]
    pub fn leave(&self) -> ! {
        signal_hook::low_level::exit(self.exit_code.load(Ordering::SeqCst).into())
    }

    /// Exit code of the signal, if one has arrived.
    pub fn exit_code(&self) -> Option<ExitCode> {
        match self.exit_code.load(Ordering::SeqCst) {
            0 => None,
            code => Some(ExitCode::from(code)),
        }
    }

    /// Prints the result of a command as text or, with `--json`, the document.
    ///
    /// # Errors
    /// A stdout that cannot be written; a closed pipe is no error.
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
    pub fn warn(&self, warnings: &[Warning]) {
        for warning in warnings {
            print_stderr(&format!("warning: {warning}"));
        }
    }

    /// Prints a notice, which is not part of the result, to stderr.
    pub fn note(&self, note: &str) {
        print_stderr(note);
    }

    /// Shows the stage and how far it is, where that is wanted and can be shown.
    pub fn bar(&self) -> StageBar {
        let in_lines = self.progress == ProgressForm::Json;
        let is_shown = !self.quiet && !in_lines && std::io::stderr().is_terminal();
        let target = if is_shown {
            ProgressDrawTarget::stderr_with_hz(REFRESH_HZ)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let style = "{prefix:8} {wide_bar} {percent:>3} %  {elapsed} (left {eta}) {msg}";
        bar.set_style(ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()));
        if is_shown {
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        StageBar {
            bar,
            stage: Mutex::new(None),
            last_line: (!self.quiet && in_lines).then(Mutex::default),
        }
    }
}

/// Prints to stdout, with a newline at the end.
///
/// # Errors
/// A stdout that cannot be written; a closed pipe is no error.
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

/// Prints one line to stderr. Control characters, which names from files may contain, become spaces. A failure is
/// ignored: there is nowhere to report it.
fn print_stderr(line: &str) {
    let line: String = line
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Adds the fields of a structure to an object.
pub fn extend(report: &mut Value, fields: &impl Serialize) {
    if let (Value::Object(report), Value::Object(fields)) = (report, json!(fields)) {
        report.extend(fields);
    }
}

/// Formats named values, one per line.
pub fn in_lines(lines: &[(&str, String)]) -> String {
    lines
        .iter()
        .map(|(name, value)| format!("{name:<9} {value}\n"))
        .collect()
}

/// Formats a size with its unit.
pub fn bytes(count: u64) -> String {
    match count {
        0..1_000 => format!("{count} B"),
        1_000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", count as f64 / 1e6),
        _ => format!("{:.2} GB", count as f64 / 1e9),
    }
}

/// Redraws per second.
const REFRESH_HZ: u8 = 10;

/// Least time between two lines on the same stage.
const BETWEEN_LINES: Duration = Duration::from_millis(100);

/// A progress bar that is cleared on drop.
pub struct StageBar {
    bar: ProgressBar,
    stage: Mutex<Option<Stage>>,
    /// What the last line was about and when it was written, where progress is told in lines.
    last_line: Option<Mutex<Option<(Stage, Instant)>>>,
}

impl StageBar {
    /// A line for programs: of every stage, its end, and no more often than people look.
    fn tell(&self, stage: Stage, done: u64, total: u64) {
        let Some(Ok(mut last)) = self.last_line.as_ref().map(Mutex::lock) else {
            return;
        };
        let is_due = last.is_none_or(|(told, at)| told != stage || at.elapsed() >= BETWEEN_LINES);
        if is_due || done == total {
            *last = Some((stage, Instant::now()));
            let line = json!({ "stage": stage.name(), "done": done, "total": total });
            print_stderr(&line.to_string());
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
        self.tell(stage, done, total);
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
