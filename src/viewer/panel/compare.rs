//! Two maps side by side: what the picture's right part shows.

use std::path::PathBuf;

use egui::{TextEdit, Ui};

use super::control::{about_button, button};
use super::{CompareWish, Facts, Wishes};

/// What the field is called by assistive technology.
const FOLDER: &str = "Folder to compare with";

/// Shows the controls.
pub fn show(ui: &mut Ui, folder: &mut String, facts: &Facts<'_>, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        let none = facts.layers.is_empty().then_some("There are no maps yet.");
        if button(ui, "Keep as before", none) {
            wishes.compare = Some(CompareWish::Keep);
        }
        let none = facts.reference.is_none().then_some("Nothing is compared now.");
        if button(ui, "End comparison", none) {
            wishes.compare = Some(CompareWish::End);
        }
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
            wishes.compare = Some(CompareWish::Load(PathBuf::from(folder.trim())));
        }
    });
    if let Some(reference) = facts.reference {
        ui.label(reference.told());
    }
}
