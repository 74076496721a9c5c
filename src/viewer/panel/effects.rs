//! Section *Effects*: each effect with its switch, the reason for its state, and its contribution.

use std::borrow::Cow;

use egui::{Button, Frame, RichText, Role, Ui, WidgetInfo, vec2};
use strum::{EnumMessage, VariantArray};

use super::bake::{FAILED, two_digits};
use super::control::{about_button, grouped, reset_to, significant};
use super::{Command, Model};
use crate::bake::BakeCounts;
use crate::effect::{Effect, EffectSwitch, EffectSwitches};
use crate::illumination::difference::Difference;
use crate::plan::{self, EffectLine};
use crate::viewer::worker::{BakeState, EffectDifference};

/// Width of the three switches of an effect [points].
const SWITCHES_WIDTH: f32 = 128.0;
/// Width of the reset button, with its spacing [points].
const RESET_WIDTH: f32 = 24.0;
/// Size of a switch [points].
const SWITCH: egui::Vec2 = vec2(40.0, 18.0);

/// Font size of the counters [points].
pub const COUNTER: f32 = 11.5;

/// Shows every effect, then every light.
pub fn show(ui: &mut Ui, switches: &mut EffectSwitches, model: &Model, commands: &mut Vec<Command>) {
    for effect in Effect::ALL {
        let mut switch = switches.get(effect);
        if entry(ui, effect, &mut switch, model) {
            commands.push(Command::EffectDifference(effect));
        }
        switches.set(effect, switch);
    }
    for line in model.last.iter().flat_map(|last| &last.result.plan.lights) {
        let name = format!("light {}", line.light);
        title(ui, &name, Some(line.on));
        detail(ui, &name, |ui| drop(ui.label(RichText::new(&line.reason).weak())));
    }
}

/// The plan of an effect: of the picture for chains, of both passes for dispersion, of the last level for all others.
fn known(effect: Effect, model: &Model) -> Option<Cow<'_, EffectLine>> {
    let plan = model.last.as_ref().map(|last| &last.result.plan);
    let planned = || plan?.effects.iter().find(|line| line.effect == effect);
    let chains = model.picture.chains.as_ref();
    match effect {
        Effect::Chains => chains.map(Cow::Borrowed),
        Effect::Dispersion => planned().map(|line| match chains {
            Some(chains) => Cow::Owned(plan::dispersion(line.clone(), model.scene(), None, chains)),
            None => Cow::Borrowed(line),
        }),
        _ => planned().map(Cow::Borrowed),
    }
}

/// Shows one effect; returns whether its contribution was requested.
fn entry(ui: &mut Ui, effect: Effect, switch: &mut EffectSwitch, model: &Model) -> bool {
    // What an effect adds is found by a bake without it; chains and motion are not part of a bake.
    let known = known(effect, model);
    let is_on = known.as_ref().map(|line| line.on);
    let name = effect.name().replace('_', " ");
    let has_worth = is_on == Some(true) && !matches!(effect, Effect::Chains | Effect::Motion);
    let mut is_asked = false;

    // Name and state are at the left, the switch at the right end of the row.
    ui.horizontal(|ui| {
        title(ui, &name, is_on).on_hover_text(effect.description());
        if has_worth {
            is_asked = button(ui, effect, model);
        }
        ui.add_space((ui.available_width() - SWITCHES_WIDTH - RESET_WIDTH).max(0.0));
        segments(ui, &name, switch);
        if *switch != EffectSwitch::Auto && reset_to(ui, &name, "auto") {
            *switch = EffectSwitch::Auto;
        }
    });

    // Below are the reason for its state, the rays it took, and what it adds.
    detail(ui, &name, |ui| {
        let reason = match &known {
            Some(line) => line.reason.as_str(),
            None if effect == Effect::Chains => "Known with the first picture.",
            None => "Known after the first bake.",
        };
        ui.label(RichText::new(reason).weak());
        let last = model.last.as_ref();
        if let Some(rays) = last.and_then(|last| rays(effect, &last.result.counts)) {
            ui.label(RichText::new(rays).size(COUNTER))
                .on_hover_text("Traced by this bake up to the maps that are shown; what was kept from before is not counted.");
        }
        if has_worth {
            line(ui, effect, model);
        }
    });
    is_asked
}

/// "refraction: on", emphasized if it is on.
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
        for candidate in EffectSwitch::VARIANTS {
            let label: &str = candidate.into();
            let hover = candidate.get_documentation().unwrap_or_default();
            let is_chosen = *switch == *candidate;
            let response = ui
                .add(Button::selectable(is_chosen, label).min_size(SWITCH))
                .on_hover_text(hover);
            // The labels repeat in every row, so the accessible name includes the effect.
            let is_enabled = ui.is_enabled();
            response.widget_info(|| {
                let text = format!("{name}: {label}");
                WidgetInfo::selected(Role::RadioButton, is_enabled, is_chosen, text)
            });
            if response.clicked() {
                *switch = *candidate;
            }
        }
    });
}

/// Rays that a bake counted for an effect alone; `None` if there are none.
fn rays(effect: Effect, counts: &BakeCounts) -> Option<String> {
    let (rays, name) = match effect {
        Effect::LightPass => (counts.rays, "light rays"),
        Effect::Direct => (counts.shadow_rays, "shadow rays"),
        Effect::Indirect => (counts.gather_rays, "gather rays"),
        _ => return None,
    };
    (rays > 0).then(|| format!("{} {name}", grouped(rays)))
}

const LINE: &str = "Light on all maps and layers with the effect minus without it, in luminous-equivalent watts; the \
                    root mean square of the difference over the mean with it.";

/// A button that requests the contribution of an effect, unless it is known or being computed; returns whether it was
/// clicked.
fn button(ui: &mut Ui, effect: Effect, model: &Model) -> bool {
    if found(effect, model).is_some_and(|worth| worth.difference.is_ok()) || progress(effect, model).is_some()
    {
        return false;
    }
    let is_ready = !model.state.is_working() && model.last.as_ref().is_some_and(|last| last.is_final);
    let button = ui
        .add_enabled(is_ready, Button::new("worth?").small())
        .on_hover_text(about_button("worth?"))
        .on_disabled_hover_text("Known once the bake is done.");
    let name = effect.name().replace('_', " ");
    button.widget_info(|| WidgetInfo::labeled(Role::Button, is_ready, format!("{name}: worth")));
    button.clicked()
}

/// The contribution of an effect, or the progress of its computation.
fn line(ui: &mut Ui, effect: Effect, model: &Model) {
    if let Some(text) = progress(effect, model) {
        ui.label(RichText::new(text).size(COUNTER));
        return;
    }
    match found(effect, model).map(|worth| &worth.difference) {
        Some(Ok(found)) => {
            let text = RichText::new(sentence(found)).size(COUNTER).strong();
            ui.label(text).on_hover_text(LINE);
        }
        Some(Err(sentence)) => drop(ui.colored_label(FAILED, sentence)),
        None => {}
    }
}

fn found(effect: Effect, model: &Model) -> Option<&EffectDifference> {
    model.worth.as_ref().filter(|worth| worth.effect == effect)
}

fn progress(effect: Effect, model: &Model) -> Option<String> {
    match &model.state {
        BakeState::Comparing {
            effect: left_out,
            stage,
            fraction,
        } if *left_out == effect => {
            let per_cent = 100.0 * fraction;
            Some(format!("baking without it: {} {per_cent:.0} %", stage.name()))
        }
        _ => None,
    }
}

/// "+12.3 W of 16.1 W deposited; maps differ by 84 % (relative RMSE)".
fn sentence(found: &Difference) -> String {
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
