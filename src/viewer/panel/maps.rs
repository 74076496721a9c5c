//! Section *Maps*: each receiver's map with its size and error; and section *Compare*: two maps side by side.

mod large;

use std::collections::HashMap;
use std::path::PathBuf;

use egui::{
    Button, ColorImage, Image, RichText, ScrollArea, TextEdit, TextureHandle, TextureOptions, Ui, vec2,
};

use super::bake::two_digits;
use super::control::{about_button, ask, button, bytes, counted};
use super::effects::COUNTER;
use super::{Command, CompareCommand, Model, export};
use crate::bake::BYTES_PER_TEXEL;
use crate::illumination::{IlluminationMap, Side};
use crate::viewer::exporting::Export;
use crate::viewer::flat_map::{self, ShownPixels};

/// Side of a thumbnail [points].
const THUMBNAIL: f32 = 40.0;
/// Largest height of the list [points]: six maps.
const MAX_HEIGHT: f32 = 6.0 * (THUMBNAIL + 4.0);
/// Limit of the thumbnails made per frame; each takes about a millisecond.
const MAX_AT_ONCE: usize = 4;

const LOOK: &str = "Shows the map large, with the irradiance under the pointer.";
const ONE: &str = "Writes this map to an .exr file of its own in the working folder: each layer, their sum and the error \
                   [W/m²].";

/// Identifies the maps of the thumbnails: request number and level.
type ThumbnailKey = Option<(u64, u32)>;

/// State of the section between frames.
#[derive(Clone, Default)]
pub struct Browser {
    thumbnails: HashMap<usize, TextureHandle>,
    made_of: ThumbnailKey,
    large: Option<large::Large>,
}

/// Shows the section.
pub fn show(
    ui: &mut Ui,
    (browser, maps_folder): (&mut Browser, &str),
    model: &Model,
    commands: &mut Vec<Command>,
) {
    browser.keep_up(model);
    if model.maps().is_empty() {
        ui.label(RichText::new("There are no maps yet.").weak());
        return;
    }
    ui.horizontal(|ui| {
        let texels: usize = model.maps().iter().map(|map| map.chart.texel_count()).sum();
        let memory = bytes(texels as u64 * BYTES_PER_TEXEL);
        ui.label(format!("{} in {memory}", counted(model.maps().len(), "map")));
        export::all(ui, "Export all", maps_folder, model, commands);
    });

    // A few thumbnails are made per frame, the rest in the next ones: a long list does not stall the window.
    let mut still_to_make = MAX_AT_ONCE;

    // Limits the height, to keep the sections below within reach.
    let list = ScrollArea::vertical()
        .id_salt("maps")
        .max_height(MAX_HEIGHT)
        .auto_shrink([false, true]);
    list.show(ui, |ui| {
        for (index, map) in model.maps().iter().enumerate() {
            ui.push_id(index, |ui| {
                entry(ui, browser, (index, map), model, commands, &mut still_to_make)
            });
        }
    });
    if still_to_make == 0 {
        ui.request_repaint();
    }
}

/// Shows the selected map in a window over the picture.
pub fn show_large(ui: &Ui, browser: &mut Browser, model: &Model) {
    browser.keep_up(model);
    let Some(large) = &mut browser.large else {
        return;
    };
    let map = model.maps().get(large.map());
    if !map.is_some_and(|map| large.show(ui, map, &name(map, model))) {
        browser.large = None;
    }
}

impl Browser {
    /// Drops images of maps that are no longer shown.
    fn keep_up(&mut self, model: &Model) {
        let made_of = model.last.as_ref().map(|last| (last.serial, last.level));
        if made_of != self.made_of {
            self.made_of = made_of;
            self.thumbnails.clear();
            if let Some(large) = &mut self.large {
                large.forget_picture();
            }
        }
    }
}

