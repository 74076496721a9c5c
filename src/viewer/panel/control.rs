//! One labelled control per row, each with a text that says what it does and what it costs.

use egui::{Button, ComboBox, EventFilter, Grid, Key, Response, RichText, Ui, vec2};

/// Width of the control beside its label [points].
pub const CONTROL_WIDTH: f32 = 186.0;
/// Width of the label in front of it [points].
const LABEL_WIDTH: f32 = 124.0;
/// Size of what sets a value back to its default [points].
const RESET: egui::Vec2 = vec2(16.0, 18.0);
/// Width of a slider without its value [points].
const SLIDER_WIDTH: f32 = 112.0;

/// What a control is for, in the user's terms.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Name, with its unit where it has one.
    pub label: &'static str,
    /// What it sets.
    pub what: &'static str,
    /// Its values.
    pub range: &'static str,
    /// What it is set back to.
    pub default: &'static str,
    /// What it does to accuracy.
    pub accuracy: &'static str,
    /// What it does to time and memory.
    pub cost: &'static str,
}

impl About {
    fn text(&self) -> String {
        let Self {
            what,
            range,
            default,
            accuracy,
            cost,
            ..
        } = self;
        format!("{what}\n\nRange: {range}\nDefault: {default}\nAccuracy: {accuracy}\nCost: {cost}")
    }
}

/// A grid of label, control and what sets it back.
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

/// A row of what has no default; greyed, with the reason on hover, where the control is `unavailable`.
pub fn row(
    ui: &mut Ui,
    about: &About,
    unavailable: Option<&str>,
    add: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    let response = labelled(ui, about, unavailable, add);
    ui.end_row();
    response
}

/// A row of a value, with what sets it back where it is not its default.
pub fn setting<T: PartialEq + Clone>(
    ui: &mut Ui,
    about: &About,
    unavailable: Option<&str>,
    (value, default): (&mut T, &T),
    add: impl FnOnce(&mut Ui, &mut T) -> Response,
) {
    labelled(ui, about, unavailable, |ui| add(ui, value));
    if value != default && unavailable.is_none() && reset(ui, about) {
        value.clone_from(default);
    }
    ui.end_row();
}

/// A button that sets a value back; tells whether it was pressed.
fn reset(ui: &mut Ui, about: &About) -> bool {
    reset_to(ui, about.label, about.default)
}

/// The same, for what is not in a row.
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
    about: &About,
    unavailable: Option<&str>,
    add: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    let text = about.text();
    let mut name = RichText::new(about.label);
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

/// Steps that the arrow keys ask for while a closed list has the keyboard: down is 1.
pub fn arrow_steps(ui: &Ui, list: &Response) -> isize {
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

/// The index so many steps away, as far as there are any.
pub fn stepped(index: usize, steps: isize, count: usize) -> usize {
    index.saturating_add_signed(steps).min(count.saturating_sub(1))
}

/// A long drop-down list of names, some with a hover text: what is shown, and at which place of the list that is, if at
/// any. The place that was picked, by mouse or arrow keys.
pub fn pick<'a>(
    ui: &mut Ui,
    id: &str,
    (shown, at): (&str, Option<usize>),
    names: impl ExactSizeIterator<Item = (&'a str, Option<String>)>,
) -> (Response, Option<usize>) {
    let count = names.len();
    let mut picked = None;
    let list = ComboBox::from_id_salt(id)
        .width(CONTROL_WIDTH)
        .selected_text(shown)
        .show_ui(ui, |ui| {
            for (index, (name, hover)) in names.enumerate() {
                let mut label = ui.selectable_label(at == Some(index), name);
                if let Some(hover) = hover {
                    label = label.on_hover_text(hover);
                }
                if label.clicked() {
                    picked = Some(index);
                }
            }
        });
    if list.inner.is_none() {
        let steps = arrow_steps(ui, &list.response);
        if steps != 0 {
            picked = Some(at.map_or(0, |at| stepped(at, steps, count)));
        }
    }
    (list.response, picked)
}

/// A drop-down list of named values, each with its own hover text.
pub fn choice<T: PartialEq + Copy>(
    ui: &mut Ui,
    name: &str,
    value: &mut T,
    selected: &str,
    choices: &[(T, &str, &str)],
) -> Response {
    let list = ComboBox::from_id_salt(name)
        .width(CONTROL_WIDTH)
        .selected_text(selected)
        .show_ui(ui, |ui| {
            for (candidate, label, hover) in choices {
                ui.selectable_value(value, *candidate, *label)
                    .on_hover_text(*hover);
            }
        });
    if list.inner.is_none() {
        let steps = arrow_steps(ui, &list.response);
        let index = choices.iter().position(|(candidate, ..)| candidate == value);
        if steps != 0 {
            *value = choices[index.map_or(0, |index| stepped(index, steps, choices.len()))].0;
        }
    }
    list.response
}

/// The name of the value that is chosen; "custom" where it is none of the list.
pub fn chosen<'a, T: PartialEq>(value: &T, choices: &[(T, &'a str, &'a str)]) -> &'a str {
    choices
        .iter()
        .find(|(candidate, ..)| candidate == value)
        .map_or("custom", |(_, label, _)| label)
}

/// A number in four significant digits; very large and very small ones in powers of ten.
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

/// Three digits that tell something, more only before the point: 0.005, 25, 1366, 2.5e-7.
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

/// A number without zeros behind its point that say nothing.
fn without_zeros(number: &str) -> &str {
    if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        number
    }
}

/// A count with separators for thousands: 1,234,567.
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

/// A size with its unit, in powers of 1000.
pub fn bytes(count: u64) -> String {
    match count {
        0..1000 => format!("{count} B"),
        1000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        _ => format!("{:.1} MB", count as f64 / 1e6),
    }
}

/// A count with its noun: "1 light", "2 lights".
pub fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", grouped(count as u64))
}
