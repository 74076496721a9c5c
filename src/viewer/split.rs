//! The picture in two parts: left the present maps, right those that they are held against, and a line to be dragged.

use egui::{Align2, Color32, CursorIcon, FontId, Rect, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::beside::Reference;

/// Its name to assistive technology.
const DIVIDER: &str = "Divider";
/// Width that takes the mouse [points].
const GRIP: f32 = 12.0;
/// Left free above and below it [points].
const BORDER: f32 = 20.0;
/// Nearest to the picture's border, as a share of its width.
const LEAST: f32 = 0.02;

/// Shows the right part over the whole picture, and lets the divider be dragged.
pub fn show(
    ui: &mut Ui,
    picture: Rect,
    divider: &mut f32,
    (beside, reference): (egui::TextureId, &Reference),
) {
    let line = |share: f32| picture.left() + share * picture.width();
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
    let x = line(*divider);
    let right = Rect::from_min_max(pos2(x, picture.top()), picture.max);
    let part = Rect::from_min_max(pos2(*divider, 0.0), pos2(1.0, 1.0));
    let painter = ui.painter().with_clip_rect(picture);
    painter.image(beside, right, part, Color32::WHITE);
    painter.vline(x, picture.y_range(), Stroke::new(2.0, Color32::from_gray(235)));
    let say = |at: egui::Pos2, align: Align2, text: &str| {
        let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), Color32::WHITE);
        let place = align.anchor_size(at, galley.size());
        painter.rect_filled(place.expand2(vec2(6.0, 3.0)), 4.0, Color32::from_black_alpha(190));
        painter.galley(place.min, galley, Color32::WHITE);
    };
    let top = picture.top() + 70.0;
    say(pos2(x - 12.0, top), Align2::RIGHT_TOP, "now");
    say(pos2(x + 12.0, top), Align2::LEFT_TOP, &reference.name);
    say(pos2(x + 12.0, top + 24.0), Align2::LEFT_TOP, &reference.told());
}
