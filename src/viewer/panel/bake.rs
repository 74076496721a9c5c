//! The head of the panel: name of the scene, undo and redo, start, stop and progress of the bake, and its result.

use std::sync::Arc;
use std::time::Instant;

use egui::{Align, Button, Color32, Grid, Label, Layout, ProgressBar, RichText, Ui};

use super::control::{about_button, ask, counted, grouped};
use super::{Choices, Command, Model, file};
use crate::bake::{BYTES_PER_TEXEL, StopReason};
use crate::illumination::IlluminationMap;
use crate::light_pass::ledger::{CarriedFlux, EnergyLedger};
use crate::viewer::time_left::{in_words, time_left_s};
use crate::viewer::worker::{BakeRequest, BakeState, BakedLevel};

/// Text colour of errors.
pub const FAILED: Color32 = Color32::from_rgb(255, 120, 110);
/// Text colour of warnings.
pub const ATTENTION: Color32 = Color32::from_rgb(250, 190, 90);

/// Shows the controls and the state of the bake.
fn show(ui: &mut Ui, choices: &mut Choices, model: &Model, commands: &mut Vec<Command>) {
    let refused = choices.settings.validate().err();
    ui.horizontal(|ui| {
        let invalid = refused.is_some().then_some("A setting is out of its range.");
        ask(ui, "Re-bake", invalid, commands, Command::Rebake);
        let idle = (!model.state.is_working()).then_some("No bake is running.");
        ask(ui, "Cancel", idle, commands, Command::Cancel);
        let automatic = ui.checkbox(&mut choices.automatic, "automatic");
        automatic.on_hover_text(about_button("automatic"));
    });
    match &refused {
        Some(error) => drop(ui.colored_label(FAILED, error.to_string())),
        None => state_line(ui, choices, model),
    }
    if let Some(last) = model.last.as_deref() {
        ui.add_space(2.0);
        last_bake(ui, last);
    }
}

fn state_line(ui: &mut Ui, choices: &Choices, model: &Model) {
    // While time runs, the maps follow the scene with a delay that is no reason to bake again.
    let wanted = BakeRequest::new(Arc::clone(model.scene()), choices.settings.clone());
    let is_other = |last: &BakedLevel| !last.request.is_same(&wanted);
    let is_stale = !model.playback().is_playing && model.last.as_deref().is_some_and(is_other);
    match &model.state {
        BakeState::Baking {
            stage,
            fraction,
            since,
        } => {
            let mut text = format!(
                "{} {:.0} %, {:.1} s",
                stage.name(),
                fraction * 100.0,
                since.elapsed().as_secs_f64()
            );
            let left_s = time_left_s(&model.state, &wanted, model.last.as_deref(), Instant::now());
            if let Some(left_s) = left_s {
                text = format!("{text}, {}", in_words(left_s));
            }
            ui.add(ProgressBar::new(*fraction as f32).text(text).desired_height(18.0))
                .on_hover_text(
                    "Share of this stage that is done, time since the bake was asked for, and time until it is done as its \
                     course so far tells.",
                );
            if left_s.is_some_and(|left_s| left_s > LONG_S) {
                ui.weak("Long: coarser maps, a larger error or a max time end it sooner.")
                    .on_hover_text(SOONER);
            }
        }
        BakeState::Comparing {
            effect,
            stage,
            fraction,
        } => {
            let name = effect.name().replace('_', " ");
            let text = format!("without {name}: {} {:.0} %", stage.name(), fraction * 100.0);
            ui.add(ProgressBar::new(*fraction as f32).text(text).desired_height(18.0))
                .on_hover_text("Bakes once more without the effect, beside the maps that are shown.");
        }
        BakeState::Failed(sentence) => drop(ui.colored_label(FAILED, sentence)),
        BakeState::Cancelled => {
            drop(ui.colored_label(ATTENTION, "Cancelled; the maps are those of an earlier bake."))
        }
        // Maps belong to the scene and the settings of their request; both may have changed since.
        BakeState::Done | BakeState::Idle if is_stale => {
            ui.colored_label(ATTENTION, "Settings changed since the last bake.");
        }
        _ if model.playback().is_playing => drop(ui.label("Maps follow what moves.")),
        BakeState::Idle => drop(ui.label("Showing maps that were baked before.")),
        BakeState::Done if has_converged(model.last.as_deref()) => {
            drop(ui.label("Converged: the maps belong to these settings."))
        }
        BakeState::Done => drop(ui.label("Done: the maps belong to these settings.")),
    }
}

/// A bake with more time left than this shows how to shorten it [s].
const LONG_S: f64 = 600.0;
const SOONER: &str =
    "Section Accuracy: map size, max error, or bake until a max time. Cancel keeps the maps that are shown.";

/// Whether the bake reached its target error.
fn has_converged(last: Option<&BakedLevel>) -> bool {
    last.is_some_and(|last| last.result.has_met_target(&last.request.settings))
}

fn last_bake(ui: &mut Ui, last: &BakedLevel) {
    let result = &last.result;
    ui.label(level_line(last)).on_hover_text(
        "Relative RMSE over all maps as estimated without a reference, and the time from the request to these maps. \
         Maps of rising quality are shown until the bake is done.",
    );

    let hover = format!(
        "Rays that this bake traced up to here; those kept from earlier bakes are not counted. Build {:.2} s, \
         plan {:.2} s, trace {:.2} s, deposit {:.2} s; {:.2} s of CPU over all threads.",
        result.timings_s.build,
        result.timings_s.plan,
        result.timings_s.trace,
        result.timings_s.deposit,
        result.cpu_s.total,
    );

    // Memory is that of a bake, which sums flux in integers beside the finished maps.
    let texels = |map: &IlluminationMap| map.chart.texel_count() as u64;
    let bytes = result.maps.iter().map(texels).sum::<u64>() * BYTES_PER_TEXEL;
    ui.label(format!(
        "{} in {:.1} MB, {} rays traced, {} {}",
        counted(result.maps.len(), "map"),
        bytes as f64 / 1e6,
        grouped(result.counts.rays),
        grouped(result.counts.cells.max(result.counts.splats)),
        if result.counts.cells > 0 {
            "squares"
        } else {
            "splats"
        },
    ))
    .on_hover_text(hover);
}

