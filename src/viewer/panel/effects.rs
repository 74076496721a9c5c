//! Section *Effects*: what can be simulated or left out, how it is switched, why it is on or off, and what it takes.

use std::borrow::Cow;

use egui::{Button, Frame, RichText, Role, Ui, WidgetInfo, vec2};

use super::control::{bytes, counted, grouped, reset_to};
use super::{Facts, Wishes, worth};
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::plan::{self, EffectLine};
use crate::session::EffectCounts;

/// Width of the three switches of an effect [points].
const SWITCHES_WIDTH: f32 = 128.0;
/// Of the button that sets it back, with what is before it.
const RESET_WIDTH: f32 = 24.0;
/// Size of a switch [points].
const SWITCH: egui::Vec2 = vec2(40.0, 18.0);

/// Size of the counters' text [points].
pub const COUNTER: f32 = 11.5;

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

/// What is known of an effect.
#[derive(Clone, Debug, Default)]
struct Known<'a> {
    line: Option<Cow<'a, EffectLine>>,
    counts: Option<&'a EffectCounts>,
}

/// Shows every effect, then every light.
pub fn show(ui: &mut Ui, switches: &mut EffectSwitches, facts: &Facts<'_>, wishes: &mut Wishes) {
    for effect in Effect::ALL {
        let mut switch = switches.get(effect);
        if entry(ui, effect, &mut switch, facts) {
            wishes.worth = Some(effect);
        }
        switches.set(effect, switch);
    }
    for line in facts.last.iter().flat_map(|last| &last.result.plan.lights) {
        let name = format!("light {}", line.light);
        title(ui, &name, Some(line.on));
        detail(ui, &name, |ui| drop(ui.label(RichText::new(&line.reason).weak())));
    }
}

/// The reports of the last level, the eye's chains from the picture; before there are reports, the plan. Dispersion is
/// of both passes.
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
    let line = report.map(|report| &report.line).or(planned).map(Cow::Borrowed);
    let in_both = |line: Cow<'a, EffectLine>| match facts.chains {
        Some(chains) if effect == Effect::Dispersion => Cow::Owned(plan::dispersion(
            line.into_owned(),
            facts.scene,
            None,
            &chains.line,
        )),
        _ => line,
    };
    Known {
        line: line.map(in_both),
        counts: report.map(|report| &report.counts),
    }
}

/// Shows one effect; tells whether it was asked what it is worth.
fn entry(ui: &mut Ui, effect: Effect, switch: &mut EffectSwitch, facts: &Facts<'_>) -> bool {
    let known = known(effect, facts);
    let is_on = known.line.as_ref().map(|line| line.on);
    let name = effect.name().replace('_', " ");
    let has_worth = is_on == Some(true) && effect != Effect::Chains;
    let mut is_asked = false;
    ui.horizontal(|ui| {
        title(ui, &name, is_on).on_hover_text(effect.description());
        if has_worth {
            is_asked = worth::button(ui, effect, facts);
        }
        ui.add_space((ui.available_width() - SWITCHES_WIDTH - RESET_WIDTH).max(0.0));
        segments(ui, &name, switch);
        if *switch != EffectSwitch::Auto && reset_to(ui, &name, "auto") {
            *switch = EffectSwitch::Auto;
        }
    });
    detail(ui, &name, |ui| {
        let reason = match &known.line {
            Some(line) => line.reason.as_str(),
            None if effect == Effect::Chains => "Known with the first picture.",
            None => "Known after the first bake.",
        };
        ui.label(RichText::new(reason).weak());
        if let Some(counts) = known.counts {
            counters(ui, counts);
        }
        if has_worth {
            worth::line(ui, effect, facts);
        }
    });
    is_asked
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
                .on_hover_text(hover);
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
            "Memory on the graphics device for the triangles that chains are traced through.",
        );
        let gpu = counts
            .gpu_ms
            .map_or("GPU time unknown".into(), |ms| format!("{ms:.1} ms GPU"));
        add(
            gpu,
            "Time on the graphics device for the last picture's specular surfaces, in milliseconds. Some devices \
             cannot tell.",
        );
    } else {
        for (text, hover) in light_counters(counts) {
            add(text, hover);
        }
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 10.0;
        for (text, hover) in texts {
            ui.label(RichText::new(text).size(COUNTER)).on_hover_text(hover);
        }
    });
}

/// Of an effect of the light: what it took none of is left out.
fn light_counters(counts: &EffectCounts) -> Vec<(String, &'static str)> {
    let cpu_ms = counts.cpu_ms.unwrap_or(0.0);
    let counters = [
        (
            counts.rays > 0,
            format!("{} rays", grouped(counts.rays)),
            "Rays traced for it: light rays, segments after an event of its kind, shadow rays.",
        ),
        (
            counts.deposits > 0,
            format!("{} deposits", grouped(counts.deposits)),
            "Patches and kernels that it brought to a map.",
        ),
        (
            counts.bytes > 0,
            bytes(counts.bytes),
            "Memory that is held for it.",
        ),
        (
            cpu_ms > 0.0,
            format!("{cpu_ms:.1} ms CPU"),
            "CPU time over all threads, in milliseconds; where effects share loops, by their share of rays and \
             deposits. What is a part of other effects' time is not told.",
        ),
    ];
    let taken = counters.into_iter().filter(|(is_taken, ..)| *is_taken);
    let taken: Vec<_> = taken.map(|(_, text, hover)| (text, hover)).collect();
    if taken.is_empty() {
        let text = "takes no rays, no memory, no time".into();
        return vec![(text, "Counted where the work would be done.")];
    }
    taken
}
