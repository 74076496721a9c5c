//! Two maps side by side: what the picture's right part shows.

use std::path::PathBuf;

use egui::{TextEdit, Ui};

use super::control::{about_button, ask, button};
use super::{Command, CompareCommand, Model};

/// What the field is called by assistive technology.
const FOLDER: &str = "Folder to compare with";

/// Shows the controls.
pub fn show(ui: &mut Ui, folder: &mut String, model: &Model, commands: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        let none = model.layers().is_empty().then_some("There are no maps yet.");
        let keep = Command::Compare(CompareCommand::Keep);
        ask(ui, "Keep as before", none, commands, keep);
        let none = model
            .reference
            .as_ref()
            .is_none()
            .then_some("Nothing is compared now.");
        let end = Command::Compare(CompareCommand::End);
        ask(ui, "End comparison", none, commands, end);
    });
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(folder)
            .hint_text("folder of maps")
            .desired_width(190.0);
        let field = ui
            .add(field)
            .on_hover_text(about_button("Compare"))
            .accessible_name(FOLDER);
        let none = folder.trim().is_empty().then_some("Type a folder first.");
        let is_clicked = button(ui, "Compare", none);
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if (is_clicked || is_entered) && none.is_none() {
            commands.push(Command::Compare(CompareCommand::Load(PathBuf::from(
                folder.trim(),
            ))));
        }
    });
    if let Some(reference) = model.reference.as_ref() {
        ui.label(reference.told());
    }
}
