//! Ctrl-C and SIGTERM: the first stops the work, what there is is kept; the second stops at once. A file beyond the
//! system's limit fails as a full disk does.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use nephroid::error::{Error, Result};
use nephroid::progress::Control;
#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

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

    /// The exit code that a signal calls for, if one came.
    pub fn exit_code(&self) -> Option<ExitCode> {
        match self.exit_code.load(Ordering::SeqCst) {
            0 => None,
            code => Some(ExitCode::from(code)),
        }
    }
}
