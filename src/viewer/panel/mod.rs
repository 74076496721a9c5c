//! The side panel: edits of the scene, settings of the bake, its state, and how the picture shows it. Knows egui, but
//! no window.

pub mod accuracy;
mod bake;
mod compare;
pub mod control;
mod display;
mod effects;
mod export;
mod file;
mod film;
pub mod frame_graph;
mod glass;
mod header;
mod help;
mod light_colour;
mod light_pass;
mod light_size;
mod maps;
mod probe;
mod scene;
mod waves;

use std::path::PathBuf;
use std::sync::Arc;

use egui::{Align, CollapsingHeader, Color32, Frame, Margin, RichText, ScrollArea, Ui};
use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use self::scene::Placed;
use super::beside::Reference;
use super::exporting::{Export, ExportState};
use super::files::FileFacts;
use super::filming::Film;
use super::frame_times::FrameTimes;
use super::gizmo::Held;
use super::latency::Latencies;
use super::navigation::Travel;
use super::new_light::NewLight;
use super::probe::Probed;
use super::sketching::Sketched;
pub use super::views::Quantity;
use super::views::{MapSurvey, ScaleChoice};
use super::worker::{BakeState, BakedLevel, Worth};
use crate::effect::Effect;
use crate::error::Warning;
use crate::eye_pass::{ToneMap, WhiteBalance};
use crate::illumination::IlluminationMap;
use crate::light_pass::sketch::Sketch;
use crate::plan::EffectLine;
use crate::scene::{Edit, Scene};
use crate::settings::{BakeSettings, LayerKind};

/// Width of the panel [points].
pub const WIDTH: f32 = 360.0;
/// Titles of what is seldom opened.
const PART: Color32 = Color32::from_gray(160);

/// Which layer the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LayerShown {
    /// The sum of what was baked.
    #[default]
    All,
    /// One layer alone.
    Only(LayerKind),
}

/// How the picture shows the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Display {
    /// Radiance is multiplied by 2^stops.
    pub exposure_stops: f64,
    /// After the exposure.
    pub tone_map: ToneMap,
    /// Before it.
    pub white_balance: WhiteBalance,
    /// Which light.
    pub layer: LayerShown,
    /// The light, or something else about surfaces.
    pub quantity: Quantity,
    /// How irradiance is shown in false colours.
    pub scale: ScaleChoice,
}

impl Display {
    /// Sets what differs between two to what it is in the second; the rest stays.
    pub fn restore(&mut self, from: &Self, to: &Self) {
        fn set<T: PartialEq + Copy>(value: &mut T, from: T, to: T) {
            if from != to {
                *value = to;
            }
        }
        set(&mut self.exposure_stops, from.exposure_stops, to.exposure_stops);
        set(&mut self.tone_map, from.tone_map, to.tone_map);
        set(&mut self.white_balance, from.white_balance, to.white_balance);
        set(&mut self.layer, from.layer, to.layer);
        set(&mut self.quantity, from.quantity, to.quantity);
        set(&mut self.scale, from.scale, to.scale);
    }
}

/// What the user can set.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Of the next bake.
    pub settings: BakeSettings,
    /// Whether a change of a setting bakes by itself.
    pub automatic: bool,
    /// Of the picture.
    pub display: Display,
    /// Whether a click on the picture asks what lights the surface there.
    pub probes: bool,
    /// What is drawn of the light's way.
    pub sketched: Sketched,
    probed_before: bool,
    /// What the section has scrolled to: the point, and whether its paths were there.
    probe_told: Option<(DVec3, bool)>,
    /// Folder of the maps to compare with, as it is typed.
    compare_folder: String,
    /// The camera's path.
    pub film: Film,
    /// File of a path, as it is typed.
    film_file: String,
    /// Which scene is in the window.
    file: file::FileRow,
    /// What is edited.
    selection: scene::Selection,
    /// What is kept of section *Maps*.
    maps: maps::Browser,
    /// Where all maps are exported to; empty for the folder of the scene's name.
    pub maps_folder: String,
    /// Whether the list of keys is open.
    pub help_open: bool,
    help_was_open: bool,
}

