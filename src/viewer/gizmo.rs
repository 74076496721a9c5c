//! Handles on the selection: three move it along an axis, one turns it about the vertical.

use egui::{Color32, Pos2, Rect, Sense, Stroke, Ui, WidgetInfo, vec2};
use glam::DVec3;

use super::lens::Viewport;
use crate::geometry::Ray;
use crate::scene::{Edit, LightEdit, Motion, Scene};

/// Length of the axes [points].
const LENGTH: f64 = 90.0;
/// Radius of the rotation ring, as a fraction of the axes' length.
const RING: f64 = 0.7;
/// Half the side of a handle's drag area [points].
const REACH: f32 = 11.0;
const TIP: f32 = 6.0;
/// Segments of the ring.
const CORNERS: usize = 48;
/// Smallest sine of the angle between a view ray and an axis, or the ring's plane, at which a drag is well defined.
const FLATTEST: f64 = 0.02;
const LAMP: Color32 = Color32::from_rgb(255, 214, 110);

/// What the handles move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GizmoTarget {
    /// A light with a position, by index.
    Light(usize),
    /// An object with all parts of its node, by index.
    Object(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handle {
    X,
    Y,
    Z,
    /// Rotation about the vertical.
    Turn,
}

impl Handle {
    /// Name for assistive technology, colour, and unit axis; the rotation has no axis.
    fn look(self) -> (&'static str, Color32, Option<DVec3>) {
        match self {
            Self::X => ("Move x", Color32::from_rgb(235, 90, 80), Some(DVec3::X)),
            Self::Y => ("Move y", Color32::from_rgb(120, 210, 90), Some(DVec3::Y)),
            Self::Z => ("Move z", Color32::from_rgb(90, 150, 250), Some(DVec3::Z)),
            Self::Turn => ("Turn", Color32::from_rgb(230, 200, 90), None),
        }
    }

    fn axis(self) -> Option<DVec3> {
        self.look().2
    }

    /// The coordinate that a view ray points at: distance from `origin` along the axis [m], or angle about the
    /// vertical from z towards x [rad]. `None` if the ray is almost parallel to the axis, or to the ring's plane.
    pub fn reach(self, origin: DVec3, view_ray: &Ray) -> Option<f64> {
        let Some(axis) = self.axis() else {
            let down = view_ray.direction.y;
            let along_m = (origin.y - view_ray.origin.y) / down;
            let met = view_ray.origin + view_ray.direction * along_m - origin;
            return (down.abs() > FLATTEST && along_m > 0.0).then(|| met.x.atan2(met.z));
        };
        // The point on the axis nearest to the ray.
        let from = view_ray.origin - origin;
        let slant = axis.dot(view_ray.direction);
        let sine_squared = 1.0 - slant * slant;
        let nearest = (axis.dot(from) - slant * view_ray.direction.dot(from)) / sine_squared;
        (sine_squared > FLATTEST * FLATTEST).then_some(nearest)
    }
}

/// Pose of the target at the start of a drag.
#[derive(Clone, Copy, Debug)]
enum Pose {
    Light(usize, DVec3),
    Object {
        object: usize,
        yaw_rad: f64,
        offset_m: DVec3,
        /// Pivot of the object in the file [m].
        rest: DVec3,
    },
}

impl Pose {
    /// `None` for a light without a position, or a tilted object.
    fn of(held: GizmoTarget, scene: &Scene) -> Option<Self> {
        match held {
            GizmoTarget::Light(light) => Some(Self::Light(light, scene.lights.get(light)?.kind.position()?)),
            GizmoTarget::Object(object) => {
                let motion = scene.objects.get(object)?.motion();
                Some(Self::Object {
                    object,
                    yaw_rad: motion.yaw_rad()?,
                    offset_m: motion.translation,
                    rest: scene.pivot(object),
                })
            }
        }
    }

    fn middle_m(&self) -> DVec3 {
        match *self {
            Self::Light(_, position) => position,
            Self::Object { rest, offset_m, .. } => rest + offset_m,
        }
    }

    fn handles(&self) -> &'static [Handle] {
        match self {
            Self::Light(..) => &[Handle::X, Handle::Y, Handle::Z],
            Self::Object { .. } => &[Handle::X, Handle::Y, Handle::Z, Handle::Turn],
        }
    }

    /// The edit that moves or turns the target by this much [m, rad].
    fn pulled(&self, handle: Handle, by: f64) -> Edit {
        let step = handle.axis().map_or(DVec3::ZERO, |axis| axis * by);
        match *self {
            Self::Light(light, position) => Edit::Light(light, LightEdit::Position(position + step)),
            Self::Object {
                object,
                yaw_rad,
                offset_m,
                ..
            } => {
                let turn = if handle == Handle::Turn { by } else { 0.0 };
                Edit::Place(object, Motion::turned(yaw_rad + turn, offset_m + step))
            }
        }
    }
}

/// A drag in progress.
#[derive(Clone, Copy, Debug)]
struct Grip {
    handle: Handle,
    from: Pose,
    /// Coordinate at the start of the drag.
    begun: f64,
}

/// The handles in the picture and the drag in progress.
#[derive(Clone, Debug, Default)]
pub struct Gizmo {
    grip: Option<Grip>,
    is_hot: bool,
}

impl Gizmo {
    /// Whether the mouse is on a handle, which then takes the click.
    pub fn is_hot(&self) -> bool {
        self.is_hot
    }