fn entry(
    ui: &mut Ui,
    browser: &mut Browser,
    (index, map): (usize, &IlluminationMap),
    model: &Model,
    commands: &mut Vec<Command>,
    still_to_make: &mut usize,
) {
    let name = name(map, model);
    ui.horizontal(|ui| {
        // An empty button keeps the place of a thumbnail that is still to be made, so that rows do not jump.
        let texture = thumbnail(ui, browser, (index, map), still_to_make);
        let size = vec2(THUMBNAIL, THUMBNAIL);
        let button = match texture {
            Some(texture) => Button::image(Image::new(&texture).fit_to_exact_size(size)),
            None => Button::new("").min_size(size),
        };
        let look = ui.add(button.frame(false).min_size(size));
        let look = look.accessible_name(format!("Map of {name}")).on_hover_text(LOOK);
        if look.clicked() {
            browser.large = Some(large::Large::new(index));
        }

        // Beside it: name, figures, and the export of this map alone.
        ui.vertical(|ui| {
            ui.set_width(ui.available_width());
            ui.horizontal(|ui| {
                let reason = export::unavailable(model);
                let one = ui.add_enabled(reason.is_none(), Button::new("Export").small());
                let one = one.accessible_name(format!("Export map of {name}"));
                let one = one
                    .on_hover_text(ONE)
                    .on_disabled_hover_text(reason.unwrap_or_default());
                if one.clicked() {
                    commands.push(Command::Export(Export::Map(index)));
                }
                ui.add(egui::Label::new(RichText::new(&name).strong()).truncate());
            });
            ui.label(RichText::new(figures(map)).size(COUNTER));
        });
    });
}

/// "512 × 512 texels, 14.7 MB, error 2.1 %".
fn figures(map: &IlluminationMap) -> String {
    let memory = bytes(map.chart.texel_count() as u64 * BYTES_PER_TEXEL);
    let error = map.estimated_relative_rmse.map_or(String::new(), |error| {
        format!(", error {} %", two_digits(100.0 * error))
    });
    format!("{} × {} texels, {memory}{error}", map.width(), map.height())
}

/// Name of the object, marked if the map is of its back.
fn name(map: &IlluminationMap, model: &Model) -> String {
    let object = model.scene().objects.get(map.chart.object());
    let name = object.map_or("surface", |object| object.name.as_str());
    match map.chart.receiver.side() {
        Side::Front => name.to_owned(),
        Side::Back => format!("{name}, back"),
    }
}

/// Thumbnail of a visible map; `None` if it is not made yet.
fn thumbnail(
    ui: &Ui,
    browser: &mut Browser,
    (index, map): (usize, &IlluminationMap),
    still_to_make: &mut usize,
) -> Option<TextureHandle> {
    let place = egui::Rect::from_min_size(ui.cursor().min, vec2(THUMBNAIL, THUMBNAIL));
    let is_there = browser.thumbnails.contains_key(&index);
    if !is_there && *still_to_make > 0 && ui.is_rect_visible(place) {
        *still_to_make -= 1;
        let texture = texture(ui, "thumbnail", &flat_map::thumbnail(map), None);
        browser.thumbnails.insert(index, texture);
    }
    browser.thumbnails.get(&index).cloned()
}

/// Uploads pixels, reusing an older texture.
fn texture(ui: &Ui, name: &str, shown: &ShownPixels, old: Option<TextureHandle>) -> TextureHandle {
    let image = ColorImage::from_rgba_unmultiplied(shown.size, &shown.rgba);
    match old {
        Some(mut texture) => {
            texture.set(image, TextureOptions::NEAREST);
            texture
        }
        None => ui.ctx().load_texture(name, image, TextureOptions::NEAREST),
    }
}

/// Name of the field for assistive technology.
const FOLDER: &str = "Folder to compare with";

/// Shows the section *Compare*.
pub fn compare(ui: &mut Ui, folder: &mut String, model: &Model, commands: &mut Vec<Command>) {
    // The maps shown can be kept before a change, to be compared with those after it.
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

    // Enter in the field does what the button does.
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
        ui.label(reference.in_words());
    }
}
