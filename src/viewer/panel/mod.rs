//! The side panel: edits of the scene, settings of the bake, its state, and how the picture shows it. Knows egui, but
//! no window.

mod bake;
pub mod control;
mod display;
mod effects;
pub mod frame_graph;
mod help;
mod light_pass;
mod light_size;
mod scene;
mod waves;
mod worth;

use std::sync::Arc;

use egui::{Align, CollapsingHeader, Frame, Label, Layout, Margin, RichText, ScrollArea, Ui};

use super::frame_times::FrameTimes;
use super::navigation::Travel;
use super::worker::{BakeState, BakedLevel, Worth};
use crate::effect::Effect;
use crate::error::Warning;
use crate::eye_pass::{ToneMap, WhiteBalance};
use crate::scene::{Edit, Scene};
use crate::session::EffectReport;
use crate::settings::{BakeSettings, LayerKind};

/// Width of the panel [points].
pub const WIDTH: f32 = 344.0;

const SAVE: &str = "Writes the picture without the panel into the working folder (F12): a .png as it is seen, and an .exr \
                    with its radiance in W/(m² sr), which neither exposure nor white balance nor tone map changes.";

/// Which layer the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerShown {
    /// The sum of what was baked.
    #[default]
    All,
    /// One layer alone.
    Only(LayerKind),
}

/// What of the maps the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quantity {
    /// The lit scene.
    #[default]
    Light,
    /// How far the light may be off, in false colours.
    Error,
    /// What an effect adds to the light or takes from it, in false colours.
    Difference,
}

impl Quantity {
    /// Its name in the event log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Error => "error",
            Self::Difference => "difference",
        }
    }
}

/// How the picture shows the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Radiance is multiplied by 2^stops.
    pub exposure_stops: f64,
    /// After the exposure.
    pub tone_map: ToneMap,
    /// Before it.
    pub white_balance: WhiteBalance,
    /// Which light.
    pub layer: LayerShown,
    /// The light, its error or a difference.
    pub quantity: Quantity,
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
    /// What is edited.
    selection: scene::Selection,
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
    /// Edits that can be taken back.
    pub undoable: usize,
    /// Why the last edit was refused.
    pub refusal: Option<&'a str>,
    /// Where the bake stands.
    pub state: &'a BakeState,
    /// The maps that the picture shows.
    pub last: Option<&'a BakedLevel>,
    /// Layers of the maps that the picture shows.
    pub layers: &'a [LayerKind],
    /// Whether these maps tell how far they may be off.
    pub has_errors: bool,
    /// What an effect is worth to these maps, where that was asked for.
    pub worth: Option<&'a Worth>,
    /// The eye's chains in the picture that is shown.
    pub chains: Option<&'a EffectReport>,
    /// How long the last pictures took; `None` where the device cannot tell.
    pub frame_times: Option<&'a FrameTimes>,
    /// How the camera gets about.
    pub travel: Travel,
    /// Its speed [m/s].
    pub speed_m_per_s: f64,
    /// What draws the picture.
    pub adapter: &'a str,
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
    /// Find what this effect is worth to the maps that are shown.
    pub worth: Option<Effect>,
    /// Change the scene.
    pub edit: Option<Edit>,
    /// Take the last change of the scene back.
    pub undo: bool,
    /// Whether the mouse is held: edits that follow one another then are one.
    pub is_dragging: bool,
}

/// Dark, since the picture beside it is what is to be judged; without animations, so that an idle window rests.
pub fn set_style(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    context.all_styles_mut(|style| {
        style.animation_time = 0.0;
        style.interaction.tooltip_delay = 0.3;
        // Labels carry units here: they are to be read, not to recede.
        style.visuals.widgets.noninteractive.fg_stroke.color = egui::Color32::from_gray(205);
        style.visuals.weak_text_color = Some(egui::Color32::from_gray(150));
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
            worth: other.worth.or(self.worth),
            edit: other.edit.or(self.edit),
            undo: self.undo || other.undo,
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
            selection: scene::Selection::default(),
            help_open: false,
            help_was_open: false,
        }
    }

    /// Shows the panel at the left and returns what was pressed.
    pub fn show(&mut self, ui: &mut Ui, facts: &Facts<'_>) -> Wishes {
        let mut wishes = Wishes {
            is_dragging: ui.input(|input| input.pointer.any_down()),
            ..Wishes::default()
        };
        let frame = Frame::side_top_panel(ui.style()).inner_margin(Margin::symmetric(10, 8));
        egui::Panel::left("panel")
            .exact_size(WIDTH)
            .resizable(false)
            .frame(frame)
            .show(ui, |ui| {
                ScrollArea::vertical()
                    .auto_shrink(false)
                    .show(ui, |ui| self.sections(ui, facts, &mut wishes));
            });
        wishes
    }

    fn sections(&mut self, ui: &mut Ui, facts: &Facts<'_>, wishes: &mut Wishes) {
        ui.spacing_mut().item_spacing.y = 3.0;
        title(ui, facts, wishes);
        section(ui, "Scene", true, |ui| {
            scene::show(ui, &mut self.selection, facts, wishes)
        });
        section(ui, "Light pass", true, |ui| {
            light_pass::show(ui, &mut self.settings)
        });
        section(ui, "Rays and kernels", false, |ui| {
            light_pass::show_details(ui, &mut self.settings)
        });
        section(ui, "Bake", true, |ui| bake::show(ui, self, facts, wishes));
        section(ui, "Display", true, |ui| {
            display::show(ui, &mut self.display, facts, wishes)
        });
        section(ui, "Energy", false, |ui| bake::energy(ui, facts.last));
        section(ui, "Effects", false, |ui| {
            effects::show(ui, &mut self.settings.effects, facts, wishes)
        });
        section(ui, &frame_graph::title(facts.frame_times), false, |ui| {
            frame_graph::show(ui, facts.frame_times)
        });
        let baked: &[Warning] = facts.last.map_or(&[], |last| &last.result.warnings);
        let warnings: Vec<_> = facts.scene.warnings.iter().chain(baked).collect();
        if !warnings.is_empty() {
            section(ui, &format!("Warnings ({})", warnings.len()), false, |ui| {
                list(ui, &warnings)
            });
        }
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

fn title(ui: &mut Ui, facts: &Facts<'_>, wishes: &mut Wishes) {
    let scene = facts.scene;
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let save = ui.button("Save picture").on_hover_text(SAVE);
            wishes.save_picture |= save.clicked();
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let name = Label::new(RichText::new(&scene.name).heading()).truncate();
                ui.add(name).on_hover_text(&scene.source);
            });
        });
    });
    ui.label(
        RichText::new(format!(
            "{}, {}, {}",
            control::counted(scene.objects.len(), "object"),
            control::counted(scene.triangle_count(), "triangle"),
            control::counted(scene.lights.len(), "light")
        ))
        .weak(),
    )
    .on_hover_text(format!("Drawn by {}.", facts.adapter));
}

fn section(ui: &mut Ui, name: &str, open: bool, add: impl FnOnce(&mut Ui)) {
    // The text may carry a count; the section stays the same one.
    let id = name.split(" (").next().unwrap_or(name);
    CollapsingHeader::new(RichText::new(name).strong())
        .id_salt(id)
        .default_open(open)
        .show_unindented(ui, add);
}

fn list(ui: &mut Ui, warnings: &[&Warning]) {
    for warning in warnings {
        ui.colored_label(bake::ATTENTION, warning.to_string());
    }
}
