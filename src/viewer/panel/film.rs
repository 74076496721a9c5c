//! Section *Camera path*: keys, playing, and frames as files.

use egui::{DragValue, Response, RichText, TextEdit, Ui};

use super::control::{self, about_button, counted, rows, setting};
use super::{Command, FilmCommand, Model, export};
use crate::scene::camera_path::MAX_FRAMES;
use crate::viewer::filming::{FRAMES_PER_S, Film};

const TOO_FEW: &str = "A path has at least two keys.";
const FEW_CAMERAS: &str = "The scene has fewer than two cameras.";
const FIELD: &str = "Path file";

/// Range of a frame's sides [pixels].
const SIDES: std::ops::RangeInclusive<u32> = 16..=8192;

/// Shows the section; `file` is the typed path of the file.
pub fn show(ui: &mut Ui, film: &mut Film, file: &mut String, model: &Model, commands: &mut Vec<Command>) {
    // Recording and playing.
    let too_few = (film.keys.len() < 2).then_some(TOO_FEW);
    ui.horizontal(|ui| {
        ask(ui, "Add key", None, commands, FilmCommand::Record(None));
        if model.is_playing() {
            ask(ui, "Stop playing", None, commands, FilmCommand::Play(false));
        } else {
            ask(ui, "Play", too_few, commands, FilmCommand::Play(true));
        }
        let few_cameras = (model.scene().cameras.len() < 2).then_some(FEW_CAMERAS);
        ask(ui, "Tour", few_cameras, commands, FilmCommand::Tour);
        ui.label(RichText::new(length(film)).weak());
    });

    // The keys, and how they are filmed.
    keys(ui, film, commands);
    let default = Film::default();
    rows(ui, "film", |ui| {
        let frames = (&mut film.frames, &default.frames);
        setting(ui, "Frames", None, frames, |ui, frames| {
            ui.add(DragValue::new(frames).range(1..=MAX_FRAMES))
        });
        setting(ui, "Frame size", None, (&mut film.size, &default.size), size);
    });

    ui.horizontal(|ui| {
        // The path as a file, to and from disk.
        ask(ui, "Save path", too_few, commands, FilmCommand::Save);
        let field = TextEdit::singleline(file)
            .hint_text("path.json")
            .desired_width(150.0);
        ui.add(field)
            .accessible_name(FIELD)
            .on_hover_text(about_button("Load path"));
        let none = file.trim().is_empty().then_some("Type a file first.");
        ask(
            ui,
            "Load path",
            none,
            commands,
            FilmCommand::Load(file.trim().into()),
        );
    });

    // Frames on disk, and how that goes.
    let no_light = model.layers().is_empty().then_some("There are no maps yet.");
    let busy = model
        .exporter
        .state
        .is_running()
        .then_some("Something is being written.");
    ui.horizontal(|ui| {
        ask(
            ui,
            "Export frames",
            too_few.or(no_light).or(busy),
            commands,
            FilmCommand::Shoot { turns: false },
        );
        ask(
            ui,
            "Export turntable",
            no_light.or(busy),
            commands,
            FilmCommand::Shoot { turns: true },
        );
        let idle = (!model.exporter.state.is_running()).then_some("Nothing is filmed now.");
        ask(ui, "Stop", idle, commands, FilmCommand::Stop);
    });

    if let Some(message) = &model.film_message {
        ui.label(RichText::new(message).small());
    }
    export::outcome(ui, model);
}

fn ask(ui: &mut Ui, name: &str, why_not: Option<&str>, commands: &mut Vec<Command>, command: FilmCommand) {
    control::ask(ui, name, why_not, commands, Command::Film(command));
}

/// "2 keys, 4.0 s".
fn length(film: &Film) -> String {
    let keys = counted(film.keys.len(), "key");
    let seconds = film.frames as f64 / FRAMES_PER_S;
    format!("{keys}, {seconds:.1} s")
}

fn keys(ui: &mut Ui, film: &mut Film, commands: &mut Vec<Command>) {
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
                        "go" => commands.push(Command::Film(FilmCommand::GoTo(index))),
                        "set" => commands.push(Command::Film(FilmCommand::Record(Some(index)))),
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
