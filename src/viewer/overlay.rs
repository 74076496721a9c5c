//! Text over the picture: progress of the first bake, errors, and legends of false colours.

use egui::{Align2, Color32, FontId, Rect, Ui, pos2, vec2};

use super::false_colours::{self, ERROR_RANGE, RANGE_NM};
use super::model::Model;
use super::panel::Quantity;
use super::panel::control::short;
use super::worker::BakeState;
use crate::effect::Effect;
use crate::illumination::difference_colours;
use crate::illumination::false_colours::{ColourScale, viridis};
use crate::optics::{LinearSrgb, Nanometres};

const TEXT: Color32 = Color32::from_gray(230);
const SIZE: f32 = 16.0;

/// Shows the picture in the remaining space, with messages and legends over it; returns its rectangle.
pub fn show(ui: &mut Ui, picture: egui::TextureId, model: &Model, notice: Option<&str>) -> Rect {
    let (quantity, choice) = (model.quantity(), &model.choices.display.scale);
    let rect = ui.available_rect_before_wrap();
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(picture, rect, whole, Color32::WHITE);
    let text = notice.map(str::to_owned).or_else(|| caveat(model));
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
    match (quantity, model.worth.as_ref()) {
        (Quantity::Error, _) => error_legend(ui, rect),
        (Quantity::Difference, Some(worth)) => difference_legend(ui, rect, worth.effect),
        (Quantity::Irradiance, _) => {
            let title = format!("Irradiance of the light shown [{}]", choice.unit.symbol());
            let scale = model.survey.scale(quantity, choice);
            scale_legend(ui, rect, &title, &scale, choice.unit.per_w_m2());
        }
        (Quantity::TexelDensity, _) => {
            let scale = model.survey.scale(quantity, choice);
            scale_legend(ui, rect, "Texels per metre", &scale, 1.0);
        }
        (Quantity::Wavelength, _) => wavelength_legend(ui, rect),
        _ => {}
    }
    rect
}

fn wavelength_legend(ui: &Ui, picture: Rect) {
    let (low, high) = RANGE_NM;
    let at = |share: f64| Nanometres(low + (high - low) * share);
    let marks = (0..=6).map(|mark| f64::from(mark) / 6.0);
    let marks: Vec<_> = marks
        .map(|share| (share, format!("{:.0}", at(share).0)))
        .collect();
    let colour = |share: f64| {
        let linear = false_colours::wavelength_colour(at(share)).to_array();
        linear.map(|channel| (255.0 * LinearSrgb::encode_channel(channel)).round() as u8)
    };
    legend(
        ui,
        picture,
        "Dominant wavelength of the light shown [nm]; grey: white",
        &colour,
        &marks,
    );
}

/// Legend with five marks, whose values are multiplied by `factor`.
fn scale_legend(ui: &Ui, picture: Rect, title: &str, scale: &ColourScale, factor: f64) {
    let marks = (0..=4).map(|mark| f64::from(mark) / 4.0);
    let marks: Vec<_> = marks
        .map(|place| (place, short(factor * scale.at(place))))
        .collect();
    let colour = |place: f64| viridis(place).map(|value| (255.0 * value).round() as u8);
    legend(ui, picture, title, &colour, &marks);
}

fn error_legend(ui: &Ui, picture: Rect) {
    let (low, high) = ERROR_RANGE;
    let at = |share: f64| low * (high / low).powf(share);
    let marks = (0..=3).map(|mark| f64::from(mark) / 3.0);
    // Rounds off floating-point noise.
    let marks: Vec<_> = marks
        .map(|share| (share, format!("{} %", (1e5 * at(share)).round() / 1e3)))
        .collect();
    let title = "Estimated error of each texel, in % of its map's mean irradiance";
    legend(
        ui,
        picture,
        title,
        &|share| false_colours::error_colour(at(share)),
        &marks,
    );
}

fn difference_legend(ui: &Ui, picture: Rect, effect: Effect) {
    let at = |share: f64| difference_colours::at(2.0 * share - 1.0);
    let marks = (-3..=3).map(|mark| {
        let text = match mark {
            -3..=-1 => format!("−{}", 10_i32.pow(-mark as u32)),
            0 => "0".into(),
            _ => format!("+{}", 10_i32.pow(mark as u32)),
        };
        (f64::from(mark + 3) / 6.0, text)
    });
    let name = effect.name().replace('_', " ");
    let title = format!("What {name} adds (warm) or takes (cool), in % of the map's mean");
    let colour = |share: f64| difference_colours::colour(at(share));
    legend(ui, picture, &title, &colour, &marks.collect::<Vec<_>>());
}

/// Draws a legend at the picture's lower edge. `colour` and `marks` are given by position on the scale, [0, 1].
fn legend(ui: &Ui, picture: Rect, title: &str, colour: &dyn Fn(f64) -> [u8; 3], marks: &[(f64, String)]) {
    const BAR: egui::Vec2 = vec2(300.0, 14.0);
    const STEPS: usize = 150;
    let painter = ui.painter();
    let font = FontId::proportional(13.0);
    let title = painter.layout_no_wrap(title.to_owned(), FontId::proportional(11.5), TEXT);
    let size = vec2(BAR.x.max(title.size().x - 16.0), BAR.y) + vec2(48.0, 56.0);
    let frame = Rect::from_min_size(picture.left_bottom() + vec2(16.0, -16.0 - size.y), size);
    painter.rect_filled(frame, 6.0, Color32::from_black_alpha(190));
    let bar = Rect::from_min_size(pos2(frame.center().x - 0.5 * BAR.x, frame.top() + 28.0), BAR);
    let place = pos2(
        frame.center().x - 0.5 * title.size().x,
        frame.top() + 14.0 - 0.5 * title.size().y,
    );
    painter.galley(place, title, TEXT);
    let step = bar.width() / STEPS as f32;
    for index in 0..STEPS {
        let [r, g, b] = colour((index as f64 + 0.5) / STEPS as f64);
        let left = bar.left() + index as f32 * step;
        let part = Rect::from_min_max(pos2(left, bar.top()), pos2(left + step + 0.5, bar.bottom()));
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    for (share, text) in marks {
        let place = pos2(bar.left() + bar.width() * *share as f32, bar.bottom() + 8.0);
        painter.text(place, Align2::CENTER_CENTER, text, font.clone(), TEXT);
    }
}

/// Explains why the picture is dark or coarse.
fn caveat(model: &Model) -> Option<String> {
    let is_dark = model.layers().is_empty();
    match &model.state {
        BakeState::Baking { stage, fraction, .. } if is_dark => {
            Some(format!("First look: {} {:.0} %", stage.name(), 100.0 * fraction))
        }
        BakeState::Failed(sentence) if is_dark => Some(sentence.clone()),
        BakeState::Cancelled if is_dark => Some("No light is baked yet: press R to bake.".into()),
        BakeState::Done if is_dark => Some("No light reaches a surface that could show it.".into()),
        BakeState::Cancelled if model.last.as_ref().is_some_and(|last| !last.is_final) => {
            Some("Coarse maps of a bake that was stopped: press R to bake.".into())
        }
        _ => None,
    }
}
