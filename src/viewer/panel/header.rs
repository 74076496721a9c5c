//! Always at the top: the scene's name, undo and redo, and the bake.

use egui::{Align, Button, Label, Layout, RichText, Ui};

use super::{Facts, Panel, Wishes, bake, file};

/// Shows the header.
pub fn show(ui: &mut Ui, panel: &mut Panel, facts: &Facts<'_>, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            wishes.redo |= step(ui, ("↷", "Redo (Ctrl+Y)"), ("Does again", facts.redo));
            wishes.undo |= step(ui, ("↶", "Undo (Ctrl+Z)"), ("Takes back", facts.undo));
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let name = Label::new(RichText::new(&facts.scene.name).heading()).truncate();
                ui.add(name).on_hover_text(&facts.scene.source);
            });
        });
    });
    bake::show(ui, panel, facts, wishes);
    if facts.lost_device {
        let told = "The graphics device was lost and came back; nothing else was.";
        ui.colored_label(bake::ATTENTION, told);
    }
    file::show_state(ui, facts);
    if let Some(refusal) = facts.refusal {
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