    /// Shows the handles of the target over the picture; returns the edit of a drag.
    pub fn show(
        &mut self,
        ui: &Ui,
        lens: &Viewport<'_>,
        held: Option<GizmoTarget>,
        scene: &Scene,
    ) -> Option<Edit> {
        self.is_hot = false;
        let pose = held.and_then(|held| Pose::of(held, scene));
        let Some(pose) = pose.filter(|pose| lens.is_before(pose.middle_m())) else {
            self.grip = None;
            return None;
        };
        lamps(ui, lens, scene);
        let origin = pose.middle_m();
        let length_m = LENGTH * lens.m_per_point(origin);
        let mut edit = None;
        for handle in pose.handles() {
            let tip = tip(*handle, &pose, origin, length_m);
            if !lens.is_before(tip) {
                continue;
            }
            edit = self.pull(ui, lens, (*handle, &pose), lens.project(tip)).or(edit);
            draw(ui, lens, *handle, (origin, tip), length_m);
        }
        edit
    }

    /// Handles drags of one handle.
    fn pull(
        &mut self,
        ui: &Ui,
        lens: &Viewport<'_>,
        (handle, pose): (Handle, &Pose),
        at: Pos2,
    ) -> Option<Edit> {
        // Handles beyond the picture lie under the panel; a drag that is in progress may leave the picture.
        let rect = Rect::from_center_size(at, vec2(2.0 * REACH, 2.0 * REACH));
        if !lens.picture.contains_rect(rect) && self.grip.is_none() {
            return None;
        }
        let (name, ..) = handle.look();
        let response = ui.interact(rect, ui.scope_id().with(name), Sense::drag());
        response.widget_info(|| WidgetInfo::slider(true, 0.0, name));
        self.is_hot |= response.hovered() || response.dragged();

        // A drag begins where the button was pressed, not where the pointer was once it counted as a drag.
        let pointer = response.interact_pointer_pos()?;
        if response.drag_started() {
            let pressed = ui.input(|input| input.pointer.press_origin());
            let view_ray = lens.view_ray(pressed.unwrap_or(pointer));
            let begun = handle.reach(pose.middle_m(), &view_ray)?;
            self.grip = Some(Grip {
                handle,
                from: *pose,
                begun,
            });
        }

        // Edits are relative to the pose at the start of the drag: rounding errors do not add up.
        let grip = self.grip.filter(|grip| grip.handle == handle)?;
        if response.drag_stopped() {
            self.grip = None;
        }
        if response.drag_delta() == egui::Vec2::ZERO {
            return None;
        }
        let reached = handle.reach(grip.from.middle_m(), &lens.view_ray(pointer))?;
        Some(grip.from.pulled(handle, reached - grip.begun))
    }
}

/// Position of a handle in the scene.
fn tip(handle: Handle, pose: &Pose, origin: DVec3, length_m: f64) -> DVec3 {
    match (handle.axis(), pose) {
        (Some(axis), _) => origin + axis * length_m,
        (None, Pose::Object { yaw_rad, .. }) => {
            // Between two axes, so that it hides neither.
            origin + on_ring(yaw_rad + std::f64::consts::FRAC_PI_4, length_m)
        }
        (None, Pose::Light(..)) => origin,
    }
}

fn on_ring(angle_rad: f64, length_m: f64) -> DVec3 {
    DVec3::new(angle_rad.sin(), 0.0, angle_rad.cos()) * (RING * length_m)
}

fn draw(ui: &Ui, lens: &Viewport<'_>, handle: Handle, (origin, tip): (DVec3, DVec3), length_m: f64) {
    let painter = ui.painter().with_clip_rect(lens.picture);
    let (_, colour, _) = handle.look();
    let stroke = Stroke::new(2.5, colour);
    let line = |from: DVec3, to: DVec3| {
        if let Some(ends) = lens.line(from, to) {
            painter.line_segment(ends, stroke);
        }
    };
    if handle == Handle::Turn {
        let corner = |index: usize| {
            let angle = std::f64::consts::TAU * index as f64 / CORNERS as f64;
            origin + on_ring(angle, length_m)
        };
        for index in 0..CORNERS {
            line(corner(index), corner(index + 1));
        }
    } else {
        line(origin, tip);
    }
    painter.circle_filled(lens.project(tip), TIP, colour);
}

/// Marks every light that has a position, so that it can be clicked.
fn lamps(ui: &Ui, lens: &Viewport<'_>, scene: &Scene) {
    let painter = ui.painter().with_clip_rect(lens.picture);
    for light in &scene.lights {
        if let Some(position) = light.kind.position().filter(|position| lens.is_before(*position)) {
            let at = lens.project(position);
            painter.circle_stroke(at, 7.0, Stroke::new(1.5, LAMP));
            painter.circle_filled(at, 2.0, LAMP);
        }
    }
}

/// The light whose mark is at this point of the picture, if any.
pub fn light_at(lens: &Viewport<'_>, scene: &Scene, place: Pos2) -> Option<usize> {
    let seen = scene.lights.iter().enumerate().filter_map(|(index, light)| {
        let position = light.kind.position()?;
        let distance = lens
            .is_before(position)
            .then(|| lens.project(position).distance(place))?;
        (distance < REACH).then_some((index, distance))
    });
    seen.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}
