//! Maps to compare with: earlier ones that the user kept, or those of a folder. The right part of the picture shows
//! them from the same camera and with the same colours.

use std::path::Path;
use std::sync::Arc;

use egui::{Align2, Color32, CursorIcon, FontId, Rect, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::panel::control::short;
use crate::error::{Error, Result};
use crate::export::map_set::MapSet;
use crate::illumination::IlluminationMap;
use crate::illumination::difference::difference;
use crate::scene::Scene;

#[derive(Clone, Debug)]
pub struct SavedMaps {
    /// Name in the window.
    pub name: String,
    /// The scene that is shown with the maps.
    pub scene: Arc<Scene>,
    /// All layers.
    pub maps: Arc<[IlluminationMap]>,
    /// sqrt(mean((present − reference)²)) / mean(reference), weighted by area, of the luminance of all layers; or the
    /// reason why it is undefined.
    pub relative_rmse: std::result::Result<f64, String>,
}

impl SavedMaps {
    /// Keeps the present maps as the reference.
    ///
    /// # Errors
    /// There are no maps.
    pub fn kept(scene: &Arc<Scene>, maps: &[IlluminationMap]) -> Result<Self> {
        if maps.is_empty() {
            return Err(Error::usage(
                "compare",
                "there are no maps to keep yet",
                "bake first",
            ));
        }
        Ok(Self::new("before", scene, maps.to_vec()))
    }

    /// Reads maps of the scene from a folder.
    ///
    /// # Errors
    /// As [`MapSet::read_all`].
    pub fn of_folder(folder: &Path, scene: &Arc<Scene>) -> Result<Self> {
        let maps = MapSet::open(folder, scene)?.read_all()?;
        let name = folder.file_name().unwrap_or(folder.as_os_str());
        Ok(Self::new(&name.to_string_lossy(), scene, maps))
    }

    fn new(name: &str, scene: &Arc<Scene>, maps: Vec<IlluminationMap>) -> Self {
        Self {
            name: name.to_owned(),
            scene: Arc::clone(scene),
            maps: maps.into(),
            relative_rmse: Err("not compared yet".into()),
        }
    }

    /// The difference between the present maps and the reference, in words.
    pub fn in_words(&self) -> String {
        match &self.relative_rmse {
            Ok(rmse) => format!(
                "differs from {} by {} % (relative RMSE)",
                self.name,
                short(100.0 * rmse)
            ),
            Err(why) => format!("{}: {why}", self.name),
        }
    }

    /// Compares with new present maps.
    pub fn compare(&mut self, present: &[IlluminationMap]) {
        self.relative_rmse = match difference(&self.maps, present) {
            Ok(found) => found
                .relative_rmse
                .ok_or_else(|| format!("{} is dark", self.name)),
            Err(error) => Err(error.to_string()),
        };
    }
}

/// Name for assistive technology.
const DIVIDER: &str = "Divider";
/// Width of the divider's drag area [points].
const GRIP: f32 = 12.0;
/// Space above and below the drag area [points].
const BORDER: f32 = 20.0;
/// Smallest distance of the divider from the picture's border, as a fraction of the picture's width.
const LEAST: f32 = 0.02;

/// Draws the reference right of the divider, over the picture, and handles drags of the divider.
pub fn show(
    ui: &mut Ui,
    picture: Rect,
    divider: &mut f32,
    (beside, reference): (egui::TextureId, &SavedMaps),
) {
    let line = |share: f32| picture.left() + share * picture.width();

    // The divider follows the drag and stays within the picture.
    let grip = Rect::from_center_size(
        pos2(line(*divider), picture.center().y),
        vec2(GRIP, picture.height() - 2.0 * BORDER),
    );
    let response = ui
        .interact(grip, ui.scope_id().with(DIVIDER), Sense::drag())
        .on_hover_cursor(CursorIcon::ResizeHorizontal);
    let share = f64::from(*divider);
    response.widget_info(|| WidgetInfo::slider(true, share, DIVIDER));
    if response.dragged() && picture.width() > 0.0 {
        *divider = (*divider + response.drag_delta().x / picture.width()).clamp(LEAST, 1.0 - LEAST);
    }

    // The reference covers the part to the right of it.
    let x = line(*divider);
    let right = Rect::from_min_max(pos2(x, picture.top()), picture.max);
    let part = Rect::from_min_max(pos2(*divider, 0.0), pos2(1.0, 1.0));
    let painter = ui.painter().with_clip_rect(picture);
    painter.image(beside, right, part, Color32::WHITE);
    painter.vline(x, picture.y_range(), Stroke::new(2.0, Color32::from_gray(235)));

    // Labels on both sides say which maps are which.
    let say = |at: egui::Pos2, align: Align2, text: &str| {
        let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), Color32::WHITE);
        let place = align.anchor_size(at, galley.size());
        painter.rect_filled(place.expand2(vec2(6.0, 3.0)), 4.0, Color32::from_black_alpha(190));
        painter.galley(place.min, galley, Color32::WHITE);
    };
    let top = picture.top() + 70.0;
    say(pos2(x - 12.0, top), Align2::RIGHT_TOP, "now");
    say(pos2(x + 12.0, top), Align2::LEFT_TOP, &reference.name);
    say(
        pos2(x + 12.0, top + 24.0),
        Align2::LEFT_TOP,
        &reference.in_words(),
    );
}
