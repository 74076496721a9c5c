//! Row *File*: opens scenes.

use std::path::Path;

use egui::{Checkbox, Key, TextEdit, Ui, vec2};

use super::control::{CONTROL_WIDTH, about_button, ask, row, rows};
use super::{Command, Model, bake};
use crate::scene::builtin;

/// Typed text of the row.
#[derive(Clone, Debug, Default)]
pub struct FileRow {
    text: String,
    /// Source of the scene when the text was typed.
    of: String,
}

/// Shows what is being loaded, and what could not be.
pub fn show_state(ui: &mut Ui, model: &Model) {
    if let Some(source) = model.files.loading() {
        let name = Path::new(source).file_name().map(|name| name.to_string_lossy());
        ui.label(format!("loading {} …", name.as_deref().unwrap_or(source)))
            .on_hover_text(source);
    }
    if let Some(warning) = &model.files.warning {
        ui.colored_label(bake::ATTENTION, warning);
    }
    if let Some(refusal) = &model.files.refusal {
        ui.colored_label(bake::FAILED, refusal);
    }
}

/// Shows the row and its buttons; pushes commands.
pub fn show(
    ui: &mut Ui,
    (file, watches): (&mut FileRow, &mut bool),
    model: &Model,
    commands: &mut Vec<Command>,
) {
    if file.of != model.scene().source {
        file.of.clone_from(&model.scene().source);
        file.text.clone_from(&model.scene().source);
    }
    rows(ui, "file", |ui| {
        row(ui, "File", None, |ui| {
            let size = vec2(CONTROL_WIDTH, ui.spacing().interact_size.y);
            let field = ui.add_sized(size, TextEdit::singleline(&mut file.text));
            if field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter)) {
                commands.push(Command::Open(file.text.clone()));
            }
            field
        });
    });
    ui.horizontal(|ui| {
        buttons(ui, model, commands);
        let is_file = !model.scene().source.starts_with("builtin:");
        ui.add_enabled(is_file, Checkbox::new(watches, "watch"))
            .on_hover_text(about_button("watch"))
            .on_disabled_hover_text("A built-in scene has no file that could change.");
    });
}

fn buttons(ui: &mut Ui, model: &Model, commands: &mut Vec<Command>) {
    ask(ui, "Open…", None, commands, Command::Browse);
    ui.add_enabled_ui(!model.files.recent.paths().is_empty(), |ui| {
        ui.menu_button("Recent", |ui| {
            for path in model.files.recent.paths() {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let full = path.display().to_string();
                if ui.button(name).on_hover_text(&full).clicked() {
                    commands.push(Command::Open(full));
                }
            }
        })
        .response
        .on_hover_text("Files that were opened before, the newest first.")
        .on_disabled_hover_text("No file was opened yet.");
    });
    ui.menu_button("Built-in", |ui| {
        for name in builtin::NAMES {
            if ui.button(name).clicked() {
                commands.push(Command::Open(format!("builtin:{name}")));
            }
        }
    })
    .response
    .on_hover_text("Scenes that come with the program.");
}