/// Shows the energy ledger of the last bake, summed over all lights.
pub fn energy(ui: &mut Ui, last: Option<&BakedLevel>) {
    let ledgers = last.map_or(&[][..], |last| &last.result.ledgers);
    let total: EnergyLedger = ledgers.iter().map(|light| &light.energy_w).sum();
    if total.emitted > 0.0 {
        ledger(ui, &total);
        if let Some(parts) = CarriedFlux::sum(ledgers).in_words(total.deposited) {
            ui.label(format!("Carried by {parts}")).on_hover_text(CARRIERS);
        }
    } else {
        ui.label(RichText::new("No light meets glass, a mirror or water.").weak());
    }
}

const CARRIERS: &str = "What brought the deposited light to the maps. Bundles carry light that stays together and are laid down whole; \
    photons carry the difference: less than nothing where bundles brought too much.";

/// One line about the last level: "estimated error 2.1 %, 0.42 s: level 2, goes on".
fn level_line(last: &BakedLevel) -> String {
    let error = match last.result.estimated_error(last.request.settings.error_metric) {
        Some(error) => format!("estimated error {} %", two_digits(100.0 * error)),
        None => "error not estimated".into(),
    };
    let level = match (last.is_final, last.result.stop_reason) {
        (false, _) => format!("level {}, goes on", last.level),
        (true, StopReason::Density | StopReason::MaxError) => "done".into(),
        (true, StopReason::MaxTime) => "time is up".into(),
        (true, StopReason::Memory) => "memory is short".into(),
        (true, StopReason::NothingToDo) => "nothing to do".into(),
        (true, StopReason::Cancelled) => "stopped".into(),
    };
    format!("{error}, {:.2} s: {level}", last.seconds)
}

/// Two significant digits.
pub fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.abs().max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

fn ledger(ui: &mut Ui, total: &EnergyLedger) {
    // What was emitted equals the sum of the other lines.
    let lines = [
        (
            "Emitted",
            total.emitted,
            "Flux of the lamps whose first hit is glass, a mirror or water.",
        ),
        (
            "Deposited",
            total.deposited,
            "Flux that fell on diffuse surfaces, before their albedo.",
        ),
        ("Escaped", total.escaped, "Flux that left the scene."),
        (
            "Absorbed",
            total.absorbed,
            "Flux taken by metals, tints and volumes.",
        ),
        (
            "Truncated",
            total.truncated.total(),
            "Flux that the bake gave up: depth limit, branch threshold, unresolved.",
        ),
        (
            "Chance",
            total.sampling,
            "What random choices of photons lost; negative if they gained. 0 in the mean.",
        ),
    ];

    Grid::new("ledger")
        .num_columns(3)
        .spacing([14.0, 1.0])
        .show(ui, |ui| {
            for (name, watts, hover) in lines {
                ui.label(name).on_hover_text(hover);
                ui.label(format!("{watts:.6} W")).on_hover_text(hover);
                ui.label(format!("{:.2} %", 100.0 * watts / total.emitted))
                    .on_hover_text("Of what was emitted.");
                ui.end_row();
            }

            // Flux is summed in integers, so that a larger imbalance is no rounding but lost flux.
            let imbalance = total.relative_imbalance();
            let text = RichText::new(format!("{imbalance:.1e}"));
            let hover = "|emitted − sum of the others| / emitted; below 1e-6 the account is closed.";
            ui.label("Imbalance").on_hover_text(hover);
            ui.label(if imbalance < 1e-6 {
                text
            } else {
                text.color(FAILED)
            })
            .on_hover_text(hover);
            ui.end_row();
        });
}

/// Shows the header.
pub fn header(ui: &mut Ui, choices: &mut Choices, model: &Model, commands: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let history = model.edits().history();
            if step(ui, ("↷", "Redo (Ctrl+Y)"), ("Does again", history.next_redo())) {
                commands.push(Command::Redo);
            }
            if step(ui, ("↶", "Undo (Ctrl+Z)"), ("Takes back", history.next_undo())) {
                commands.push(Command::Undo);
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let name = Label::new(RichText::new(&model.scene().name).heading()).truncate();
                ui.add(name).on_hover_text(&model.scene().source);
            });
        });
    });
    show(ui, choices, model, commands);
    if model.picture.lost_device {
        let message = "The graphics device was lost and came back; nothing else was.";
        ui.colored_label(ATTENTION, message);
    }
    file::show_state(ui, model);
    if let Some(refusal) = model.refusal.as_deref() {
        ui.colored_label(FAILED, refusal);
    }
}

/// An undo or redo button; returns whether it was clicked.
fn step(ui: &mut Ui, (sign, name): (&str, &str), (does, what): (&str, Option<&str>)) -> bool {
    let button = ui.add_enabled(
        what.is_some(),
        Button::new(RichText::new(sign).monospace().size(15.0)),
    );
    button
        .accessible_name(name)
        .on_hover_text(format!("{does}: {}. {name}", what.unwrap_or_default()))
        .on_disabled_hover_text(format!("Nothing. {name}"))
        .clicked()
}
