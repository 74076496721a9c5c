//! The side panel: the scene, settings of the bake, its state, and display options. Knows egui, but no window.

pub mod accuracy;
mod bake;
pub mod control;
mod display;
mod effects;
mod export;
mod file;
mod film;
pub mod frame_graph;
mod light;
mod light_pass;
mod maps;
mod material;
mod motion;
mod probe;
mod scene;

use egui::{Align, CollapsingHeader, Color32, Frame, Grid, Margin, RichText, ScrollArea, Ui};
use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use self::scene::{PlaceTool, Selection};
use super::command::{Choices, Command, CompareCommand, FilmCommand};
use super::model::Model;
use super::navigation::{NavigationMode, Navigator};
pub use super::views::Quantity;
use super::views::ScaleChoice;
use crate::error::Warning;
use crate::eye_pass::{ToneMap, WhiteBalance};
use crate::settings::LayerKind;

/// [points].
pub const WIDTH: f32 = 360.0;
/// Colour of subsection titles.
const PART: Color32 = Color32::from_gray(160);

/// The layers that the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LayerShown {
    /// The sum of all baked layers.
    #[default]
    All,
    Only(LayerKind),
}

/// How the picture shows the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Display {
    /// Radiance is multiplied by 2^stops.
    pub exposure_stops: f64,
    /// Applied after the exposure.
    pub tone_map: ToneMap,
    /// Applied before the exposure.
    pub white_balance: WhiteBalance,
    pub layer: LayerShown,
    pub quantity: Quantity,
    /// Scale of irradiance in false colours.
    pub scale: ScaleChoice,
}

/// State of the panel between frames.
#[derive(Clone, Default)]
pub struct Panel {
    /// Whether probing was on in the last frame.
    probed: bool,
    /// The probe result that the section has scrolled to: its point, and whether paths were found.
    probe_shown: Option<(DVec3, bool)>,
    /// Typed folder of the maps to compare with.
    compare_folder: String,
    /// Typed file of a camera path.
    film_file: String,
    file: file::FileRow,
    /// Number of picks in the picture that have opened the section *Scene*.
    picks: u32,
    /// State of section *Maps*.
    maps: maps::Browser,
    /// Typed export folder for all maps; empty for the default.
    maps_folder: String,
    /// Whether section *Help* is open.
    pub help_open: bool,
    help_was_open: bool,
}

/// Dark, because the picture beside the panel is what the user judges; without animations, so that an idle window
/// draws nothing.
pub fn set_style(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    // Slow frames must not turn clicks into long presses.
    context.options_mut(|options| options.input_options.max_click_duration = f64::INFINITY);
    context.all_styles_mut(|style| {
        style.animation_time = 0.0;
        style.interaction.tooltip_delay = 0.3;
        // Labels carry units and must stay readable.
        style.visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(205);
        style.visuals.weak_text_color = Some(Color32::from_gray(150));
    });
}

impl Panel {
    /// Shows the panel at the left of the window; returns the user's commands.
    pub fn show(&mut self, ui: &mut Ui, model: &Model) -> Vec<Command> {
        let is_dragging = ui.input(|input| input.pointer.any_down()) || ui.text_edit_focused();
        let mut commands = Vec::new();
        let mut choices = model.choices.clone();
        let frame = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(8, 8));
        egui::Panel::left("panel")
            .exact_size(WIDTH)
            .resizable(false)
            .frame(frame)
            .show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 3.0;
                bake::header(ui, &mut choices, model, &mut commands);
                ui.separator();
                ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| self.sections(ui, &mut choices, model, &mut commands));
            });
        maps::show_large(ui, &mut self.maps, model);
        if choices != model.choices {
            commands.push(Command::Choose(Box::new(choices)));
        }
        if !is_dragging {
            commands.push(Command::Release);
        }
        commands
    }

    fn sections(&mut self, ui: &mut Ui, choices: &mut Choices, model: &Model, commands: &mut Vec<Command>) {
        // Sections follow the light: what is lit, how it is baked, the maps, how they are shown, and what is written.
        self.scene(ui, choices, model, commands);
        if model.can_play() {
            section(ui, "Motion", true, |ui| motion::show(ui, model, commands));
        }
        let (settings, last) = (&mut choices.settings, model.last.as_deref());
        section(ui, "Light pass", true, |ui| {
            light_pass::show(ui, settings);
            part(ui, "Rays and kernels", |ui| {
                light_pass::show_details(ui, settings)
            });
            part(ui, "Energy", |ui| bake::energy(ui, last));
        });
        section(ui, "Accuracy", true, |ui| {
            accuracy::show(ui, settings);
            let title = accuracy::course::title(settings, last);
            part(ui, &title, |ui| accuracy::course::show(ui, settings, last));
            part(ui, "Limits", |ui| accuracy::show_limits(ui, settings));
        });
        section(ui, "Effects", false, |ui| {
            effects::show(ui, &mut settings.effects, model, commands)
        });
        section(ui, "Maps", false, |ui| {
            maps::show(ui, (&mut self.maps, &self.maps_folder), model, commands)
        });
        section(ui, "Display", true, |ui| {
            display::show(ui, &mut choices.display, model, commands);
            let times = model.picture.frame_times.as_ref();
            part(ui, &frame_graph::title(times), |ui| frame_graph::show(ui, times));
        });
        section(ui, "Export", true, |ui| {
            export::show(ui, &mut self.maps_folder, model, commands)
        });
        section(ui, "Camera path", false, |ui| {
            film::show(ui, &mut choices.film, &mut self.film_file, model, commands)
        });
        self.probe(ui, choices, model, commands);
        section(ui, "Compare", false, |ui| {
            maps::compare(ui, &mut self.compare_folder, model, commands)
        });
        self.help(ui, &model.navigator);
    }

    /// Opens when something is picked in the picture.
    fn scene(&mut self, ui: &mut Ui, choices: &mut Choices, model: &Model, commands: &mut Vec<Command>) {
        let is_picked = model.choices.selection.picks > self.picks;
        self.picks = model.choices.selection.picks;
        CollapsingHeader::new(RichText::new("Scene").strong())
            .id_salt("Scene")
            .open(is_picked.then_some(true))
            .show_unindented(ui, |ui| {
                file::show(ui, (&mut self.file, &mut choices.watches), model, commands);
                scene::show(ui, &mut choices.selection, model, commands);
                warnings(ui, model);
            });
    }

    /// Opens and closes with the probe mode.
    fn probe(&mut self, ui: &mut Ui, choices: &mut Choices, model: &Model, commands: &mut Vec<Command>) {
        let is_switched = choices.probes != self.probed;
        self.probed = choices.probes;
        let shown = CollapsingHeader::new(RichText::new("Probe").strong())
            .id_salt("Probe")
            .open(is_switched.then_some(choices.probes))
            .show_unindented(ui, |ui| {
                probe::show(ui, (&mut choices.probes, &mut choices.sketched), model, commands)
            });
        let probed = model
            .probed()
            .map(|probed| (probed.point, probed.explanation.is_some()));
        let is_news = probed.is_some() && probed != self.probe_shown;
        self.probe_shown = probed;
        if is_news || (is_switched && choices.probes) {
            shown.header_response.scroll_to_me(Some(Align::TOP));
        }
    }

    fn help(&mut self, ui: &mut Ui, navigator: &Navigator) {
        let help = CollapsingHeader::new(RichText::new("Help").strong())
            .open(Some(self.help_open))
            .show(ui, |ui| keys(ui, navigator.travel(), navigator.speed_m_per_s()));
        if help.header_response.on_hover_text("The keys (H).").clicked() {
            self.help_open = !self.help_open;
        }
        if let Some(keys) = help
            .body_response
            .filter(|_| self.help_open && !self.help_was_open)
        {
            keys.scroll_to_me(Some(Align::BOTTOM));
        }
        self.help_was_open = self.help_open;
    }
}

