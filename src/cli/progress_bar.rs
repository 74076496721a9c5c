//! A bar on stderr during long work.

use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use nephroid::progress::{Progress, Stage};

use super::terminal::Terminal;

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
