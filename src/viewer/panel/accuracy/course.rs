//! Error against time: the bake so far, the forecast, and the target on that curve.

use std::ops::RangeInclusive;

use egui::{
    Align2, Color32, FontId, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::super::bake::two_digits;
use super::target::{self, Target};
use crate::bake::forecast::forecast;
use crate::bake::{CostPoint, Forecast};
use crate::settings::{BakeSettings, Preset};
use crate::viewer::worker::BakedLevel;

/// Height of the plot [points].
const HEIGHT: f32 = 132.0;
/// Font size in and below the plot [points].
const SMALL: f32 = 10.5;

const PAST: Color32 = Color32::from_rgb(105, 150, 205);
const FUTURE: Color32 = Color32::from_rgb(240, 180, 80);
const BAND: Color32 = Color32::from_rgba_premultiplied(60, 45, 20, 60);
const MARK: Color32 = Color32::from_gray(105);
const TEXT: Color32 = Color32::from_gray(170);
const TARGET: Color32 = Color32::from_rgb(120, 200, 130);

/// Segments of the expected curve.
const STEPS: usize = 24;
/// Smallest error on the axis, unless the target or the maps are better [1].
const BEST_SHOWN: f64 = 0.002;
/// Largest error on the axis, unless the maps are worse [1].
const WORST_SHOWN: f64 = 0.12;
/// Margin of the axes, as a factor.
const ROOM: f64 = 1.4;

const NAME: &str = "Error against time";
const HOVER: &str = "Estimated error (up) against time of the light pass (right), both logarithmic. Blue: levels of the last bake. \
                     Yellow: what better maps are expected to take, with the doubt about it. Lines: draft, preview, final. Green: \
                     the target; drag it along the curve, by error or, where a time is the target, by time.";
const NOTHING: &str = "Known once the error of a level is.";

/// Title of the subsection, with the cost of the target.
pub fn title(settings: &BakeSettings, last: Option<&BakedLevel>) -> String {
    let line = last.and_then(|last| Curve::new(settings, last)?.headline());
    line.map_or(NAME.into(), |line| format!("{NAME} ({line})"))
}

/// Shows the plot and a summary; dragging in the plot sets the target.
pub fn show(ui: &mut Ui, settings: &mut BakeSettings, last: Option<&BakedLevel>) {
    let curve = last.and_then(|last| Curve::new(settings, last));
    let Some(curve) = curve else {
        ui.label(RichText::new(NOTHING).weak());
        return;
    };
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let frame = Frame::around(&curve, rect);
    draw(ui, &curve, &frame);
    let text = curve.in_words();
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("{NAME}: {text}")));
    if let Some(place) = response.interact_pointer_pos() {
        let (seconds, error) = frame.at(place);
        target::pick(settings, seconds, error);
    }
    response.on_hover_text(HOVER);
    ui.label(RichText::new(text).size(SMALL));
    if let Some(report) = last.and_then(|last| last.result.forecast.filter(|_| last.is_final)) {
        let (made_at, actual) = (report.made_at, report.actual);
        ui.label(RichText::new(format!(
            "expected at {} %: {} s; taken: {} s",
            two_digits(100.0 * made_at.error),
            two_digits(report.expected.wall_s),
            two_digits(actual.wall_s)
        )).size(SMALL))
        .on_hover_text("Time of the light pass to the target as it was expected when the error was first known, and as it was.");
    }
}

/// Content of the plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Levels so far.
    pub past: Vec<CostPoint>,
    /// Forecasts for decreasing errors, from the last level on.
    pub future: Vec<Forecast>,
    /// Forecasts for the presets.
    pub presets: Vec<(Preset, Forecast)>,
    /// The target on the curve; `None` if the target is a density.
    pub target: Option<Forecast>,
}

