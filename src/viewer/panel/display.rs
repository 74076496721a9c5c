//! Section *Display*: how the picture shows the maps. Nothing here changes a bake.

use egui::{DragValue, Response, Slider, SliderClamping, Ui};

use super::control::{about, ask, choice, counted, listed, listed_but, row, rows, setting, short};
use super::{Command, Display, LayerShown, Model, Quantity, bake};
use crate::eye_pass::WhiteBalance;
use crate::optics::spectrum::temperature::CAMERA_KELVIN;
use crate::settings::LayerKind;
use crate::viewer::false_colours;
use crate::viewer::views::{IrradianceUnit, ScaleChoice};

const NO_DIFFERENCE: &str = "Ask under Effects what an effect is worth.";
const NO_ERRORS: &str = "These maps come without an estimate of their error.";

/// Range of values that can be typed for the ends of the scale [W/m²].
const MIN_W_M2: f64 = 1e-9;
const MAX_W_M2: f64 = 1e9;
/// Smallest ratio of the upper to the lower end.
const MIN_RATIO: f64 = 1.01;

/// Initial value of the white balance slider [K]: D65.
const DAYLIGHT_KELVIN: f64 = 6504.0;

pub fn show(ui: &mut Ui, display: &mut Display, model: &Model, commands: &mut Vec<Command>) {
    let baked = &model.layers()[..];
    rows(ui, "display", |ui| {
        // The exposure has no default to go back to: it is measured.
        row(ui, "Exposure [stops]", None, |ui| {
            ui.horizontal(|ui| {
                // Leaves room for the button.
                ui.spacing_mut().slider_width = 74.0;
                let slider = exposure(ui, &mut display.exposure_stops);
                ask(ui, "Auto", None, commands, Command::MeasureExposure);
                slider
            })
            .inner
        });

        let default = Display::default();
        let white = (&mut display.white_balance, &default.white_balance);
        setting(ui, "White balance", None, white, white_balance);
        let tone_map = (&mut display.tone_map, &default.tone_map);
        setting(ui, "Tone map", None, tone_map, listed);

        // Without maps there is no light to choose from.
        let nothing = baked.is_empty().then_some("There are no maps yet.");
        let shown = (&mut display.layer, &default.layer);
        setting(ui, "Light shown", nothing, shown, |ui, shown| {
            layer(ui, shown, baked)
        });
        let shown = (&mut display.quantity, &default.quantity);
        setting(ui, "View", nothing, shown, |ui, shown| quantity(ui, shown, model));

        // The scales of all other quantities are fixed or follow the values.
        if display.quantity == Quantity::Irradiance {
            let chosen = (&mut display.scale, &default.scale);
            setting(ui, "Scale", None, chosen, scale);
            row(ui, "From, to", None, |ui| range(ui, &mut display.scale, model));
        }
    });

    // Values that are not finite are faults of a bake and never pass unnoticed.
    if model.survey.faults > 0 {
        let faults = counted(model.survey.faults, "texel");
        ui.colored_label(
            bake::ATTENTION,
            format!("{faults} without a finite value, shown in magenta."),
        );
    }
}

fn exposure(ui: &mut Ui, stops: &mut f64) -> Response {
    ui.add(
        Slider::new(stops, -20.0..=20.0)
            .clamping(SliderClamping::Edits)
            .fixed_decimals(2),
    )
}

