//! Section *Frame time*: GPU time of each pass of the last pictures, stacked.

use egui::{Align2, Color32, FontId, Rect, RichText, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::effects::COUNTER;
use crate::eye_pass::renderer::GpuMs;
use crate::viewer::timing::{FrameStats, FrameTimes, PICTURES};

/// Height of the graph [points].
const HEIGHT: f32 = 64.0;
const MARKS: Color32 = Color32::from_gray(170);

/// Passes from bottom to top: name, colour and tooltip.
const PASSES: [(&str, Color32, &str); 3] = [
    (
        "opaque",
        Color32::from_rgb(105, 150, 205),
        "Surfaces without chains.",
    ),
    (
        "specular",
        Color32::from_rgb(240, 180, 80),
        "Mirrors, coats and clear bodies.",
    ),
    (
        "tone mapping",
        Color32::from_rgb(120, 200, 130),
        "From radiance to what the display shows.",
    ),
];
const GRAPH: &str = "Milliseconds on the graphics device for each of the last 120 pictures that it has told of, the \
                     newest at the right; the panel itself is not counted. A window at rest draws no pictures.";
const CANNOT_TELL: &str = "This graphics device does not tell how long it takes.";
const HOW: &str = "While the camera moves and pictures are late, what is seen in mirrors and through glass is traced \
                   more coarsely; at rest, pictures of one view are averaged until their edges are smooth.";
const NOT_YET: &str = "Known with the first picture.";

/// Title of the section, with the latest time.
pub fn title(times: Option<&FrameTimes>) -> String {
    match times.and_then(FrameTimes::newest) {
        Some(newest) => {
            let coarse = times
                .and_then(coarseness)
                .map_or(String::new(), |part| format!(", {part}"));
            format!("Frame time ({:.2} ms{coarse})", newest.sum())
        }
        None => "Frame time".into(),
    }
}

/// Shows the section; `None` if the device cannot measure times.
pub fn show(ui: &mut Ui, times: Option<&FrameTimes>) {
    let Some(times) = times else {
        ui.label(RichText::new(CANNOT_TELL).weak());
        return;
    };
    let Some(newest) = times.newest() else {
        ui.label(RichText::new(NOT_YET).weak());
        return;
    };
    graph(ui, times);
    if let Some(made) = times.made {
        ui.label(RichText::new(made_how(made)).size(COUNTER))
            .on_hover_text(HOW);
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        let text = |text: String| RichText::new(text).size(COUNTER);
        ui.label(text(format!("{:.2} ms", newest.sum())).strong())
            .on_hover_text("All passes of the newest picture.");
        for ((name, colour, what), ms) in PASSES.into_iter().zip(by_pass(*newest)) {
            ui.label(text(format!("{name} {ms:.2}")).color(colour))
                .on_hover_text(what);
        }
    });
}

/// Note for the title if reflections and refractions are traced below the frame's resolution.
fn coarseness(times: &FrameTimes) -> Option<String> {
    let scale = times.made?.traced_scale?;
    (scale < 1.0).then(|| format!("mirrors and glass at 1/{:.0}", 1.0 / scale))
}

fn made_how(made: FrameStats) -> String {
    let traced = match made.traced_scale {
        None => "nothing traced".to_string(),
        Some(scale) if scale < 1.0 => format!("traced at 1/{:.0} of the resolution", 1.0 / scale),
        Some(scale) => format!("traced {:.0} times a pixel", scale * scale),
    };
    format!("{traced}, mean of {} pictures", made.samples)
}

fn by_pass(ms: GpuMs) -> [f64; 3] {
    [ms.opaque, ms.specular, ms.tone_mapping]
}

fn graph(ui: &mut Ui, times: &FrameTimes) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let scale_ms = scale_ms(times.longest_ms());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    for column in columns(times, scale_ms, rect) {
        for (bar, (_, colour, _)) in column.into_iter().zip(PASSES) {
            painter.rect_filled(bar, 0.0, colour);
        }
    }
    let place = rect.left_top() + vec2(4.0, 2.0);
    let font = FontId::proportional(COUNTER);
    painter.text(place, Align2::LEFT_TOP, format!("{scale_ms} ms"), font, MARKS);
    let count = times.iter().len();
    let longest = times.longest_ms();
    let text = format!("Device times of {count} pictures, at most {longest:.2} ms");
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, text.as_str()));
    response.on_hover_text(GRAPH);
}

/// Range of the graph [ms]: the smallest of 1, 2 and 5 times a power of ten that covers the longest time.
pub fn scale_ms(longest_ms: f64) -> f64 {
    // 0.1 ms to 100 s.
    let powers = (-1..=4).map(|power| 10_f64.powi(power));
    let mut steps = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * power));
    steps.find(|step| *step >= longest_ms).unwrap_or(1e5)
}

/// Stacked bars of each picture within `rect`, by pass from bottom to top. There is one column per picture kept, with
/// the latest at the right edge. Bars are clipped at the top.
pub fn columns(times: &FrameTimes, scale_ms: f64, rect: Rect) -> Vec<[Rect; 3]> {
    let width = rect.width() / PICTURES as f32;
    let first = PICTURES - times.iter().len();
    let column = |(index, ms): (usize, &GpuMs)| {
        let left = rect.left() + (first + index) as f32 * width;
        let mut reached_ms = 0.0;
        by_pass(*ms).map(|pass_ms| {
            let height = |ms: f64| rect.bottom() - (ms / scale_ms).min(1.0) as f32 * rect.height();
            let bottom = height(reached_ms);
            reached_ms += pass_ms;
            Rect::from_min_max(pos2(left, height(reached_ms)), pos2(left + width, bottom))
        })
    };
    times.iter().enumerate().map(column).collect()
}
