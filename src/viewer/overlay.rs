//! What stands over the picture: how the first bake gets on, and what went wrong.

use egui::{Align2, Color32, FontId, Rect, Ui, pos2, vec2};

use super::panel::Facts;
use super::worker::BakeState;

const TEXT: Color32 = Color32::from_gray(230);
const SIZE: f32 = 16.0;

/// Shows the picture in the space that is left, with what is to be told over it; returns where it lies.
pub fn show(ui: &mut Ui, picture: egui::TextureId, facts: &Facts<'_>, notice: Option<&str>) -> Rect {
    let rect = ui.available_rect_before_wrap();
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(picture, rect, whole, Color32::WHITE);
    let text = notice.map(str::to_owned).or_else(|| caveat(facts));
    if let Some(text) = text {
        let width = rect.width() - 48.0;
        let galley = ui.painter().layout(text, FontId::proportional(SIZE), TEXT, width);
        let place = Align2::CENTER_TOP.align_size_within_rect(galley.size(), rect.shrink(24.0));
        ui.painter().rect_filled(
            place.expand2(vec2(12.0, 8.0)),
            6.0,
            Color32::from_black_alpha(190),
        );
        ui.painter().galley(place.min, galley, TEXT);
    }
    rect
}

/// Says why the picture is dark or coarse.
fn caveat(facts: &Facts<'_>) -> Option<String> {
    let is_dark = facts.layers.is_empty();
    match facts.state {
        BakeState::Baking { stage, fraction, .. } if is_dark => {
            Some(format!("First look: {} {:.0} %", stage.name(), 100.0 * fraction))
        }
        BakeState::Failed(sentence) if is_dark => Some(sentence.clone()),
        BakeState::Cancelled if is_dark => Some("No light is baked yet: press R to bake.".into()),
        BakeState::Done if is_dark => Some("No light reaches a surface that could show it.".into()),
        BakeState::Cancelled if facts.last.is_some_and(|last| !last.is_final) => {
            Some("Coarse maps of a bake that was stopped: press R to bake.".into())
        }
        _ => None,
    }
}
