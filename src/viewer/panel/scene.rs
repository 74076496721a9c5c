//! Section *Scene*: lights, materials, positions and rotations.

use egui::{DragValue, Response, RichText, Ui};
use glam::DVec3;
use strum::EnumMessage;

use super::control::{CONTROL_WIDTH, about, about_button, counted, pick_name, row, rows, setting};
use super::{Command, Model, bake, light, material};
use crate::scene::{Edit, Motion, Scene, why_light_stays};
use crate::viewer::gizmo::GizmoTarget;
use crate::viewer::new_light::NewLight;

/// Distance per point of a drag, as a fraction of the scene's diagonal.
const DRAG_SHARE: f64 = 1e-3;

/// Width of the button beside the list of lights [points].
const REMOVE_WIDTH: f32 = 66.0;
const AIM: &str = "A click or drag in the picture turns the light: a spot to the surface there; a sun goes where it is seen there \
                   in the sky, or would be seen if the surface there were a mirror.";
const NO_HAND: &str = "Not for this light.";
const NO_PLACE: &str = "This light has neither a place nor a direction that could be changed.";
const NO_TURN: &str = "It is tilted.";
/// What is edited in the section, and by mouse in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    light: usize,
    object: usize,
    tool: MouseTool,
    /// Counts picks in the picture; each opens the section.
    pub picks: u32,
}

/// What clicks and drags in the picture do to a light, by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceTool {
    /// Place it in front of the surface.
    At(usize),
    /// Aim it at the surface; a sun moves to where it appears, or is mirrored, at that point.
    Towards(usize),
}

/// What the mouse does in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum MouseTool {
    #[default]
    Nothing,
    /// Moves the light by handles.
    Light,
    /// Places the light in front of surfaces.
    Place,
    /// Aims the light at surfaces.
    Aim,
    /// Moves the object by handles.
    Object,
}

impl Selection {
    /// What has handles in the picture.
    pub fn held(&self) -> Option<GizmoTarget> {
        match self.tool {
            MouseTool::Nothing => None,
            MouseTool::Light | MouseTool::Place | MouseTool::Aim => Some(GizmoTarget::Light(self.light)),
            MouseTool::Object => Some(GizmoTarget::Object(self.object)),
        }
    }

    /// The light that clicks in the picture place or aim.
    pub fn placed(&self) -> Option<PlaceTool> {
        match self.tool {
            MouseTool::Place => Some(PlaceTool::At(self.light)),
            MouseTool::Aim => Some(PlaceTool::Towards(self.light)),
            MouseTool::Nothing | MouseTool::Light | MouseTool::Object => None,
        }
    }

    /// Selects what was picked in the picture; `None` deselects.
    pub fn hold(&mut self, held: Option<GizmoTarget>) {
        self.tool = match held {
            None => MouseTool::Nothing,
            Some(GizmoTarget::Light(light)) => {
                self.light = light;
                MouseTool::Light
            }
            Some(GizmoTarget::Object(object)) => {
                self.object = object;
                MouseTool::Object
            }
        };
        self.picks += u32::from(held.is_some());
    }
}

/// Shows the section; pushes edits to `commands`.
pub fn show(ui: &mut Ui, selection: &mut Selection, model: &Model, commands: &mut Vec<Command>) {
    let scene = model.scene();

    // What the scene holds, in one line.
    let inventory = format!(
        "{}, {}, {}",
        counted(scene.objects.len(), "object"),
        counted(scene.triangle_count(), "triangle"),
        counted(scene.lights.len(), "light")
    );
    ui.label(RichText::new(inventory).weak())
        .on_hover_text(format!("{}, drawn by {}.", scene.source, model.picture.adapter));

    rows(ui, "scene", |ui| {
        // Lights: to add, to remove, to edit, to pull in the picture.
        if scene.lights.is_empty() {
            ui.label("");
            ui.colored_label(bake::ATTENTION, "No light: add one.");
            ui.end_row();
        }
        add_light(ui, commands);
        if !scene.lights.is_empty() {
            let names = scene.lights.iter().map(|light| light.name.as_str());
            row(ui, "Light", None, |ui| {
                ui.horizontal(|ui| {
                    let list = one_of(
                        ui,
                        ("light", CONTROL_WIDTH - REMOVE_WIDTH),
                        &mut selection.light,
                        names,
                    );
                    remove_light(ui, selection, scene, commands);
                    list
                })
                .inner
            });
            light::show(ui, selection.light, model, commands);
            light_tools(ui, selection, model);
        }

        // Objects: their material, place and handles.
        if !scene.objects.is_empty() {
            let names = scene.objects.iter().map(|object| object.name.as_str());
            row(ui, "Object", None, |ui| {
                one_of(ui, ("object", CONTROL_WIDTH), &mut selection.object, names)
            });
            let material = scene.objects[selection.object].material;
            material::show(ui, material, model, commands);
            place_of_object(ui, selection.object, model, commands);
            row(ui, "Handles", None, |ui| {
                let (what, present) = (about("Handles").what, &mut selection.tool);
                ui.horizontal(|ui| tool(ui, present, MouseTool::Object, "Move object", what))
                    .response
            });
        }
    });
}

/// Buttons that add lights.
fn add_light(ui: &mut Ui, commands: &mut Vec<Command>) {
    row(ui, "Add light", None, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            for light in NewLight::ALL {
                let what = light.get_documentation().unwrap_or_default();
                let button = ui
                    .button(light.name())
                    .accessible_name(format!("Add {}", light.name()))
                    .on_hover_text(format!("{what} {}", about("Add light").what));
                if button.clicked() {
                    commands.push(Command::AddLight(light));
                }
            }
        })
        .response
    });
}

