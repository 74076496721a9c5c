//! Section *Export*: the picture and the maps as files.

use egui::{Button, RichText, TextEdit, Ui, vec2};

use super::control::{About, CONTROL_WIDTH, row, rows};
use super::{Facts, Panel, Wishes, bake};
use crate::viewer::exporting::{Export, ExportState, folder_name};

const SAVE: &str = "Writes the picture without the panel into the working folder (F12): a .png as it is seen, and an .exr \
                    with its radiance in W/(m² sr), which neither exposure nor white balance nor tone map changes.";
const ALL: &str = "Writes every map [W/m²] as an .exr file, with generated coordinates and a manifest.json, to the folder \
                   named under Export: what `nephroid bake` writes.";
const FOLDER: About = About {
    label: "Maps folder",
    what: "Where all maps go: a folder of their own, in the working folder unless its whole path is given. One that holds \
           other files is refused; maps of an earlier bake are replaced.",
    range: "any place that can be written",
    default: "nephroid-SCENE-maps",
    accuracy: "none: maps are written as they are, in 32-bit floating point",
    cost: "disk space, about a third of the maps' memory",
};

const SAVE_SCENE: &str = "Writes the scene as it is edited to a .glb file: the file that was opened, with nothing changed but \
                          what was edited. Where the system has no dialog to name it in, it is written beside the original.";

/// Shows the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, facts: &Facts<'_>, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        let save = ui.button("Save picture").on_hover_text(SAVE);
        wishes.save_picture |= save.clicked();
        let folder = panel.maps_folder.clone();
        all(ui, "Export maps", &folder, facts, wishes);
        let has_file = !facts.scene.source.starts_with("builtin:");
        let save = ui
            .add_enabled(has_file, Button::new("Save scene…"))
            .on_hover_text(SAVE_SCENE)
            .on_disabled_hover_text(
                "A built-in scene has no file that could be changed; its edits are kept.",
            );
        wishes.save_scene |= save.clicked();
    });
    rows(ui, "export", |ui| {
        row(ui, &FOLDER, None, |ui| {
            let hint = folder_name(&facts.scene.name);
            let size = vec2(CONTROL_WIDTH, ui.spacing().interact_size.y);
            ui.add_sized(size, TextEdit::singleline(&mut panel.maps_folder).hint_text(hint))
        });
    });
    outcome(ui, facts);
}

/// A button that exports all maps.
pub fn all(ui: &mut Ui, name: &str, folder: &str, facts: &Facts<'_>, wishes: &mut Wishes) {
    let reason = unavailable(facts);
    let button = ui
        .add_enabled(reason.is_none(), Button::new(name))
        .on_hover_text(ALL)
        .on_disabled_hover_text(reason.unwrap_or_default());
    if button.clicked() {
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