fn warnings(ui: &mut Ui, model: &Model) {
    let last = model.last.as_deref();
    let baked: &[Warning] = last.map_or(&[], |last| &last.result.warnings);
    let warnings: Vec<_> = model.scene().warnings.iter().chain(baked).collect();
    if !warnings.is_empty() {
        part(ui, &format!("Warnings ({})", warnings.len()), |ui| {
            for warning in warnings {
                ui.colored_label(bake::ATTENTION, warning.to_string());
            }
        });
    }
}

fn section(ui: &mut Ui, name: &str, open: bool, add: impl FnOnce(&mut Ui)) {
    titled(ui, name, RichText::new(name).strong(), open, add);
}

/// A subsection, initially closed.
fn part(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) {
    titled(ui, name, RichText::new(name).color(PART), false, add);
}

fn titled(ui: &mut Ui, name: &str, title: RichText, open: bool, add: impl FnOnce(&mut Ui)) {
    // The title may contain a count, which must not change the id.
    let id = name.split(" (").next().unwrap_or(name);
    CollapsingHeader::new(title)
        .id_salt(id)
        .default_open(open)
        .show_unindented(ui, add);
}

/// Lists the keys for a navigation mode and its speed [m/s].
fn keys(ui: &mut Ui, travel: NavigationMode, speed_m_per_s: f64) {
    // Mouse and wheel act on the pivot in orbit, and on direction and speed otherwise.
    let (way, wheel) = match travel {
        NavigationMode::Fly | NavigationMode::Walk => (
            "hold to look around",
            format!("speed ±5 % a notch, now {speed_m_per_s:.3} m/s"),
        ),
        NavigationMode::Orbit => ("hold to orbit", "move nearer, farther".to_owned()),
    };
    let now = format!("fly, walk, orbit; now {}", travel.name());

    let lines = [
        ("V", now.as_str()),
        ("W A S D", "forward, left, back, right"),
        ("E  Q", "up, down (not when walking)"),
        ("Shift  Ctrl", "four times as fast, a quarter as fast"),
        ("Right mouse, M", way),
        ("Wheel", wheel.as_str()),
        ("1 … 9", "views kept with Ctrl+1 … Ctrl+9"),
        ("C", "next camera of the file"),
        ("F", "frame the selection, or the whole scene"),
        ("R", "bake again"),
        ("T", "let water and objects move, or stop them"),
        ("Ctrl+Z", "undo"),
        ("Ctrl+Y", "redo; also Ctrl+Shift+Z"),
        ("P", "probe: click on a surface to see what lights it"),
        ("K", "add a key to the camera path"),
        ("F12", "save the picture as .png and .exr"),
        ("Click", "select an object: handles move and turn it"),
        ("Esc", "release mouse and selection, cancel the bake"),
        ("H  ?", "open or close this list"),
    ];
    Grid::new("keys")
        .num_columns(2)
        .spacing([12.0, 2.0])
        .show(ui, |ui| {
            for (key, meaning) in lines {
                ui.label(RichText::new(key).strong());
                ui.label(meaning);
                ui.end_row();
            }
        });
}
