//! Section *Effects*: what can be simulated or left out, how it is switched, why it is on or off, and what it takes.

use egui::{Button, Frame, RichText, Role, Ui, WidgetInfo, vec2};

use super::bake::{FAILED, two_digits};
use super::control::{bytes, counted, grouped, significant};
use super::{Facts, Wishes};
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::illumination::difference::Difference;
use crate::plan::EffectLine;
use crate::session::EffectCounts;
use crate::viewer::worker::BakeState;

/// Width of the three switches of an effect [points].
const SWITCHES_WIDTH: f32 = 128.0;
/// Size of a switch [points].
const SWITCH: egui::Vec2 = vec2(40.0, 18.0);

/// Size of the counters' text [points].
const COUNTER: f32 = 11.5;

const SWITCHES: [(EffectSwitch, &str, &str); 3] = [
    (
        EffectSwitch::Auto,
        "auto",
        "Default: simulated where the scene calls for it; where not, it takes nothing.",
    ),
    (
        EffectSwitch::On,
        "on",
        "Always: what the scene does not call for is looked for all the same. More time and memory, the same light.",
    ),
    (
        EffectSwitch::Off,
        "off",
        "Never: the light that would need it is missing, and booked as switched off. Less time and memory.",
    ),
];
const WORTH: &str = "Bakes once more without this effect, beside the maps that are shown, and shows in false colours \
                     where it adds light and where it takes light away. Costs a whole bake; any change stops it.";
const WORTH_LINE: &str = "Light on all maps and layers with the effect minus without it, in luminous-equivalent watts; \
                          the root mean square of the difference over the mean with it.";
const UNAVAILABLE: &str = "This version does not simulate it.";

/// What is known of an effect.
#[derive(Clone, Copy, Debug, Default)]
struct Known<'a> {
    line: Option<&'a EffectLine>,
    counts: Option<&'a EffectCounts>,
}

/// Shows every effect, then every light.
pub fn show(ui: &mut Ui, switches: &mut EffectSwitches, facts: &Facts<'_>, wishes: &mut Wishes) {
    for effect in Effect::ALL {
        let mut switch = switches.get(effect);
        let known = known(effect, facts);
        entry(ui, effect, &mut switch, known, |ui| {
            let is_on = known.line.is_some_and(|line| line.on);
            if is_on && effect.is_available() && effect != Effect::Chains {
                worth(ui, effect, facts, wishes);
            }
        });
        switches.set(effect, switch);
    }
    for line in facts.last.iter().flat_map(|last| &last.result.plan.lights) {
        let name = format!("light {}", line.light);
        title(ui, &name, Some(line.on));
        detail(ui, &name, |ui| drop(ui.label(RichText::new(&line.reason).weak())));
    }
}

/// The reports of the last level, the eye's chains from the picture; before there are reports, the plan.
fn known<'a>(effect: Effect, facts: &Facts<'a>) -> Known<'a> {
    let result = facts.last.map(|last| &last.result);
    let reports = result.into_iter().flat_map(|result| &result.effects);
    let report = if effect == Effect::Chains {
        facts.chains
    } else {
        reports.into_iter().find(|report| report.line.effect == effect)
    };
    let plan = result.map(|result| &result.plan);
    let planned = plan.and_then(|plan| plan.effects.iter().find(|line| line.effect == effect));
    Known {
        line: report.map(|report| &report.line).or(planned),
        counts: report.map(|report| &report.counts),
    }
}

fn entry(
    ui: &mut Ui,
    effect: Effect,
    switch: &mut EffectSwitch,
    known: Known<'_>,
    add_worth: impl FnOnce(&mut Ui),
) {
    let name = effect.name().replace('_', " ");
    ui.horizontal(|ui| {
        let is_on = known.line.map(|line| line.on);
        title(ui, &name, is_on.filter(|_| effect.is_available())).on_hover_text(effect.description());
        ui.add_space((ui.available_width() - SWITCHES_WIDTH).max(0.0));
        ui.add_enabled_ui(effect.is_available(), |ui| segments(ui, &name, switch));
    });
    detail(ui, &name, |ui| {
        let reason = match known.line {
            _ if !effect.is_available() => UNAVAILABLE,
            Some(line) => &line.reason,
            None if effect == Effect::Chains => "Known with the first picture.",
            None => "Known after the first bake.",
        };
        ui.label(RichText::new(reason).weak());
        if let Some(counts) = known.counts.filter(|_| effect.is_available()) {
            counters(ui, counts);
        }
        add_worth(ui);
    });
}

