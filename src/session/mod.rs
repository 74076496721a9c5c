//! A bake as a session: scene and settings in, maps out.

pub mod result;

use std::sync::Arc;

pub use result::{BakeCounts, BakeResult, StopReason, Timings};

use crate::error::Result;
use crate::plan::EffectPlan;
use crate::progress::{Control, Progress};
use crate::scene::Scene;
use crate::settings::BakeSettings;

/// Owns a scene with all that is derived from it, and bakes it as often as settings change.
#[derive(Debug)]
pub struct BakeSession {
    scene: Arc<Scene>,
}

impl BakeSession {
    /// A session on a scene; builds nothing yet.
    ///
    /// # Errors
    /// None yet.
    pub fn new(scene: Arc<Scene>) -> Result<Self> {
        Ok(Self { scene })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Which effects the scene calls for under these settings.
    ///
    /// # Errors
    /// Settings outside their ranges.
    pub fn plan(&mut self, settings: &BakeSettings) -> Result<EffectPlan> {
        settings.validate()?;
        Ok(EffectPlan::default())
    }

    /// Bakes. Cancelled bakes return what they have, marked partial.
    ///
    /// # Errors
    /// Settings outside their ranges; maps that do not fit into memory.
    pub fn bake(
        &mut self,
        settings: &BakeSettings,
        progress: &dyn Progress,
        control: &Control,
    ) -> Result<BakeResult> {
        settings.validate()?;
        let _ = (progress, control);
        Ok(BakeResult {
            maps: Vec::new(),
            plan: EffectPlan::default(),
            ledgers: Vec::new(),
            counts: BakeCounts::default(),
            timings_s: Timings::default(),
            cpu_s: Timings::default(),
            stop_reason: StopReason::NothingToDo,
            partial: false,
            warnings: Vec::new(),
        })
    }
}
