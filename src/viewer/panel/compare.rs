//! Two maps side by side: what the picture's right part shows.

use std::path::PathBuf;

use egui::{Button, TextEdit, Ui};

use super::{CompareWish, Facts, Wishes};

/// What the field is called by assistive technology.
const FOLDER: &str = "Folder to compare with";
const KEEP: &str = "Keeps the present maps: the picture's right part goes on showing them, the left part what comes. Drag \
                    the line between them. Takes the maps' memory once more.";
const LOAD: &str = "Shows the maps of a folder that `bake` wrote for this scene in the picture's right part.";
const END: &str = "Gives the whole picture back to the present maps.";

/// Shows the controls.
pub fn show(ui: &mut Ui, folder: &mut String, facts: &Facts<'_>, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        let keep = ui.add_enabled(!facts.layers.is_empty(), Button::new("Keep as before"));
        if keep
            .on_hover_text(KEEP)
            .on_disabled_hover_text("There are no maps yet.")
            .clicked()
        {
            wishes.compare = Some(CompareWish::Keep);
        }
        let end = ui.add_enabled(facts.reference.is_some(), Button::new("End comparison"));
        if end
            .on_hover_text(END)
            .on_disabled_hover_text("Nothing is compared now.")
            .clicked()
        {
            wishes.compare = Some(CompareWish::End);
        }
    });
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(folder)
            .hint_text("folder of maps")
            .desired_width(190.0);
        let field = ui.add(field).on_hover_text(LOAD).accessible_name(FOLDER);
        let load = ui.add_enabled(!folder.trim().is_empty(), Button::new("Compare"));
        let load = load
            .on_hover_text(LOAD)
            .on_disabled_hover_text("Type a folder first.");
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        if (load.clicked() || is_entered) && !folder.trim().is_empty() {
            wishes.compare = Some(CompareWish::Load(PathBuf::from(folder.trim())));
        }
    });
    if let Some(reference) = facts.reference {
        ui.label(reference.told());
    }
}