fn remove_light(ui: &mut Ui, selection: &mut Selection, scene: &Scene, commands: &mut Vec<Command>) {
    let light = &scene.lights[selection.light];
    let why_not = why_light_stays(&light.kind);
    let remove = ui.add_enabled(why_not.is_none(), egui::Button::new("Remove"));
    let remove = remove
        .accessible_name("Remove light")
        .on_hover_text(about_button("Remove light"))
        .on_disabled_hover_text(format!("`{}` {}.", light.name, why_not.unwrap_or_default()));
    if remove.clicked() {
        commands.push(Command::Edit(Edit::RemoveLight(selection.light)));
        selection.hold(None);
    }
}

/// A drop-down list of names; the index of the present one is `chosen`.
fn one_of<'a>(
    ui: &mut Ui,
    (name, width): (&str, f32),
    chosen: &mut usize,
    names: impl ExactSizeIterator<Item = &'a str>,
) -> Response {
    let names: Vec<&str> = names.collect();
    *chosen = (*chosen).min(names.len().saturating_sub(1));
    let (response, picked) = pick_name(ui, (name, width), (names[*chosen], Some(*chosen)), &names);
    *chosen = picked.unwrap_or(*chosen);
    response
}

/// A row of three coordinates [m].
pub fn coordinates(ui: &mut Ui, name: &str, point: &mut DVec3, scene: &Scene) -> Response {
    let (low, high) = scene.inner_bounds().unwrap_or((DVec3::ZERO, DVec3::ONE));
    let speed = DRAG_SHARE * (high - low).length().max(1e-6);
    ui.horizontal(|ui| {
        // Three numbers have to fit into a narrow row.
        let spacing = ui.spacing_mut();
        (spacing.item_spacing.x, spacing.button_padding.x) = (3.0, 2.0);
        spacing.interact_size.x = 58.0;
        let axes = [("x", &mut point.x), ("y", &mut point.y), ("z", &mut point.z)];
        axes.into_iter()
            .map(|(axis, value)| {
                let decimals = if value.abs() < 10.0 { 3 } else { 2 };
                let drag = DragValue::new(value).speed(speed).max_decimals(decimals);
                ui.add(drag.prefix(format!("{axis}: ")))
                    .accessible_name(format!("{name}: {axis}"))
            })
            .reduce(|all, one| all.union(one))
    })
    .inner
    .expect("there are three axes")
}

/// A toggle for what the mouse does in the picture. Of the names "Move light" and the like, the row shows the verb.
fn tool(ui: &mut Ui, present: &mut MouseTool, own: MouseTool, name: &str, what: &str) {
    let mut is_on = *present == own;
    let text = name.strip_suffix(" light").unwrap_or(name);
    let switch = ui.toggle_value(&mut is_on, text).accessible_name(name);
    let switch = switch
        .on_hover_text(what)
        .on_disabled_hover_text(format!("{what} {NO_HAND}"));
    if switch.changed() {
        *present = if is_on { own } else { MouseTool::Nothing };
    }
}

fn light_tools(ui: &mut Ui, selection: &mut Selection, model: &Model) {
    let kind = &model.scene().lights[selection.light].kind;
    let (has_place, has_direction) = (kind.position().is_some(), kind.direction().is_some());
    let why_not = (!has_place && !has_direction).then_some(NO_PLACE);
    row(ui, "By mouse", why_not, |ui| {
        ui.horizontal(|ui| {
            let (what, present) = (about("By mouse").what, &mut selection.tool);
            ui.spacing_mut().item_spacing.x = 3.0;
            ui.add_enabled_ui(has_place, |ui| {
                tool(ui, present, MouseTool::Light, "Move light", what);
                tool(ui, present, MouseTool::Place, "Place light", what);
            });
            ui.add_enabled_ui(has_direction, |ui| {
                tool(ui, present, MouseTool::Aim, "Aim light", AIM);
            });
        })
        .response
    });
}

/// Rows with the offset and rotation of an object's node.
fn place_of_object(ui: &mut Ui, object: usize, model: &Model, commands: &mut Vec<Command>) {
    let motion = model.scene().objects[object].motion();
    let why_not = motion.yaw_rad().is_none().then_some(NO_TURN);
    let present = (motion.yaw_rad().unwrap_or_default(), motion.translation);
    let (mut yaw_rad, mut moved) = present;
    let offset = (&mut moved, &DVec3::ZERO);
    setting(ui, "Offset [m]", why_not, offset, |ui, moved| {
        coordinates(ui, "Offset [m]", moved, model.scene())
    });
    // Rounded to the digits shown, so that displaying the number does not change it.
    let present_deg = (yaw_rad.to_degrees() * 1e2).round() / 1e2;
    let mut turn_deg = present_deg;
    setting(ui, "Turn [°]", why_not, (&mut turn_deg, &0.0), |ui, turn_deg| {
        ui.add(DragValue::new(turn_deg).speed(0.5).max_decimals(2))
    });
    if turn_deg != present_deg {
        yaw_rad = turn_deg.to_radians();
    }
    if (yaw_rad, moved) != present {
        commands.push(Command::Edit(Edit::Place(object, Motion::turned(yaw_rad, moved))));
    }
}