/// What the panel tells.
#[derive(Clone, Copy, Debug)]
pub struct Facts<'a> {
    /// The scene in the window, edited or not.
    pub scene: &'a Arc<Scene>,
    /// As it was before every edit.
    pub loaded: &'a Scene,
    /// What would be taken back.
    pub undo: Option<&'a str>,
    /// What would be done again.
    pub redo: Option<&'a str>,
    /// Why the last edit was refused.
    pub refusal: Option<&'a str>,
    /// Where the bake stands.
    pub state: &'a BakeState,
    /// The maps that the picture shows.
    pub last: Option<&'a BakedLevel>,
    /// The same maps, or those that were baked before the start.
    pub maps: &'a [IlluminationMap],
    /// How the last export of maps got on.
    pub export: &'a ExportState,
    /// Layers of the maps that the picture shows.
    pub layers: &'a [LayerKind],
    /// What these maps hold, as a whole.
    pub survey: &'a MapSurvey,
    /// What the picture's right part shows.
    pub reference: Option<&'a Reference>,
    /// The point that was asked about.
    pub probed: Option<&'a Probed>,
    /// How light runs, where that is drawn.
    pub sketch: Option<&'a Sketch>,
    /// Whether the camera's path is being played.
    pub is_playing: bool,
    /// What became of the last file of a path.
    pub film_told: Option<&'a str>,
    /// Whether these maps tell how far they may be off.
    pub has_errors: bool,
    /// What an effect is worth to these maps, where that was asked for.
    pub worth: Option<&'a Worth>,
    /// Whether the picture that is shown has the eye's chains, and why.
    pub chains: Option<&'a EffectLine>,
    /// How long the last pictures took; `None` where the device cannot tell.
    pub frame_times: Option<&'a FrameTimes>,
    /// From events to frames.
    pub latencies: &'a Latencies,
    /// How the camera gets about.
    pub travel: Travel,
    /// Its speed [m/s].
    pub speed_m_per_s: f64,
    /// Whether the graphics device was lost a short while ago, and came back.
    pub lost_device: bool,
    /// What is told of files.
    pub files: FileFacts<'a>,
    /// What draws the picture.
    pub adapter: &'a str,
}

/// What is to become of the comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CompareWish {
    /// Hold what comes against the present maps.
    Keep,
    /// Hold the present maps against those of a folder.
    Load(PathBuf),
    /// End it.
    End,
}

/// What is to become of the camera's path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FilmWish {
    /// Note the present camera: as a new key, or in the place of one.
    Record(Option<usize>),
    /// Go to a key.
    GoTo(usize),
    /// Play it, or end that.
    Play(bool),
    /// Make it one past the scene's cameras, and play that.
    Tour,
    /// Write it to a file.
    Save,
    /// Read it from a file.
    Load(PathBuf),
    /// Draw its frames, or those of a turn around the scene, and write them.
    Shoot {
        /// Around the scene.
        turns: bool,
    },
    /// Draw no more frames.
    Stop,
}

/// What the user pressed.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// Bake now.
    pub rebake: bool,
    /// Stop the bake.
    pub cancel: bool,
    /// Choose the exposure from the picture.
    pub measure_exposure: bool,
    /// Write the picture to files.
    pub save_picture: bool,
    /// Write maps to files.
    pub export: Option<Export>,
    /// Find what this effect is worth to the maps that are shown.
    pub worth: Option<Effect>,
    /// Compare, or stop comparing.
    pub compare: Option<CompareWish>,
    /// Record, play or film the camera's path.
    pub film: Option<FilmWish>,
    /// Forget the point that was asked about.
    pub clear_probe: bool,
    /// Go to the brightest spot, and ask about it.
    pub brightest: bool,
    /// Add a light before what is looked at.
    pub new_light: Option<NewLight>,
    /// Open this scene: a path as it was typed, or `builtin:NAME`.
    pub open: Option<String>,
    /// Choose a scene to open in the system's dialog.
    pub browse: bool,
    /// Write the edited scene to a file.
    pub save_scene: bool,
    /// Change the scene.
    pub edit: Option<Edit>,
    /// Take the last change back.
    pub undo: bool,
    /// Do again what was taken back last.
    pub redo: bool,
    /// Settings and display before they were changed here.
    pub changed: Option<Box<(BakeSettings, Display)>>,
    /// The camera's path before it was changed here.
    pub changed_film: Option<Box<Film>>,
    /// Whether baking by itself was switched here.
    pub changed_automatic: bool,
    /// Whether the mouse is held or a number being typed: changes that follow one another then are one.
    pub is_dragging: bool,
}

