//! One labelled control per row, each with a text that says what it does and what it costs.

use egui::{ComboBox, Grid, Response, RichText, Ui};

/// Width of the control beside its label [points].
pub const CONTROL_WIDTH: f32 = 190.0;
/// Width of a slider without its value [points].
const SLIDER_WIDTH: f32 = 112.0;

/// What a control is for, in the user's terms.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Name, with its unit where it has one.
    pub label: &'static str,
    /// What it sets.
    pub what: &'static str,
    /// Its values and the default.
    pub range: &'static str,
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
            accuracy,
            cost,
            ..
        } = self;
        format!("{what}\n\nRange: {range}\nAccuracy: {accuracy}\nCost: {cost}")
    }
}

/// A grid of label and control.
pub fn rows(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) {
    Grid::new(name)
        .num_columns(2)
        .spacing([8.0, 4.0])
        .min_col_width(104.0)
        .show(ui, |ui| {
            ui.spacing_mut().slider_width = SLIDER_WIDTH;
            add(ui);
        });
}

/// A row; greyed, with the reason on hover, where the control is `unavailable`.
pub fn row(
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
    let label = ui.label(name).on_hover_text(&text);
    let response = ui.add_enabled_ui(unavailable.is_none(), add).inner;
    ui.end_row();
    response
        .labelled_by(label.id)
        .on_hover_text(text)
        .on_disabled_hover_text(unavailable.unwrap_or_default())
}

/// A drop-down list of named values, each with its own hover text.
pub fn choice<T: PartialEq + Copy>(
    ui: &mut Ui,
    name: &str,
    value: &mut T,
    selected: &str,
    choices: &[(T, &str, &str)],
) -> Response {
    ComboBox::from_id_salt(name)
        .width(CONTROL_WIDTH)
        .selected_text(selected)
        .show_ui(ui, |ui| {
            for (candidate, label, hover) in choices {
                ui.selectable_value(value, *candidate, *label)
                    .on_hover_text(*hover);
            }
        })
        .response
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
