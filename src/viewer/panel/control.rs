//! One labelled control per row, each with a tooltip about what it does and what it costs.

use std::any::type_name;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

use egui::{Button, ComboBox, EventFilter, Grid, Key, Response, RichText, Slider, SliderClamping, Ui, vec2};
use serde::Deserialize;
use strum::{EnumMessage, VariantArray};

use super::Command;
use crate::settings::options::{OPTIONS, OptionInfo};

/// Width of a control [points].
pub const CONTROL_WIDTH: f32 = 186.0;
/// Width of the label in front of a control [points].
const LABEL_WIDTH: f32 = 124.0;
/// Size of the reset button [points].
const RESET: egui::Vec2 = vec2(16.0, 18.0);
/// Largest height of an open drop-down list [points].
const LIST_HEIGHT: f32 = 320.0;
/// Width of a slider without its value [points].
const SLIDER_WIDTH: f32 = 112.0;

/// Help of a control.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct ControlHelp {
    /// What the control sets.
    pub what: &'static str,
    pub range: &'static str,
    pub default: &'static str,
    /// Effect on accuracy.
    accuracy: &'static str,
    /// Effect on time and memory.
    cost: &'static str,
}

impl ControlHelp {
    fn text(&self) -> String {
        format!(
            "{}\n\nRange: {}\nDefault: {}\nAccuracy: {}\nCost: {}",
            self.what, self.range, self.default, self.accuracy, self.cost
        )
    }
}

impl From<&OptionInfo> for ControlHelp {
    fn from(option: &OptionInfo) -> Self {
        Self {
            what: option.what,
            // Leaked once, for the life of the process.
            range: option.range().leak(),
            default: option.default,
            accuracy: option.accuracy,
            cost: option.cost,
        }
    }
}

/// All help texts: of rows by their labels, of buttons by their names. Texts of bake settings come from [`OPTIONS`].
#[derive(Deserialize)]
struct Texts {
    #[serde(borrow)]
    rows: HashMap<&'static str, ControlHelp>,
    #[serde(borrow)]
    buttons: HashMap<&'static str, &'static str>,
}

static TEXTS: LazyLock<Texts> = LazyLock::new(|| {
    let texts = include_str!("about.json");
    let mut texts: Texts = serde_json::from_str(texts).expect("the file is part of the program");
    texts.rows.extend(
        OPTIONS
            .iter()
            .map(|option| (option.label, ControlHelp::from(option))),
    );
    texts
});

/// Help of the control with this label.
pub fn about(label: &str) -> &'static ControlHelp {
    TEXTS
        .rows
        .get(label)
        .expect("about.json or OPTIONS tells about every row")
}

/// Help of the button with this name.
pub fn about_button(name: &str) -> &'static str {
    TEXTS
        .buttons
        .get(name)
        .expect("about.json tells about every button")
}

/// A button, disabled if there is a reason `why_not`; returns whether it was clicked.
pub fn button(ui: &mut Ui, name: &str, why_not: Option<&str>) -> bool {
    ui.add_enabled(why_not.is_none(), Button::new(name))
        .on_hover_text(about_button(name))
        .on_disabled_hover_text(why_not.unwrap_or_default())
        .clicked()
}

/// A button that pushes a command, disabled if there is a reason `why_not`.
pub fn ask(ui: &mut Ui, name: &str, why_not: Option<&str>, commands: &mut Vec<Command>, command: Command) {
    if button(ui, name, why_not) {
        commands.push(command);
    }
}

/// A grid of labels, controls and reset buttons.
pub fn rows(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) {
    Grid::new(name)
        .num_columns(3)
        .spacing([5.0, 4.0])
        .min_col_width(0.0)
        .show(ui, |ui| {
            ui.spacing_mut().slider_width = SLIDER_WIDTH;
            add(ui);
        });
}

/// A row without a default; disabled, with the reason as tooltip, if the control is `unavailable`.
pub fn row(
    ui: &mut Ui,
    label: &str,
    unavailable: Option<&str>,
    add: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    let response = labelled(ui, label, unavailable, add);
    ui.end_row();
    response
}

