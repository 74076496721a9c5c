//! What the maps are held against: other maps, and those without an effect.

use std::sync::Arc;

use serde_json::json;

use super::Model;
use crate::effect::Effect;
use crate::illumination::IlluminationMap;
use crate::illumination::difference::Difference;
use crate::scene::Scene;
use crate::viewer::beside::Reference;
use crate::viewer::command::CompareCommand;
use crate::viewer::event_log;
use crate::viewer::panel::Quantity;
use crate::viewer::worker::{BakedLevel, Worth};

impl Model {
    /// What an effect adds to the maps that are shown or takes from them, where that was found.
    pub(super) fn difference(&self) -> Option<&Difference> {
        self.worth.as_ref()?.difference.as_ref().ok()
    }

    /// The reference's maps as they are to be shown.
    pub fn reference_to_show(&self) -> Option<(&Arc<Scene>, Vec<IlluminationMap>)> {
        let reference = self.reference.as_ref()?;
        Some((&reference.scene, self.as_shown(&reference.maps).into_owned()))
    }

    /// Begins or ends a comparison.
    pub(super) fn compare_with(&mut self, wish: &CompareCommand) {
        let scene = self.edits.scene();
        let reference = match wish {
            CompareCommand::Keep => Reference::kept(scene, self.maps()).map(Some),
            CompareCommand::Load(folder) => Reference::of_folder(folder, scene).map(Some),
            CompareCommand::End => Ok(None),
        };
        match reference {
            Ok(reference) => {
                self.reference = reference;
                self.refusal = None;
                self.compare_again();
            }
            Err(error) => self.refusal = Some(error.to_string()),
        }
    }

    /// Holds the maps that are shown now against the reference.
    pub(super) fn compare_again(&mut self) {
        let present = self.last.as_ref().map_or(&self.given, |last| &last.result.maps);
        if let Some(reference) = &mut self.reference {
            reference.compare(present);
            let relative_rmse = reference.relative_rmse.as_ref().ok();
            let more = json!({"name": reference.name, "relative_rmse": relative_rmse});
            self.log.write("against", more);
        }
    }

    /// Shows what an effect is worth; tells whether there is anything new to be shown.
    pub(super) fn take_worth(&mut self, worth: Worth) -> bool {
        let is_of_shown = |last: &Arc<BakedLevel>| Arc::ptr_eq(last, &worth.with);
        if !self.last.as_ref().is_some_and(is_of_shown) {
            return false;
        }
        self.log.write("compared", event_log::compared(&worth));
        if worth.difference.is_ok() {
            self.choices.display.quantity = Quantity::Difference;
        }
        self.worth = Some(worth);
        true
    }

    /// Finds what an effect is worth to the maps that are shown, once these are done.
    pub(super) fn compare(&mut self, effect: Effect) {
        let Some(last) = self.last.as_ref().filter(|last| last.is_final) else {
            return;
        };
        if self.worker.compare(effect, Arc::clone(last)) {
            self.state = self.worker.state();
        }
    }
}