impl Curve {
    /// `None` if no error is known yet.
    pub fn new(settings: &BakeSettings, last: &BakedLevel) -> Option<Self> {
        let estimator = last.request.settings.estimator;
        let is_shown = |point: &&CostPoint| point.wall_s > 0.0 && point.error > 0.0;
        let past: Vec<CostPoint> = last.result.course.iter().filter(is_shown).copied().collect();
        let reached = past.last()?.error;
        let expected = |target: f64| forecast(&past, target, estimator);
        let picked = Target::of(settings);
        let wanted = match picked {
            Target::Error(error) => error,
            _ => BEST_SHOWN,
        };
        let best = BEST_SHOWN.min(wanted).min(0.7 * reached);
        let at_step = |step: usize| reached * (best / reached).powf(step as f64 / STEPS as f64);
        let future: Vec<Forecast> = (0..=STEPS).filter_map(|step| expected(at_step(step))).collect();
        let target = match picked {
            Target::Error(error) => expected(error),
            Target::Time(seconds) => at_seconds(&past, &future, seconds),
            Target::Density => None,
        };
        let presets = Preset::ALL.map(|preset| Some((preset, expected(preset.max_error())?)));
        Some(Self {
            past,
            future,
            presets: presets.into_iter().flatten().collect(),
            target,
        })
    }

    /// Cost of the target; `None` if the target is a density.
    fn headline(&self) -> Option<String> {
        let target = self.target?;
        let sure = if target.factor > 1.0 { "about " } else { "" };
        let error = two_digits(100.0 * target.target);
        Some(format!("{error} %: {sure}{} s", two_digits(target.wall_s)))
    }

    fn in_words(&self) -> String {
        let now = self.past.last().map_or(String::new(), |last| {
            let error = two_digits(100.0 * last.error);
            format!("{error} % after {} s", two_digits(last.wall_s))
        });
        match self.target {
            Some(target) => format!("{now}; {}", target.in_words()),
            None => now,
        }
    }
}

/// The curve at a given time: a level that was reached by then, or a forecast.
fn at_seconds(past: &[CostPoint], future: &[Forecast], seconds: f64) -> Option<Forecast> {
    let reached = past.iter().rev().find(|point| point.wall_s <= seconds);
    let expected = future.iter().rev().find(|point| point.wall_s <= seconds);
    let error = expected
        .map(|point| point.target)
        .or(reached.map(|point| point.error))?;
    let rays = expected.map_or(0, |point| point.rays);
    Some(Forecast {
        target: error,
        rays: rays.max(reached.map_or(0, |point| point.rays)),
        cpu_s: expected.map_or(0.0, |point| point.cpu_s),
        wall_s: seconds,
        bytes: 0,
        factor: 1.0,
    })
}

/// Logarithmic axes in a rectangle: time to the right, error upwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    rect: Rect,
    /// Range [s].
    pub seconds: RangeInclusive<f64>,
    /// Range [1].
    pub errors: RangeInclusive<f64>,
}

impl Frame {
    /// Axes that enclose the whole curve.
    pub fn around(curve: &Curve, rect: Rect) -> Self {
        let past = curve.past.iter().map(|point| (point.wall_s, point.error));
        let future = curve.future.iter().map(|point| (point.wall_s, point.target));
        let target = curve.target.iter().map(|point| (point.wall_s, point.target));
        let all: Vec<(f64, f64)> = past.chain(future).chain(target).collect();
        let ends = |of: fn(&(f64, f64)) -> f64, low: f64, high: f64| {
            let values = all
                .iter()
                .map(of)
                .filter(|value| *value > 0.0 && value.is_finite());
            let (least, most) = values.fold((low, high), |(low, high), value| {
                (low.min(value), high.max(value))
            });
            least / ROOM..=most * ROOM
        };
        Self {
            rect,
            seconds: ends(|point| point.0, f64::INFINITY, 0.0),
            errors: ends(|point| point.1, BEST_SHOWN, WORST_SHOWN),
        }
    }

    /// Position of a point of the plot.
    pub fn place(&self, seconds: f64, error: f64) -> Pos2 {
        let x = share(&self.seconds, seconds);
        let y = share(&self.errors, error);
        pos2(
            self.rect.left() + x as f32 * self.rect.width(),
            self.rect.bottom() - y as f32 * self.rect.height(),
        )
    }

