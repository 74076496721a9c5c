//! Tests whose input is not there: loudly counted, never a pass.

use std::io::Write as _;

/// Says that a test was skipped and why, past the test harness's capture, so that `tests/run` counts it.
///
/// # Panics
/// With CI=true.
pub fn skip(test: &str, reason: &str) {
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "{test} was skipped ({reason}), which CI=true does not allow"
    );
    let _ = writeln!(std::io::stderr(), "skipped: {test}: {reason}");
}