/// A row with a reset button, which is shown while the value differs from its default.
pub fn setting<T: PartialEq + Clone>(
    ui: &mut Ui,
    label: &str,
    unavailable: Option<&str>,
    (value, default): (&mut T, &T),
    add: impl FnOnce(&mut Ui, &mut T) -> Response,
) {
    labelled(ui, label, unavailable, |ui| add(ui, value));
    if value != default && unavailable.is_none() && reset_to(ui, label, about(label).default) {
        value.clone_from(default);
    }
    ui.end_row();
}

/// A row for a value that is changed by a command: returns the value that is to take the place of the present one.
pub fn edited<T: PartialEq + Clone>(
    ui: &mut Ui,
    label: &str,
    unavailable: Option<&str>,
    (present, default): (&T, &T),
    add: impl FnOnce(&mut Ui, &mut T) -> Response,
) -> Option<T> {
    let mut value = present.clone();
    setting(ui, label, unavailable, (&mut value, default), add);
    (value != *present).then_some(value)
}

/// A reset button; returns whether it was clicked.
pub fn reset_to(ui: &mut Ui, label: &str, default: &str) -> bool {
    let name = format!("Reset {label}");
    ui.add(
        Button::new(RichText::new("↺").monospace().size(14.0))
            .frame(false)
            .min_size(RESET),
    )
    .accessible_name(&name)
    .on_hover_text(format!("Back to the default: {default}."))
    .clicked()
}

fn labelled(
    ui: &mut Ui,
    label: &str,
    unavailable: Option<&str>,
    add: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    let text = about(label).text();
    let mut name = RichText::new(label);
    if unavailable.is_some() {
        name = name.weak();
    }
    let label = ui.horizontal(|ui| {
        ui.set_min_width(LABEL_WIDTH);
        ui.label(name).on_hover_text(&text)
    });
    let label = label.inner;
    let response = ui.add_enabled_ui(unavailable.is_none(), add).inner;
    response
        .labelled_by(label.id)
        .on_hover_text(text)
        .on_disabled_hover_text(unavailable.unwrap_or_default())
}

/// Steps by the arrow keys while a closed list has the keyboard focus; down is positive.
fn arrow_steps(ui: &Ui, list: &Response) -> isize {
    if !list.has_focus() {
        return 0;
    }
    let arrows = EventFilter {
        vertical_arrows: true,
        ..EventFilter::default()
    };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(list.id, arrows));
    let presses = |key| ui.input(|input| input.num_presses(key)) as isize;
    presses(Key::ArrowDown) - presses(Key::ArrowUp)
}

/// An entry of a drop-down list: name, tooltip, and the reason if it cannot be picked.
pub type Entry<'a> = (&'a str, Cow<'a, str>, Option<&'a str>);

/// A drop-down list that shows a text and the index of the present entry, if it is in the list. Returns the index
/// picked by mouse or arrow keys.
pub fn pick(
    ui: &mut Ui,
    (id, width): (&str, f32),
    (shown, at): (&str, Option<usize>),
    entries: &[Entry<'_>],
) -> (Response, Option<usize>) {
    let mut picked = None;

    // Draws one entry of the open list.
    let mut entry = |ui: &mut Ui, index: usize, (name, hover, why_not): &Entry<'_>| {
        ui.add_enabled_ui(why_not.is_none(), |ui| {
            let mut label = ui
                .push_id(index, |ui| ui.selectable_label(at == Some(index), *name))
                .inner;
            if !hover.is_empty() {
                label = label.on_hover_text(&**hover);
            }
            let label = label.on_disabled_hover_text(why_not.unwrap_or_default());
            if label.clicked() {
                picked = Some(index);
            }
        });
    };

    let list = ComboBox::from_id_salt(id)
        .width(width)
        .height(LIST_HEIGHT)
        .selected_text(shown)
        .truncate()
        .show_ui(ui, |ui| {
            for (index, offered) in entries.iter().enumerate() {
                entry(ui, index, offered);
            }
        });

    // Arrow keys step through the entries of a closed list, past those that cannot be picked.
    if list.inner.is_none() {
        let open: Vec<usize> = (0..entries.len())
            .filter(|index| entries[*index].2.is_none())
            .collect();
        let steps = arrow_steps(ui, &list.response);
        if steps != 0 && !open.is_empty() {
            let place = open.iter().position(|index| Some(*index) == at);
            let next = place.map_or(0, |place| place.saturating_add_signed(steps).min(open.len() - 1));
            picked = Some(open[next]);
        }
    }
    (list.response, picked)
}

