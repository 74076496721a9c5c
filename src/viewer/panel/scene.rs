//! Section *Scene*: lights, materials and places, changed while they are looked at.

use egui::{Button, ComboBox, DragValue, Response, Slider, SliderClamping, Ui};
use glam::DVec3;

use super::control::{About, CONTROL_WIDTH, row, rows, significant};
use super::{Facts, Wishes, bake, light_size, waves};
use crate::optics::LinearSrgb;
use crate::scene::{Edit, LightKind, Scene, SurfaceKind};
use crate::units::{Irradiance, RadiantIntensity};

/// The slider's ends, as factors of the strength in the file.
const POWER_FACTORS: (f64, f64) = (1e-2, 1e2);
/// The steepest elevation that can be set [°]: straight up and down have no azimuth.
const STEEPEST_DEG: f64 = 89.99;
/// Unit vectors nearer than this are the same direction.
const SAME_DIRECTION: f64 = 1e-9;
/// Least distance that one point of a drag moves, as a share of the scene's extent.
const DRAG_SHARE: f64 = 1e-3;

const LIGHT: About = About {
    label: "Light",
    what: "Which light the rows below change.",
    range: "the scene's lights",
    accuracy: "none",
    cost: "none",
};
const INTENSITY: About = About {
    label: "Intensity [W/sr]",
    what: "Radiant intensity of a point light, of a spot on its axis: glTF's candela divided by 683.",
    range: "a hundredth to a hundred times that of the file; logarithmic; any value above 0 can be typed",
    accuracy: "none: light is as exact as before",
    cost: "little: no ray is traced again, the deposits are scaled",
};
const IRRADIANCE: About = About {
    label: "Irradiance [W/m²]",
    what: "Of the sun, measured across its beam: glTF's lux divided by 683.",
    range: INTENSITY.range,
    accuracy: INTENSITY.accuracy,
    cost: INTENSITY.cost,
};
const BRIGHTNESS: About = About {
    label: "Brightness",
    what: "Radiance of a lamp with a surface [W/(m² sr)], or how many times as bright as its image an environment is.",
    range: "a hundredth to a hundred times the file's value; others can be typed",
    accuracy: "none: light scales with it",
    cost: "none: baked light is scaled",
};
const POSITION: About = About {
    label: "Position [m]",
    what: "Place of the light in scene coordinates: x, y (up), z.",
    range: "any; drag sideways, or click and type",
    accuracy: "none: light is as exact as before",
    cost: "this light is traced anew",
};
const DIRECTION: About = About {
    label: "Direction [°]",
    what: "The way the light travels: azimuth, clockwise from −z as seen from above, and elevation; −90 is straight \
           down.",
    range: "azimuth −180 to 180, elevation −89.99 to 89.99",
    accuracy: "none: light is as exact as before",
    cost: "this light is traced anew",
};
const OBJECT: About = About {
    label: "Object",
    what: "Which object the rows below change; its material may be that of others too.",
    range: "the scene's objects",
    accuracy: "none",
    cost: "none",
};
const IOR: About = About {
    label: "Refractive index",
    what: "Of glass, water and polish at 588 nm: bends light and sets how much is reflected.",
    range: "1 to 3; larger values can be typed",
    accuracy: "sharper caustics need more rays for the same error",
    cost: "light that meets this material is traced anew",
};
const ROUGHNESS: About = About {
    label: "Roughness",
    what: "How wide the lobe is in which mirrors, glass and polish send light on (GGX). Metal and glass above 0.6, and \
           polish above 0.3, are matte.",
    range: "0 to 1",
    accuracy: "wide lobes need more wavefronts for the same error",
    cost: "light that meets this material is traced anew where the class changes",
};
const TINT: About = About {
    label: "Base colour",
    what: "Tint of glass per crossing, reflectance of a mirror, albedo of what is matte; linear sRGB.",
    range: "0 to 1 per channel",
    accuracy: "none",
    cost: "specular: light that meets it is weighted anew; matte: only the picture changes",
};
const OFFSET: About = About {
    label: "Offset [m]",
    what: "How far the object, with all parts of its node, stands from its place in the file: x, y (up), z.",
    range: "any; drag sideways, or click and type; 0 is the file's place exactly",
    accuracy: "none: light is as exact as before",
    cost: "light that meets the old or the new place is traced anew",
};

/// What the section has in hand.
#[derive(Clone, Copy, Debug, Default)]
pub struct Selection {
    light: usize,
    object: usize,
}

