//! The picture as files.

use std::path::PathBuf;

use super::App;
use super::drawing::without_backdrop;
use crate::error::{Error, Result};
use crate::viewer::files::working_folder;
use crate::viewer::panel::Quantity;
use crate::viewer::screenshot;
use serde_json::json;

impl App {
    /// Writes the picture to files in the working folder, and tells where over the picture.
    pub(super) fn save_picture(&mut self) {
        let outcome = self.written_picture();
        let notice = match &outcome {
            Ok(files) => {
                self.model.log.write("saved", json!({"files": files}));
                screenshot::told(files)
            }
            Err(error) => {
                let sentence = error.to_string();
                self.model.log.write("not_saved", json!({"sentence": sentence}));
                sentence
            }
        };
        self.notice = Some(notice);
        self.request_redraw();
    }

    pub(super) fn written_picture(&mut self) -> Result<Vec<PathBuf>> {
        let white_balance = self.white_balance();
        let (Some(view), Some(graphics)) = (self.view(), &mut self.graphics) else {
            return Err(Error::failure(
                "picture",
                "the window has no room for it",
                "make the window larger",
            ));
        };
        let view = without_backdrop(view);
        let picture = graphics.radiance(&view)?;
        let folder = working_folder();
        // False colours are no radiance.
        let has_radiance = self.model.quantity() == Quantity::Light;
        let scene = &self.model.scene().name;
        screenshot::save(&folder, scene, &picture, &view, &white_balance, has_radiance)
    }
}
