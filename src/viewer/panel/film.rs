//! Section *Camera path*: keys, playing, and frames as files.

use egui::{DragValue, Response, RichText, TextEdit, Ui};

use super::control::{about_button, button, counted, rows, setting};
use super::{Facts, FilmWish, Wishes, export};
use crate::scene::camera_path::MAX_FRAMES;
use crate::viewer::filming::{FRAMES_PER_S, Film};

const TOO_FEW: &str = "A path has at least two keys.";
const FEW_CAMERAS: &str = "The scene has fewer than two cameras.";
const FIELD: &str = "Path file";

/// Sides of a frame that can be set [pixels].
const SIDES: std::ops::RangeInclusive<u32> = 16..=8192;

/// Shows the section; `file` is what is typed as the path's file.
pub fn show(ui: &mut Ui, film: &mut Film, file: &mut String, facts: &Facts<'_>, wishes: &mut Wishes) {
    let too_few = (film.keys.len() < 2).then_some(TOO_FEW);
    let mut wish = |asked: FilmWish| wishes.film = Some(asked);
    ui.horizontal(|ui| {
        if button(ui, "Add key", None) {
            wish(FilmWish::Record(None));
        }
        if facts.is_playing {
            if button(ui, "Stop playing", None) {
                wish(FilmWish::Play(false));
            }
        } else if button(ui, "Play", too_few) {
            wish(FilmWish::Play(true));
        }
        let few_cameras = (facts.scene.cameras.len() < 2).then_some(FEW_CAMERAS);
        if button(ui, "Tour", few_cameras) {
            wish(FilmWish::Tour);
        }
        ui.label(RichText::new(length(film)).weak());
    });
    if let Some(asked) = keys(ui, film) {
        wish(asked);
    }
    let default = Film::default();
    rows(ui, "film", |ui| {
        setting(
            ui,
            "Frames",
            None,
            (&mut film.frames, &default.frames),
            |ui, frames| ui.add(DragValue::new(frames).range(1..=MAX_FRAMES)),
        );
        setting(ui, "Frame size", None, (&mut film.size, &default.size), size);
    });
    ui.horizontal(|ui| {
        if button(ui, "Save path", too_few) {
            wish(FilmWish::Save);
        }
        let field = TextEdit::singleline(file)
            .hint_text("path.json")
            .desired_width(150.0);
        ui.add(field)
            .accessible_name(FIELD)
            .on_hover_text(about_button("Load path"));
        let none = file.trim().is_empty().then_some("Type a file first.");
        if button(ui, "Load path", none) {
            wish(FilmWish::Load(file.trim().into()));
        }
    });
    let no_light = facts.layers.is_empty().then_some("There are no maps yet.");
    let busy = facts.export.is_running().then_some("Something is being written.");
    ui.horizontal(|ui| {
        if button(ui, "Export frames", too_few.or(no_light).or(busy)) {
            wish(FilmWish::Shoot { turns: false });
        }
        if button(ui, "Export turntable", no_light.or(busy)) {
            wish(FilmWish::Shoot { turns: true });
        }
        let idle = (!facts.export.is_running()).then_some("Nothing is filmed now.");
        if button(ui, "Stop", idle) {
            wish(FilmWish::Stop);
        }
    });
    if let Some(told) = facts.film_told {
        ui.label(RichText::new(told).small());
    }
    export::outcome(ui, facts);
}

/// A button that says what it does, or why it cannot; tells whether it was pressed.
fn length(film: &Film) -> String {
    let keys = counted(film.keys.len(), "key");
    let seconds = film.frames as f64 / FRAMES_PER_S;
    format!("{keys}, {seconds:.1} s")
}

/// A row for each key.
fn keys(ui: &mut Ui, film: &mut Film) -> Option<FilmWish> {
    let mut wish = None;
    let mut gone = None;
    for (index, key) in film.keys.iter().enumerate() {
        ui.horizontal(|ui| {
            let number = index + 1;
            let [x, y, z] = key.position_m.to_array();
            for (name, what) in [
                ("go", "Goes to this key."),
                ("set", "Puts the present place and gaze in this key's place."),
                ("delete", "Takes this key out of the path."),
            ] {
                let button = ui.small_button(name).on_hover_text(what);
                if button.accessible_name(format!("Key {number}: {name}")).clicked() {
                    match name {
                        "go" => wish = Some(FilmWish::GoTo(index)),
                        "set" => wish = Some(FilmWish::Record(Some(index))),
                        _ => gone = Some(index),
                    }
                }
            }
            ui.label(RichText::new(format!("{number}: {x:.2}, {y:.2}, {z:.2} m")).weak());
        });
    }
    if let Some(index) = gone {
        film.keys.remove(index);
    }
    wish
}

fn size(ui: &mut Ui, (width, height): &mut (u32, u32)) -> Response {
    ui.horizontal(|ui| {
        let across = ui.add(DragValue::new(width).range(SIDES));
        ui.label("×");
        let up = ui.add(DragValue::new(height).range(SIDES));
        across.union(up.accessible_name("Frame size: height"))
    })
    .inner
}