/// Shows the section; what is changed goes to `wishes`.
pub fn show(ui: &mut Ui, selection: &mut Selection, facts: &Facts<'_>, wishes: &mut Wishes) {
    let scene = facts.scene;
    rows(ui, "scene", |ui| {
        if !scene.lights.is_empty() {
            let names = scene.lights.iter().map(|light| light.name.as_str());
            row(ui, &LIGHT, None, |ui| {
                one_of(ui, "light", &mut selection.light, names)
            });
            light(ui, selection.light, facts, wishes);
        }
        if !scene.objects.is_empty() {
            let names = scene.objects.iter().map(|object| object.name.as_str());
            row(ui, &OBJECT, None, |ui| {
                one_of(ui, "object", &mut selection.object, names)
            });
            material(ui, selection.object, scene, wishes);
            row(ui, &OFFSET, None, |ui| {
                offset(ui, selection.object, facts, wishes)
            });
        }
    });
    undo(ui, facts, wishes);
}

fn undo(ui: &mut Ui, facts: &Facts<'_>, wishes: &mut Wishes) {
    let undo = ui
        .add_enabled(facts.undoable > 0, Button::new("Undo (Ctrl+Z)"))
        .on_hover_text("Takes the last change of the scene back, exactly.")
        .on_disabled_hover_text("The scene is as it was loaded.");
    wishes.undo |= undo.clicked();
    if let Some(refusal) = facts.refusal {
        ui.colored_label(bake::FAILED, refusal);
    }
}

/// A list of names, of which one is chosen by its index.
fn one_of<'a>(
    ui: &mut Ui,
    name: &str,
    chosen: &mut usize,
    names: impl ExactSizeIterator<Item = &'a str>,
) -> Response {
    let names: Vec<&str> = names.collect();
    *chosen = (*chosen).min(names.len().saturating_sub(1));
    ComboBox::from_id_salt(name)
        .width(CONTROL_WIDTH)
        .selected_text(names[*chosen])
        .truncate()
        .show_ui(ui, |ui| {
            for (index, name) in names.iter().enumerate() {
                ui.push_id(index, |ui| ui.selectable_value(chosen, index, *name));
            }
        })
        .response
}

fn light(ui: &mut Ui, light: usize, facts: &Facts<'_>, wishes: &mut Wishes) {
    let kind = facts.scene.lights[light].kind;
    let power_about = match kind {
        LightKind::Sun { .. } => &IRRADIANCE,
        LightKind::Point { .. } | LightKind::Spot { .. } => &INTENSITY,
        LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => &BRIGHTNESS,
    };
    row(ui, power_about, None, |ui| power(ui, light, facts, wishes));
    light_size::show(ui, light, &facts.scene.lights[light], wishes);
    if let Some(position) = kind.position() {
        row(ui, &POSITION, None, |ui| {
            let mut moved = position;
            let response = place(ui, &mut moved, facts.scene);
            if moved != position {
                wishes.edit = Some(Edit::LightPosition {
                    light,
                    position: moved,
                });
            }
            response
        });
    }
    if let LightKind::Spot { direction, .. } | LightKind::Sun { direction, .. } = kind {
        row(ui, &DIRECTION, None, |ui| {
            let (response, turned) = angles(ui, direction);
            if let Some(direction) = turned {
                wishes.edit = Some(Edit::LightDirection { light, direction });
            }
            response
        });
    }
}

fn power(ui: &mut Ui, light: usize, facts: &Facts<'_>, wishes: &mut Wishes) -> Response {
    let kind = &facts.scene.lights[light].kind;
    let of_file = facts.loaded.lights[light].kind.strength();
    let mut value = kind.strength();
    let response = ui.add(
        Slider::new(&mut value, of_file * POWER_FACTORS.0..=of_file * POWER_FACTORS.1)
            .logarithmic(true)
            .clamping(SliderClamping::Never)
            .custom_formatter(|value, _| significant(value)),
    );
    if response.changed() {
        wishes.edit = Some(match kind {
            LightKind::Sun { .. } => Edit::LightNormalIrradiance {
                light,
                normal_irradiance: Irradiance(value),
            },
            LightKind::Point { .. } | LightKind::Spot { .. } => Edit::LightIntensity {
                light,
                intensity: RadiantIntensity(value),
            },
            LightKind::Panel { .. } | LightKind::Surface { .. } | LightKind::Environment { .. } => {
                Edit::LightBrightness {
                    light,
                    brightness: value,
                }
            }
        });
    }
    response
}

/// Three lengths [m].
fn place(ui: &mut Ui, place: &mut DVec3, scene: &Scene) -> Response {
    let (low, high) = scene.bounds().unwrap_or((DVec3::ZERO, DVec3::ONE));
    let speed = DRAG_SHARE * (high - low).length().max(1e-6);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().interact_size.x = 62.0;
        let axes = [
            ("x: ", &mut place.x),
            ("y: ", &mut place.y),
            ("z: ", &mut place.z),
        ];
        axes.into_iter()
            .map(|(prefix, value)| ui.add(DragValue::new(value).speed(speed).max_decimals(3).prefix(prefix)))
            .reduce(|all, one| all.union(one))
    })
    .inner
    .expect("there are three axes")
}