/// Dark, since the picture beside it is what is to be judged; without animations, so that an idle window rests.
pub fn set_style(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    // A press is a click however long the frame takes that first sees it.
    context.options_mut(|options| options.input_options.max_click_duration = f64::INFINITY);
    context.all_styles_mut(|style| {
        style.animation_time = 0.0;
        style.interaction.tooltip_delay = 0.3;
        // Labels carry units here: they are to be read, not to recede.
        style.visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(205);
        style.visuals.weak_text_color = Some(Color32::from_gray(150));
    });
}

impl Wishes {
    /// What was pressed here or there.
    pub fn and(self, other: Self) -> Self {
        Self {
            rebake: self.rebake || other.rebake,
            cancel: self.cancel || other.cancel,
            measure_exposure: self.measure_exposure || other.measure_exposure,
            save_picture: self.save_picture || other.save_picture,
            export: other.export.or(self.export),
            worth: other.worth.or(self.worth),
            compare: other.compare.or(self.compare),
            film: other.film.or(self.film),
            clear_probe: self.clear_probe || other.clear_probe,
            brightest: self.brightest || other.brightest,
            new_light: other.new_light.or(self.new_light),
            open: other.open.or(self.open),
            browse: self.browse || other.browse,
            save_scene: self.save_scene || other.save_scene,
            edit: other.edit.or(self.edit),
            undo: self.undo || other.undo,
            redo: self.redo || other.redo,
            changed: self.changed.or(other.changed),
            changed_film: self.changed_film.or(other.changed_film),
            changed_automatic: self.changed_automatic ^ other.changed_automatic,
            is_dragging: self.is_dragging || other.is_dragging,
        }
    }
}

impl Panel {
    /// A panel with these settings, everything else at its default.
    pub fn new(settings: BakeSettings) -> Self {
        Self {
            settings,
            automatic: true,
            display: Display::default(),
            probes: false,
            sketched: Sketched::default(),
            probed_before: false,
            probe_told: None,
            compare_folder: String::new(),
            film: Film::default(),
            film_file: String::new(),
            file: file::FileRow::default(),
            selection: scene::Selection::default(),
            maps: maps::Browser::default(),
            maps_folder: String::new(),
            help_open: false,
            help_was_open: false,
        }
    }

    /// Whether the scene is read again when its files change.
    pub fn watches(&self) -> bool {
        self.file.watches
    }

    /// Whether it is from now on.
    pub fn watch(&mut self, watches: bool) {
        self.file.watches = watches;
    }

    /// Nothing is chosen any more: the scene is another one.
    pub fn forget_selection(&mut self) {
        self.selection = scene::Selection::default();
    }

    /// What has handles in the picture.
    pub fn held(&self) -> Option<Held> {
        self.selection.held()
    }

    /// The light that clicks in the picture put elsewhere, or turn.
    pub fn placed_light(&self) -> Option<Placed> {
        self.selection.placed()
    }

    /// Gives handles to something, or to nothing any more.
    pub fn hold(&mut self, held: Option<Held>) {
        self.selection.hold(held);
    }

