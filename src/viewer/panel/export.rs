//! Section *Export*: the picture and the maps as files.

use egui::{RichText, TextEdit, Ui, vec2};

use super::control::{CONTROL_WIDTH, button, row, rows};
use super::{Facts, Panel, Wishes, bake};
use crate::viewer::exporting::{Export, ExportState, folder_name};

/// Shows the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, facts: &Facts<'_>, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        wishes.save_picture |= button(ui, "Save picture", None);
        let folder = panel.maps_folder.clone();
        all(ui, "Export maps", &folder, facts, wishes);
        let built_in = facts.scene.source.starts_with("builtin:");
        let no_file =
            built_in.then_some("A built-in scene has no file that could be changed; its edits are kept.");
        wishes.save_scene |= button(ui, "Save scene…", no_file);
    });
    rows(ui, "export", |ui| {
        row(ui, "Maps folder", None, |ui| {
            let hint = folder_name(&facts.scene.name);
            let size = vec2(CONTROL_WIDTH, ui.spacing().interact_size.y);
            ui.add_sized(size, TextEdit::singleline(&mut panel.maps_folder).hint_text(hint))
        });
    });
    outcome(ui, facts);
}

/// A button that exports all maps.
pub fn all(ui: &mut Ui, name: &str, folder: &str, facts: &Facts<'_>, wishes: &mut Wishes) {
    if button(ui, name, unavailable(facts)) {
        let folder = folder.trim();
        let folder = if folder.is_empty() {
            folder_name(&facts.scene.name)
        } else {
            folder.to_owned()
        };
        wishes.export = Some(Export::All(folder.into()));
    }
}

/// Why no map can be exported now.
pub fn unavailable(facts: &Facts<'_>) -> Option<&'static str> {
    match facts.last {
        _ if facts.export.is_running() => Some("Something is being written."),
        None if facts.maps.is_empty() => Some("There are no maps yet."),
        None => Some("These maps were read from files; bake to export others."),
        Some(_) => None,
    }
}

/// How the last export got on, in one line.
pub fn outcome(ui: &mut Ui, facts: &Facts<'_>) {
    match facts.export {
        ExportState::Idle => {}
        ExportState::Writing => drop(ui.label("Writing maps…")),
        ExportState::Filming { done, total } => drop(ui.label(format!("Filming: {done} of {total} frames"))),
        ExportState::Done(path) => {
            ui.label(RichText::new(format!("Written: {}", path.display())).small());
        }
        ExportState::Failed(sentence) => drop(ui.colored_label(bake::FAILED, sentence)),
    }
}
