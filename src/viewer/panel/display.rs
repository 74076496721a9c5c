//! Section *Display*: how the picture shows the maps. Nothing here changes a bake.

use egui::{Response, Slider, SliderClamping, Ui};

use super::control::{About, choice, chosen, row, rows};
use super::{Display, Facts, LayerShown, Quantity, Wishes};
use crate::eye_pass::{ToneMap, WhiteBalance};
use crate::optics::spectrum::temperature::CAMERA_KELVIN;
use crate::settings::LayerKind;

const EXPOSURE: About = About {
    label: "Exposure [stops]",
    what: "Radiance is multiplied by 2 to this power before tone mapping.",
    range: "−20 to 20; chosen from the first picture",
    accuracy: "none: only the picture changes",
    cost: "none",
};
const AUTO_EXPOSURE: &str = "Measures the present picture and sets the exposure once, so that brightness stays \
                             comparable afterwards. Takes one small picture.";
const TONE_MAP: About = About {
    label: "Tone map",
    what: "How radiance beyond what the display shows is brought into its range.",
    range: "neutral, AgX, ACES, none; default neutral",
    accuracy: "none: only the picture changes",
    cost: "none",
};
const WHITE_BALANCE: About = About {
    label: "White balance",
    what: "Which light is shown as white, by chromatic adaptation (Bradford): the display's own (D65), what the lamps \
           send to the middle of the scene, or light of a colour temperature, as on a camera.",
    range: "none, from the lamps, 1000 to 25,000 K; default none",
    accuracy: "none: only the picture changes",
    cost: "none",
};
const LAYER: About = About {
    label: "Light shown",
    what: "Which baked light the picture shows.",
    range: "all, caustic, direct; default all",
    accuracy: "none: only the picture changes",
    cost: "none",
};

const QUANTITY: About = About {
    label: "Map shown",
    what: "The light; how far each texel may be off, its estimated error; or what an effect adds and takes away. The \
           last two in false colours, relative to the map's mean irradiance.",
    range: "light, error, difference; default light",
    accuracy: "none: only the picture changes",
    cost: "none: the error is estimated in every bake, and the difference was found when an effect's worth was asked \
           for",
};
const NO_DIFFERENCE: &str = "Ask under Effects what an effect is worth.";
const NO_ERRORS: &str = "These maps come without an estimate of their error.";

const TONE_MAPS: [(ToneMap, &str, &str); 4] = [
    (
        ToneMap::Neutral,
        "neutral",
        "Khronos PBR Neutral: keeps hues, rolls highlights off",
    ),
    (
        ToneMap::AgX,
        "AgX",
        "Troy Sobotka's AgX: soft highlights; bright saturated light turns white",
    ),
    (
        ToneMap::Aces,
        "ACES",
        "Stephen Hill's fit of ACES: more contrast, darker middle tones",
    ),
    (ToneMap::None, "none", "cut at the display's white"),
];

/// What the slider of the white balance begins at: D65.
const DAYLIGHT_KELVIN: f64 = 6504.0;

/// Shows the section.
pub fn show(ui: &mut Ui, display: &mut Display, facts: &Facts<'_>, wishes: &mut Wishes) {
    let baked = facts.layers;
    rows(ui, "display", |ui| {
        row(ui, &EXPOSURE, None, |ui| {
            ui.horizontal(|ui| {
                let slider = exposure(ui, &mut display.exposure_stops);
                let auto = ui.button("Auto").on_hover_text(AUTO_EXPOSURE);
                wishes.measure_exposure |= auto.clicked();
                slider
            })
            .inner
        });
        row(ui, &WHITE_BALANCE, None, |ui| {
            white_balance(ui, &mut display.white_balance)
        });
        row(ui, &TONE_MAP, None, |ui| {
            let selected = chosen(&display.tone_map, &TONE_MAPS);
            choice(ui, "tone map", &mut display.tone_map, selected, &TONE_MAPS)
        });
        let nothing = baked.is_empty().then_some("There are no maps yet.");
        row(ui, &LAYER, nothing, |ui| layer(ui, &mut display.layer, baked));
        row(ui, &QUANTITY, nothing, |ui| {
            quantity(ui, &mut display.quantity, facts)
        });
    });
}

fn exposure(ui: &mut Ui, stops: &mut f64) -> Response {
    ui.add(
        Slider::new(stops, -20.0..=20.0)
            .clamping(SliderClamping::Edits)
            .fixed_decimals(2),
    )
}

fn white_balance(ui: &mut Ui, white: &mut WhiteBalance) -> Response {
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
    ui.vertical(|ui| {
        let selected = chosen(white, &choices);
        let response = choice(ui, "white balance", white, selected, &choices);
        if let WhiteBalance::Kelvin(kelvin) = white {
            let [least, most] = CAMERA_KELVIN;
            let slider = Slider::new(kelvin, least..=most)
                .logarithmic(true)
                .clamping(SliderClamping::Edits)
                .fixed_decimals(0)
                .suffix(" K");
            ui.add(slider).on_hover_text(WHITE_BALANCE.what);
        }
        response
    })
    .inner
}

fn quantity(ui: &mut Ui, shown: &mut Quantity, facts: &Facts<'_>) -> Response {
    let has_difference = facts.worth.is_some_and(|worth| worth.difference.is_ok());
    ui.horizontal(|ui| {
        ui.radio_value(shown, Quantity::Light, "light");
        for (kind, label, is_there, why_not) in [
            (Quantity::Error, "error", facts.has_errors, NO_ERRORS),
            (Quantity::Difference, "difference", has_difference, NO_DIFFERENCE),
        ] {
            ui.add_enabled_ui(is_there, |ui| {
                ui.radio_value(shown, kind, label)
                    .on_hover_text(QUANTITY.what)
                    .on_disabled_hover_text(why_not);
            });
        }
    })
    .response
}

fn layer(ui: &mut Ui, shown: &mut LayerShown, baked: &[LayerKind]) -> Response {
    ui.horizontal(|ui| {
        // Four words in a narrow row.
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().icon_spacing = 2.0;
        ui.radio_value(shown, LayerShown::All, "all")
            .on_hover_text("The sum of what was baked.");
        for kind in LayerKind::ALL {
            ui.add_enabled_ui(baked.contains(&kind), |ui| {
                ui.radio_value(shown, LayerShown::Only(kind), kind.name())
                    .on_hover_text(LAYER.what)
                    .on_disabled_hover_text("This layer was not baked: switch it on under Light pass.");
            });
        }
    })
    .response
}
