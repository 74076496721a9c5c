//! Section *Display*: how the picture shows the maps. Nothing here changes a bake.

use egui::{Response, Slider, SliderClamping, Ui};

use super::control::{About, choice, chosen, row, rows};
use super::{Display, LayerShown, Wishes};
use crate::eye_pass::ToneMap;
use crate::settings::LayerKind;

const EXPOSURE: About = About {
    label: "Exposure [stops]",
    what: "Radiance is multiplied by 2 to this power before tone mapping.",
    range: "−20 to 20; chosen from the first picture",
    accuracy: "none: only the picture changes",
    cost: "none",
};
const AUTO_EXPOSURE: About = About {
    label: "",
    what: "Measures the present picture and sets the exposure once, so that brightness stays comparable afterwards.",
    range: "a button",
    accuracy: "none: only the picture changes",
    cost: "one small picture",
};
const TONE_MAP: About = About {
    label: "Tone map",
    what: "How radiance beyond what the display shows is brought into its range.",
    range: "neutral, none; default neutral",
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

const TONE_MAPS: [(ToneMap, &str, &str); 2] = [
    (
        ToneMap::Neutral,
        "neutral",
        "Khronos PBR Neutral: keeps hues, rolls highlights off",
    ),
    (ToneMap::None, "none", "cut at the display's white"),
];

/// Shows the section; `baked` are the layers of the shown maps.
pub fn show(ui: &mut Ui, display: &mut Display, baked: &[LayerKind], wishes: &mut Wishes) {
    rows(ui, "display", |ui| {
        row(ui, &EXPOSURE, None, |ui| {
            exposure(ui, &mut display.exposure_stops)
        });
        row(ui, &AUTO_EXPOSURE, None, |ui| {
            let response = ui.button("Auto exposure");
            wishes.measure_exposure |= response.clicked();
            response
        });
        row(ui, &TONE_MAP, None, |ui| {
            let selected = chosen(&display.tone_map, &TONE_MAPS);
            choice(ui, "tone map", &mut display.tone_map, selected, &TONE_MAPS)
        });
        let nothing = baked.is_empty().then_some("There are no maps yet.");
        row(ui, &LAYER, nothing, |ui| layer(ui, &mut display.layer, baked));
    });
}

fn exposure(ui: &mut Ui, stops: &mut f64) -> Response {
    ui.add(
        Slider::new(stops, -20.0..=20.0)
            .clamping(SliderClamping::Edits)
            .fixed_decimals(2),
    )
}

fn layer(ui: &mut Ui, shown: &mut LayerShown, baked: &[LayerKind]) -> Response {
    ui.horizontal(|ui| {
        ui.radio_value(shown, LayerShown::All, "all")
            .on_hover_text("The sum of what was baked.");
        for kind in [LayerKind::Caustic, LayerKind::Direct] {
            ui.add_enabled_ui(baked.contains(&kind), |ui| {
                ui.radio_value(shown, LayerShown::Only(kind), kind.name())
                    .on_hover_text(LAYER.what)
                    .on_disabled_hover_text("This layer was not baked: switch it on under Light pass.");
            });
        }
    })
    .response
}