/// Azimuth and elevation; a new direction where one of them was changed.
fn angles(ui: &mut Ui, direction: DVec3) -> (Response, Option<DVec3>) {
    let mut azimuth_deg = direction.x.atan2(-direction.z).to_degrees();
    let mut elevation_deg = direction.y.clamp(-1.0, 1.0).asin().to_degrees();
    let before = (azimuth_deg, elevation_deg);
    let response = ui
        .horizontal(|ui| {
            let angle = |value, range| DragValue::new(value).speed(0.5).range(range).max_decimals(1);
            let azimuth = ui.add(angle(&mut azimuth_deg, -360.0..=360.0).prefix("azimuth: "));
            let elevation = ui.add(angle(&mut elevation_deg, -90.0..=90.0).prefix("elev.: "));
            azimuth.union(elevation)
        })
        .inner;
    let turned = ((azimuth_deg, elevation_deg) != before).then(|| {
        let azimuth = azimuth_deg.to_radians();
        let (sine, cosine) = elevation_deg
            .clamp(-STEEPEST_DEG, STEEPEST_DEG)
            .to_radians()
            .sin_cos();
        DVec3::new(azimuth.sin() * cosine, sine, -azimuth.cos() * cosine)
    });
    // Rounding to angles and back is no turn.
    let turned = turned.filter(|turned| turned.distance(direction) > SAME_DIRECTION);
    (response, turned)
}

fn material(ui: &mut Ui, object: usize, scene: &Scene, wishes: &mut Wishes) {
    let index = scene.objects[object].material;
    let material = &scene.materials[index];
    let no_ior = matches!(material.surface, SurfaceKind::Diffuse | SurfaceKind::Mirror)
        .then_some("Only glass, water and polish have one; this surface is matte or a mirror.");
    row(ui, &IOR, no_ior, |ui| {
        let mut ior = material.ior;
        let slider = Slider::new(&mut ior, 1.0..=3.0).clamping(SliderClamping::Never);
        let response = ui.add(slider.fixed_decimals(3));
        if response.changed() {
            wishes.edit = Some(Edit::MaterialIor { material: index, ior });
        }
        response
    });
    row(ui, &ROUGHNESS, None, |ui| {
        let mut roughness = material.roughness;
        let slider = Slider::new(&mut roughness, 0.0..=1.0).clamping(SliderClamping::Never);
        let response = ui.add(slider.fixed_decimals(2));
        if response.changed() {
            wishes.edit = Some(Edit::MaterialRoughness {
                material: index,
                roughness,
            });
        }
        response
    });
    if let Some(waves) = material.bending_waves() {
        waves::show(ui, index, waves, wishes);
    }
    row(ui, &TINT, None, |ui| {
        let mut colour = material.base_colour.to_array().map(|channel| channel as f32);
        let response = ui.color_edit_button_rgb(&mut colour);
        if response.changed() {
            wishes.edit = Some(Edit::MaterialTint {
                material: index,
                base_colour: LinearSrgb::from(colour.map(|channel| f64::from(channel.clamp(0.0, 1.0)))),
            });
        }
        response
    });
}

fn offset(ui: &mut Ui, object: usize, facts: &Facts<'_>, wishes: &mut Wishes) -> Response {
    let first = |scene: &Scene| scene.objects[object].mesh.positions.first().copied();
    let present = first(facts.scene).unwrap_or_default() - first(facts.loaded).unwrap_or_default();
    // What rounding leaves of the difference is not shown as a digit.
    let mut wanted = (present * 1e9).round() / 1e9;
    let before = wanted;
    let response = place(ui, &mut wanted, facts.scene);
    if wanted != before {
        wishes.edit = Some(moved_node(object, facts.loaded, wanted));
    }
    response
}

/// All parts of an object's node at an offset [m] from their places in the file.
fn moved_node(object: usize, loaded: &Scene, offset: DVec3) -> Edit {
    let node = loaded.objects[object].node;
    let parts = loaded
        .objects
        .iter()
        .enumerate()
        .filter(|(_, part)| part.node == node);
    let edits: Vec<Edit> = parts
        .map(|(index, part)| Edit::object_at(index, &part.mesh, offset))
        .collect();
    match <[Edit; 1]>::try_from(edits) {
        Ok([alone]) => alone,
        Err(several) => Edit::Several(several),
    }
}
