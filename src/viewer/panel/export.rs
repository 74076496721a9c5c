//! Section *Export*: the picture and the maps as files.

use egui::{RichText, TextEdit, Ui, vec2};

use super::control::{CONTROL_WIDTH, ask, row, rows};
use super::{Command, Model, bake};
use crate::viewer::exporting::{Export, ExportState, folder_name};

pub fn show(ui: &mut Ui, maps_folder: &mut String, model: &Model, commands: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        ask(ui, "Save picture", None, commands, Command::SavePicture);
        all(ui, "Export maps", maps_folder, model, commands);
        let built_in = model.scene().source.starts_with("builtin:");
        let no_file =
            built_in.then_some("A built-in scene has no file that could be changed; its edits are kept.");
        ask(ui, "Save scene…", no_file, commands, Command::SaveScene);
    });
    rows(ui, "export", |ui| {
        row(ui, "Maps folder", None, |ui| {
            let hint = folder_name(&model.scene().name);
            let size = vec2(CONTROL_WIDTH, ui.spacing().interact_size.y);
            ui.add_sized(size, TextEdit::singleline(maps_folder).hint_text(hint))
        });
    });
    outcome(ui, model);
}

/// A button that exports all maps to a folder; an empty name means the default.
pub fn all(ui: &mut Ui, name: &str, folder: &str, model: &Model, commands: &mut Vec<Command>) {
    let folder = match folder.trim() {
        "" => folder_name(&model.scene().name),
        named => named.to_owned(),
    };
    let export = Command::Export(Export::All(folder.into()));
    ask(ui, name, unavailable(model), commands, export);
}

/// Why maps cannot be exported at present.
pub fn unavailable(model: &Model) -> Option<&'static str> {
    match model.last {
        _ if model.exporter.state.is_running() => Some("Something is being written."),
        None if model.maps().is_empty() => Some("There are no maps yet."),
        None => Some("These maps were read from files; bake to export others."),
        Some(_) => None,
    }
}

/// State of the last export, in one line.
pub fn outcome(ui: &mut Ui, model: &Model) {
    match &model.exporter.state {
        ExportState::Idle => {}
        ExportState::Writing => drop(ui.label("Writing maps…")),
        ExportState::Filming { done, total } => drop(ui.label(format!("Filming: {done} of {total} frames"))),
        ExportState::Done(path) => {
            ui.label(RichText::new(format!("Written: {}", path.display())).small());
        }
        ExportState::Failed(sentence) => drop(ui.colored_label(bake::FAILED, sentence)),
    }
}
