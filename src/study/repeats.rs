//! Bakes that are done over and over, and what counts of them.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::session::{BakeResult, BakeSession};
use crate::settings::BakeSettings;

/// Bakes in a session of its own, so that no bake finds the work of another done.
///
/// # Errors
/// Those of a bake; stopped before the end.
pub(super) fn bake(
    scene: &Arc<Scene>,
    settings: &BakeSettings,
    progress: &dyn Progress,
    control: &Control,
) -> Result<BakeResult> {
    let result = BakeSession::new(scene.clone())?.bake(settings, progress, control)?;
    if result.partial {
        return Err(Error::cancelled(&scene.source));
    }
    Ok(result)
}

/// Item buffers, tracing and depositing: all of the light pass but the hierarchy [s of CPU].
pub(super) fn light_pass_cpu_s(result: &BakeResult) -> f64 {
    result.cpu_s.plan + result.cpu_s.trace + result.cpu_s.deposit
}

/// The middle of an odd number of values, the lower middle of an even one; 0 of none.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values
        .get(values.len().saturating_sub(1) / 2)
        .copied()
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slow_run_does_not_move_the_median() {
        assert!((median(vec![3.0, 1.0, 100.0]) - 3.0).abs() < 1e-15);
        assert!((median(vec![2.0, 1.0]) - 1.0).abs() < 1e-15);
        assert!(median(Vec::new()).abs() < 1e-15);
    }
}