    /// Time [s] and error at a position.
    pub fn at(&self, place: Pos2) -> (f64, f64) {
        let x = f64::from((place.x - self.rect.left()) / self.rect.width()).clamp(0.0, 1.0);
        let y = f64::from((self.rect.bottom() - place.y) / self.rect.height()).clamp(0.0, 1.0);
        (value(&self.seconds, x), value(&self.errors, y))
    }
}

fn share(range: &RangeInclusive<f64>, value: f64) -> f64 {
    ((value / range.start()).ln() / (range.end() / range.start()).ln()).clamp(0.0, 1.0)
}

fn value(range: &RangeInclusive<f64>, share: f64) -> f64 {
    range.start() * (range.end() / range.start()).powf(share)
}

/// Powers of ten within a range.
fn decades(range: &RangeInclusive<f64>) -> impl Iterator<Item = f64> {
    let (first, last) = (
        range.start().log10().ceil() as i32,
        range.end().log10().floor() as i32,
    );
    (first..=last).map(|power| 10_f64.powi(power))
}

fn draw(ui: &Ui, curve: &Curve, frame: &Frame) {
    let painter = ui.painter_at(frame.rect);
    painter.rect_filled(frame.rect, 2.0, ui.visuals().extreme_bg_color);
    let write = |at: Pos2, align: Align2, text: String| {
        painter.text(at, align, text, FontId::proportional(SMALL), TEXT);
    };

    // The grid: powers of ten of time, and the errors of the presets.
    for seconds in decades(&frame.seconds) {
        let foot = frame.place(seconds, *frame.errors.start());
        painter.line_segment([foot, pos2(foot.x, frame.rect.top())], Stroke::new(0.5, MARK));
        write(
            foot - vec2(-2.0, 1.0),
            Align2::LEFT_BOTTOM,
            format!("{seconds} s"),
        );
    }
    for (preset, expected) in &curve.presets {
        let right = frame.place(*frame.seconds.end(), expected.target);
        painter.line_segment([pos2(frame.rect.left(), right.y), right], Stroke::new(0.5, MARK));
        let label = format!("{} {} %", preset.name(), 100.0 * expected.target);
        write(right - vec2(2.0, 0.0), Align2::RIGHT_BOTTOM, label);
    }

    // A forecast may be off by a factor of time, which makes a band as wide to both sides on a logarithmic axis.
    for pair in curve.future.windows(2) {
        let edge = |point: &Forecast, times: f64| frame.place(point.wall_s * times, point.target);
        let corners = [
            edge(&pair[0], 1.0 / pair[0].factor),
            edge(&pair[0], pair[0].factor),
            edge(&pair[1], pair[1].factor),
            edge(&pair[1], 1.0 / pair[1].factor),
        ];
        painter.add(Shape::convex_polygon(corners.to_vec(), BAND, Stroke::NONE));
    }
    let expected = curve.future.iter();
    let expected: Vec<Pos2> = expected.map(|to| frame.place(to.wall_s, to.target)).collect();
    painter.extend(Shape::dashed_line(&expected, Stroke::new(1.5, FUTURE), 4.0, 3.0));

    // What is known is drawn over what is expected.
    let past = curve.past.iter();
    let past: Vec<Pos2> = past.map(|level| frame.place(level.wall_s, level.error)).collect();
    for point in &past {
        painter.circle_filled(*point, 3.0, PAST);
    }
    painter.line(past, Stroke::new(1.5, PAST));

    // Presets and the target lie on the expected curve, at the time that they take.
    for (_, preset) in &curve.presets {
        painter.circle_filled(frame.place(preset.wall_s, preset.target), 2.5, TEXT);
    }
    if let Some(target) = curve.target {
        let place = frame.place(target.wall_s, target.target);
        painter.circle_stroke(place, 5.0, Stroke::new(2.0, TARGET));
    }
}