/// A drop-down list of values, each with a name and a tooltip; shows `custom` for a value that is not in the list.
pub fn choice<T: PartialEq + Copy>(
    ui: &mut Ui,
    name: &str,
    value: &mut T,
    custom: &str,
    choices: &[(T, &str, &str)],
) -> Response {
    let at = choices.iter().position(|(candidate, ..)| candidate == value);
    let entries: Vec<Entry> = choices
        .iter()
        .map(|(_, name, hover)| (*name, (*hover).into(), None))
        .collect();
    let shown = at.map_or(custom, |at| choices[at].1);
    let (response, picked) = pick(ui, (name, CONTROL_WIDTH), (shown, at), &entries);
    if let Some(index) = picked {
        *value = choices[index].0;
    }
    response
}

/// A drop-down list of all values of a setting, with the names and texts of the command line.
pub fn listed<T>(ui: &mut Ui, value: &mut T) -> Response
where
    T: VariantArray + EnumMessage + Into<&'static str> + PartialEq + Copy,
{
    listed_but(ui, value, |_| None)
}

/// The same; values that have a reason `why_not` cannot be picked.
pub fn listed_but<T>(ui: &mut Ui, value: &mut T, why_not: impl Fn(T) -> Option<&'static str>) -> Response
where
    T: VariantArray + EnumMessage + Into<&'static str> + PartialEq + Copy,
{
    let entry = |value: &T| {
        let hover = value.get_documentation().unwrap_or_default();
        ((*value).into(), hover.into(), why_not(*value))
    };
    let entries: Vec<Entry> = T::VARIANTS.iter().map(entry).collect();
    let shown = (
        (*value).into(),
        T::VARIANTS.iter().position(|listed| listed == value),
    );
    let (response, picked) = pick(ui, (type_name::<T>(), CONTROL_WIDTH), shown, &entries);
    if let Some(index) = picked {
        *value = T::VARIANTS[index];
    }
    response
}

/// A drop-down list of names without tooltips.
pub fn pick_name(
    ui: &mut Ui,
    list: (&str, f32),
    shown: (&str, Option<usize>),
    names: &[&str],
) -> (Response, Option<usize>) {
    let entries: Vec<Entry> = names.iter().map(|name| (*name, "".into(), None)).collect();
    pick(ui, list, shown, &entries)
}

/// A slider beyond whose ends can be typed.
pub fn slider(range: RangeInclusive<f64>, decimals: usize) -> impl FnOnce(&mut Ui, &mut f64) -> Response {
    move |ui, value| {
        let slider = Slider::new(value, range).clamping(SliderClamping::Never);
        ui.add(slider.fixed_decimals(decimals))
    }
}

/// Four significant digits; scientific notation for very large and very small values.
pub fn significant(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if (-3.0..6.0).contains(&magnitude) {
        let decimals = (3.0 - magnitude).clamp(0.0, 6.0) as usize;
        return format!("{value:.decimals$}");
    }
    format!("{value:.3e}")
}

/// Three significant digits, more only before the decimal point, without trailing zeros: 0.005, 25, 1366, 2.5e-7.
pub fn short(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(-4.0..6.0).contains(&magnitude) {
        let text = format!("{value:.2e}");
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{exponent}", without_zeros(digits));
    }
    let decimals = (2.0 - magnitude).clamp(0.0, 6.0) as usize;
    without_zeros(&format!("{value:.decimals$}")).to_owned()
}

/// Removes trailing zeros behind the decimal point.
fn without_zeros(number: &str) -> &str {
    if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        number
    }
}

/// With thousands separators: 1,234,567.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// With a unit, in powers of 1000.
pub fn bytes(count: u64) -> String {
    match count {
        0..1000 => format!("{count} B"),
        1000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        _ => format!("{:.1} MB", count as f64 / 1e6),
    }
}

/// A count and its noun: "1 light", "2 lights".
pub fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", grouped(count as u64))
}