    /// Shows the panel at the left and returns what was pressed.
    pub fn show(&mut self, ui: &mut Ui, facts: &Facts<'_>) -> Wishes {
        let mut wishes = Wishes {
            is_dragging: ui.input(|input| input.pointer.any_down()) || ui.text_edit_focused(),
            ..Wishes::default()
        };
        let before = (self.settings.clone(), self.display);
        let (film_before, was_automatic) = (self.film.clone(), self.automatic);
        let frame = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(8, 8));
        egui::Panel::left("panel")
            .exact_size(WIDTH)
            .resizable(false)
            .frame(frame)
            .show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 3.0;
                header::show(ui, self, facts, &mut wishes);
                ui.separator();
                ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| self.sections(ui, facts, &mut wishes));
            });
        maps::show_large(ui, &mut self.maps, facts);
        if before != (self.settings.clone(), self.display) {
            wishes.changed = Some(Box::new(before));
        }
        if film_before != self.film {
            wishes.changed_film = Some(Box::new(film_before));
        }
        wishes.changed_automatic = was_automatic != self.automatic;
        wishes
    }

    fn sections(&mut self, ui: &mut Ui, facts: &Facts<'_>, wishes: &mut Wishes) {
        self.scene(ui, facts, wishes);
        section(ui, "Light pass", true, |ui| {
            light_pass::show(ui, &mut self.settings);
            part(ui, "Rays and kernels", |ui| {
                light_pass::show_details(ui, &mut self.settings)
            });
            part(ui, "Energy", |ui| bake::energy(ui, facts.last));
        });
        section(ui, "Accuracy", true, |ui| {
            accuracy::show(ui, &mut self.settings);
            part(ui, &accuracy::course::title(&self.settings, facts.last), |ui| {
                accuracy::course::show(ui, &mut self.settings, facts.last)
            });
            part(ui, "Limits", |ui| accuracy::show_limits(ui, &mut self.settings));
        });
        section(ui, "Effects", false, |ui| {
            effects::show(ui, &mut self.settings.effects, facts, wishes)
        });
        section(ui, "Maps", false, |ui| maps::show(ui, self, facts, wishes));
        section(ui, "Display", true, |ui| {
            display::show(ui, &mut self.display, facts, wishes);
            part(ui, &frame_graph::title(facts.frame_times), |ui| {
                frame_graph::show(ui, facts.frame_times);
                frame_graph::waits(ui, facts.latencies);
            });
        });
        section(ui, "Export", true, |ui| export::show(ui, self, facts, wishes));
        section(ui, "Camera path", false, |ui| {
            film::show(ui, &mut self.film, &mut self.film_file, facts, wishes)
        });
        self.probe(ui, facts, wishes);
        section(ui, "Compare", false, |ui| {
            compare::show(ui, &mut self.compare_folder, facts, wishes)
        });
        self.help(ui, facts);
    }

    /// Opens where something is picked in the picture.
    fn scene(&mut self, ui: &mut Ui, facts: &Facts<'_>, wishes: &mut Wishes) {
        let must_open = std::mem::take(&mut self.selection.must_open);
        CollapsingHeader::new(RichText::new("Scene").strong())
            .id_salt("Scene")
            .open(must_open.then_some(true))
            .show_unindented(ui, |ui| {
                file::show(ui, &mut self.file, facts, wishes);
                scene::show(ui, &mut self.selection, facts, wishes);
                warnings(ui, facts);
            });
    }

    /// Opens with the mode and closes with it.
    fn probe(&mut self, ui: &mut Ui, facts: &Facts<'_>, wishes: &mut Wishes) {
        let is_switched = self.probes != self.probed_before;
        self.probed_before = self.probes;
        let shown = CollapsingHeader::new(RichText::new("Probe").strong())
            .id_salt("Probe")
            .open(is_switched.then_some(self.probes))
            .show_unindented(ui, |ui| {
                probe::show(ui, (&mut self.probes, &mut self.sketched), facts, wishes)
            });
        let told = facts
            .probed
            .map(|probed| (probed.point, probed.explanation.is_some()));
        let is_news = told.is_some() && told != self.probe_told;
        self.probe_told = told;
        if is_news || (is_switched && self.probes) {
            shown.header_response.scroll_to_me(Some(Align::TOP));
        }
    }

    fn help(&mut self, ui: &mut Ui, facts: &Facts<'_>) {
        let help = CollapsingHeader::new(RichText::new("Help").strong())
            .open(Some(self.help_open))
            .show(ui, |ui| help::show(ui, facts.travel, facts.speed_m_per_s));
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

fn warnings(ui: &mut Ui, facts: &Facts<'_>) {
    let baked: &[Warning] = facts.last.map_or(&[], |last| &last.result.warnings);
    let warnings: Vec<_> = facts.scene.warnings.iter().chain(baked).collect();
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

/// A section within another, closed at first.
fn part(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui)) {
    titled(ui, name, RichText::new(name).color(PART), false, add);
}

fn titled(ui: &mut Ui, name: &str, title: RichText, open: bool, add: impl FnOnce(&mut Ui)) {
    // The text may carry a count; the section stays the same one.
    let id = name.split(" (").next().unwrap_or(name);
    CollapsingHeader::new(title)
        .id_salt(id)
        .default_open(open)
        .show_unindented(ui, add);
}