/// What the effect brings to the maps that are shown, or a button that finds it.
fn worth(ui: &mut Ui, effect: Effect, facts: &Facts<'_>, wishes: &mut Wishes) {
    if let BakeState::Comparing {
        effect: left_out,
        stage,
        fraction,
    } = facts.state
        && *left_out == effect
    {
        let text = format!("baking without it: {} {:.0} %", stage.name(), 100.0 * fraction);
        ui.label(RichText::new(text).size(COUNTER));
        return;
    }
    if let Some(worth) = facts.worth.filter(|worth| worth.effect == effect) {
        match &worth.difference {
            Ok(found) => {
                ui.label(RichText::new(worth_line(found)).size(COUNTER))
                    .on_hover_text(WORTH_LINE);
            }
            Err(sentence) => drop(ui.colored_label(FAILED, sentence)),
        }
        return;
    }
    let is_ready = !facts.state.is_working() && facts.last.is_some_and(|last| last.is_final);
    let name = effect.name().replace('_', " ");
    let button = ui
        .add_enabled(is_ready, Button::new("worth").small())
        .on_hover_text(WORTH)
        .on_disabled_hover_text("Known once the bake is done.");
    button.widget_info(|| WidgetInfo::labeled(Role::Button, is_ready, format!("{name}: worth")));
    if button.clicked() {
        wishes.worth = Some(effect);
    }
}

/// "+12.3 W of 16.1 W deposited; maps differ by 84 % (relative RMSE)".
fn worth_line(found: &Difference) -> String {
    let sign = if found.difference_w() < 0.0 { "−" } else { "+" };
    let difference = significant(found.difference_w().abs());
    let with = significant(found.with_w);
    let differ = found
        .relative_rmse
        .map_or("there is no light with it".into(), |rmse| {
            format!("maps differ by {} % (relative RMSE)", two_digits(100.0 * rmse))
        });
    format!("{sign}{difference} W of {with} W deposited; {differ}")
}

/// "refraction: on", strong where it is on.
fn title(ui: &mut Ui, name: &str, is_on: Option<bool>) -> egui::Response {
    let text = match is_on {
        Some(true) => RichText::new(format!("{name}: on")).strong(),
        Some(false) => RichText::new(format!("{name}: off")),
        None => RichText::new(name).weak(),
    };
    ui.label(text)
}

fn detail(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) {
    ui.indent(("effect", name), add);
}

fn segments(ui: &mut Ui, name: &str, switch: &mut EffectSwitch) {
    let frame = Frame::new()
        .fill(ui.visuals().extreme_bg_color)
        .corner_radius(4.0)
        .inner_margin(1.0);
    frame.show(ui, |ui| {
        ui.spacing_mut().item_spacing.x = 1.0;
        ui.spacing_mut().button_padding = vec2(2.0, 0.0);
        for (candidate, label, hover) in SWITCHES {
            let is_chosen = *switch == candidate;
            let response = ui
                .add(Button::selectable(is_chosen, label).min_size(SWITCH))
                .on_hover_text(hover)
                .on_disabled_hover_text(UNAVAILABLE);
            // Three of each kind stand in the panel: told apart by the effect.
            let is_enabled = ui.is_enabled();
            response.widget_info(|| {
                let text = format!("{name}: {label}");
                WidgetInfo::selected(Role::RadioButton, is_enabled, is_chosen, text)
            });
            if response.clicked() {
                *switch = candidate;
            }
        }
    });
}

/// What the effect took up to the maps that are shown.
fn counters(ui: &mut Ui, counts: &EffectCounts) {
    let mut texts: Vec<(String, &str)> = Vec::new();
    let mut add = |text: String, hover: &'static str| texts.push((text, hover));
    if let Some(pipelines) = counts.pipelines {
        add(
            counted(pipelines as usize, "pipeline"),
            "Render pipelines that exist for it on the graphics device.",
        );
        add(
            bytes(counts.bytes),
            "Memory on the graphics device for what mirrors and glass are shown of their surroundings.",
        );
        let gpu = counts
            .gpu_ms
            .map_or("GPU time unknown".into(), |ms| format!("{ms:.1} ms GPU"));
        add(
            gpu,
            "Time on the graphics device for the last picture's specular surfaces, in milliseconds. Some devices \
             cannot tell.",
        );
    } else if *counts == EffectCounts::default() {
        add(
            "takes no rays, no memory, no time".into(),
            "Counted where the work would be done.",
        );
    } else {
        add(
            format!("{} rays", grouped(counts.rays)),
            "Rays traced for it: light rays, segments after an event of its kind, shadow rays.",
        );
        add(
            format!("{} deposits", grouped(counts.deposits)),
            "Patches and kernels that it brought to a map.",
        );
        add(bytes(counts.bytes), "Memory that is held for it.");
        add(
            format!("{:.1} ms CPU", counts.cpu_ms),
            "CPU time over all threads, in milliseconds; where effects share loops, by their share of rays and \
             deposits.",
        );
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 10.0;
        for (text, hover) in texts {
            ui.label(RichText::new(text).size(COUNTER)).on_hover_text(hover);
        }
    });
}