fn white_balance(ui: &mut Ui, white: &mut WhiteBalance) -> Response {
    // The entry of temperatures has the present one, since the list finds its value by equality.
    let kelvin = match *white {
        WhiteBalance::Kelvin(kelvin) => kelvin,
        _ => DAYLIGHT_KELVIN,
    };
    let choices = [
        (WhiteBalance::None, "none", "Colours as they are: D65 is white."),
        (
            WhiteBalance::Lamps,
            "from the lamps",
            "What a grey card in the middle of the scene would show.",
        ),
        (
            WhiteBalance::Kelvin(kelvin),
            "temperature",
            "Daylight, or below 4000 K a black body.",
        ),
    ];

    // The slider appears with the choice that it belongs to.
    ui.vertical(|ui| {
        let response = choice(ui, "white balance", white, "custom", &choices);
        if let WhiteBalance::Kelvin(kelvin) = white {
            let [least, most] = CAMERA_KELVIN;
            let slider = Slider::new(kelvin, least..=most)
                .logarithmic(true)
                .clamping(SliderClamping::Edits)
                .fixed_decimals(0)
                .suffix(" K");
            ui.add(slider)
                .accessible_name("White balance [K]")
                .on_hover_text(about("White balance").what);
        }
        response
    })
    .inner
}

fn quantity(ui: &mut Ui, shown: &mut Quantity, model: &Model) -> Response {
    let has_difference = model.worth.as_ref().is_some_and(|worth| worth.difference.is_ok());
    let why_not = |kind: Quantity| match kind {
        Quantity::Error if !false_colours::has_errors(model.maps()) => Some(NO_ERRORS),
        Quantity::Difference if !has_difference => Some(NO_DIFFERENCE),
        _ => None,
    };
    listed_but(ui, shown, why_not)
}

fn scale(ui: &mut Ui, choice: &mut ScaleChoice) -> Response {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        for unit in [IrradianceUnit::WattsPerM2, IrradianceUnit::Lux] {
            ui.radio_value(&mut choice.unit, unit, unit.symbol())
                .on_hover_text(about("Scale").what);
        }
        ui.checkbox(&mut choice.is_logarithmic, "logarithmic")
            .on_hover_text(about("Scale").what);
    })
    .response
}

fn range(ui: &mut Ui, choice: &mut ScaleChoice, model: &Model) -> Response {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        ui.checkbox(&mut choice.is_automatic, "auto")
            .on_hover_text(about("From, to").range);
        let factor = choice.unit.per_w_m2();
        if choice.is_automatic {
            let scale = model.survey.scale(Quantity::Irradiance, choice);
            let [low, high] = [scale.low, scale.high].map(|end| short(end * factor));
            ui.label(format!("{low} to {high} {}", choice.unit.symbol()));
        } else {
            let [low, high] = choice.typed_w_m2;
            let mut field = |name: &str, value: f64, range: std::ops::RangeInclusive<f64>| {
                let mut shown = value * factor;
                let speed = 0.02 * shown;
                let drag = DragValue::new(&mut shown)
                    .speed(speed)
                    .range((range.start() * factor)..=(range.end() * factor))
                    .custom_formatter(|value, _| short(value));
                ui.add(drag)
                    .accessible_name(name)
                    .on_hover_text(about("From, to").what);
                shown / factor
            };
            choice.typed_w_m2[0] = field("Scale: from", low, MIN_W_M2..=high / MIN_RATIO);
            choice.typed_w_m2[1] = field("Scale: to", high, low * MIN_RATIO..=MAX_W_M2);
        }
    })
    .response
}

fn layer(ui: &mut Ui, shown: &mut LayerShown, baked: &[LayerKind]) -> Response {
    ui.horizontal(|ui| {
        // Four words have to fit into a narrow row.
        let spacing = ui.spacing_mut();
        (spacing.item_spacing.x, spacing.icon_spacing) = (2.0, 1.0);
        (spacing.icon_width, spacing.icon_width_inner) = (11.0, 6.0);
        ui.radio_value(shown, LayerShown::All, "all")
            .on_hover_text("The sum of what was baked.");
        for kind in LayerKind::ALL {
            ui.add_enabled_ui(baked.contains(&kind), |ui| {
                ui.radio_value(shown, LayerShown::Only(kind), kind.name())
                    .on_hover_text(about("Light shown").what)
                    .on_disabled_hover_text("This layer was not baked: switch it on under Light pass.");
            });
        }
    })
    .response
}
