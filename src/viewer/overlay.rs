//! Text over the picture: progress of the first bake, errors, and legends of false colours.

use egui::{Align2, Color32, FontId, Rect, Ui, pos2, vec2};

use super::false_colours::{self, ERROR_RANGE, RANGE_NM};
use super::model::Model;
use super::panel::Quantity;
use super::panel::control::short;
use super::worker::BakeState;
use crate::illumination::difference_colours;
use crate::illumination::false_colours::viridis;
use crate::optics::{LinearSrgb, Nanometres};

const TEXT: Color32 = Color32::from_gray(230);
const SIZE: f32 = 16.0;

/// Shows the picture in the remaining space, with messages and legends over it; returns its rectangle.
pub fn show(ui: &mut Ui, picture: egui::TextureId, model: &Model, notice: Option<&str>) -> Rect {
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
    if let Some(shown) = legend(model) {
        draw(ui, rect, &shown);
    }
    rect
}

/// Colours and marks by position on a scale, [0, 1].
struct Legend {
    title: String,
    colour: Box<dyn Fn(f64) -> [u8; 3]>,
    marks: Vec<(f64, String)>,
}

impl Legend {
    /// With marks at equal steps, the last one being number `last`.
    fn new(
        title: impl Into<String>,
        last: i32,
        mark: impl Fn(f64) -> String,
        colour: impl Fn(f64) -> [u8; 3] + 'static,
    ) -> Self {
        let places = (0..=last).map(|step| f64::from(step) / f64::from(last));
        Self {
            title: title.into(),
            colour: Box::new(colour),
            marks: places.map(|place| (place, mark(place))).collect(),
        }
    }
}

/// The legend of the quantity shown, if it has one.
fn legend(model: &Model) -> Option<Legend> {
    // Legends use the colour maps of the picture itself, so that both always agree.
    let (quantity, choice) = (model.quantity(), &model.choices.display.scale);
    let scale = model.survey.scale(quantity, choice);
    let byte = |value: f64| (255.0 * value).round() as u8;
    let of_scale = |title: String, factor: f64| {
        let colour = move |place: f64| viridis(place).map(byte);
        Legend::new(title, 4, |place| short(factor * scale.at(place)), colour)
    };

    Some(match (quantity, model.worth.as_ref()) {
        (Quantity::Error, _) => {
            let (low, high) = ERROR_RANGE;
            let at = move |place: f64| low * (high / low).powf(place);
            let title = "Estimated error of each texel, in % of its map's mean irradiance";
            // Rounds off floating-point noise.
            let mark = |place: f64| format!("{} %", (1e5 * at(place)).round() / 1e3);
            Legend::new(title, 3, mark, move |place| {
                false_colours::error_colour(at(place))
            })
        }
        (Quantity::Difference, Some(worth)) => {
            let name = worth.effect.name().replace('_', " ");
            let title = format!("What {name} adds (warm) or takes (cool), in % of the map's mean");
            // Powers of ten to both sides of zero, from −1000 % to +1000 %.
            let mark = |place: f64| match (6.0 * place).round() as i32 - 3 {
                0 => "0".into(),
                power if power < 0 => format!("−{}", 10_i32.pow(-power as u32)),
                power => format!("+{}", 10_i32.pow(power as u32)),
            };
            let at = |place: f64| difference_colours::at(2.0 * place - 1.0);
            Legend::new(title, 6, mark, move |place| difference_colours::colour(at(place)))
        }
        (Quantity::Irradiance, _) => {
            let title = format!("Irradiance of the light shown [{}]", choice.unit.symbol());
            of_scale(title, choice.unit.per_w_m2())
        }
        (Quantity::TexelDensity, _) => of_scale("Texels per metre".into(), 1.0),
        (Quantity::Wavelength, _) => {
            let (low, high) = RANGE_NM;
            let at = move |place: f64| Nanometres(low + (high - low) * place);
            let title = "Dominant wavelength of the light shown [nm]; grey: white";
            let colour = move |place: f64| {
                let linear = false_colours::wavelength_colour(at(place)).to_array();
                linear.map(|channel| byte(LinearSrgb::encode_channel(channel)))
            };
            Legend::new(title, 6, |place| format!("{:.0}", at(place).0), colour)
        }
        _ => return None,
    })
}

/// Draws a legend at the picture's lower edge.
fn draw(ui: &Ui, picture: Rect, shown: &Legend) {
    const BAR: egui::Vec2 = vec2(300.0, 14.0);
    const STEPS: usize = 150;
    let painter = ui.painter();
    let font = FontId::proportional(13.0);
    let title = painter.layout_no_wrap(shown.title.clone(), FontId::proportional(11.5), TEXT);
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
        let [r, g, b] = (shown.colour)((index as f64 + 0.5) / STEPS as f64);
        let left = bar.left() + index as f32 * step;
        let part = Rect::from_min_max(pos2(left, bar.top()), pos2(left + step + 0.5, bar.bottom()));
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    for (share, text) in &shown.marks {
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
