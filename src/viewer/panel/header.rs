//! Always at the top: the scene's name, undo and redo, and the bake.

use egui::{Align, Button, Label, Layout, RichText, Ui};

use super::{Choices, Command, Model, bake, file};

/// Shows the header.
pub fn show(ui: &mut Ui, choices: &mut Choices, model: &Model, commands: &mut Vec<Command>) {
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
    bake::show(ui, choices, model, commands);
    if model.picture.lost_device {
        let told = "The graphics device was lost and came back; nothing else was.";
        ui.colored_label(bake::ATTENTION, told);
    }
    file::show_state(ui, model);
    if let Some(refusal) = model.refusal.as_deref() {
        ui.colored_label(bake::FAILED, refusal);
    }
}

/// A button that takes a change back or does one again; tells whether it was pressed.
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
