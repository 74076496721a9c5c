//! Picking in the picture: objects, and lights that the mouse drags over surfaces.

use std::sync::Arc;

use glam::DVec3;

use super::Model;
use crate::geometry::Ray;
use crate::scene::{Edit, LightEdit};
use crate::transport::Tracer;
use crate::viewer::gizmo::GizmoTarget;
use crate::viewer::panel::PlaceTool;
use crate::viewer::walking::Collider;
use serde_json::json;

/// Distance from surfaces at which a light without a useful distance of its own is placed, in scene radii.
const OFF: f64 = 0.3;
/// Radius around a light that is framed, in scene radii.
const AROUND_LIGHT: f64 = 0.25;
/// A light nearer to a surface than this counts as on it, in scene radii.
const AT: f64 = 0.01;

#[derive(Debug, Default)]
pub(super) struct DraggedLight {
    /// Whether the mouse button is down.
    is_down: bool,
    /// Last ray under the mouse that has not been applied yet.
    view_ray: Option<Ray>,
    /// `None` when the button is up.
    hand: Option<DragTool>,
}

#[derive(Debug)]
struct DragTool {
    /// The surfaces at the start of the drag. They stay valid because lights are no surfaces.
    surfaces: Arc<Tracer>,
    does: DragAction,
}

/// Effect of the drag on a light, by its index.
#[derive(Clone, Copy, Debug)]
enum DragAction {
    /// Places it at this distance from surfaces [m].
    Put(usize, f64),
    /// Turns it towards the surface; it stays at this position [m].
    Turn(usize, DVec3),
    /// Turns a sun so that it appears, or is mirrored, under the mouse.
    TurnSun(usize),
}

impl DragTool {
    /// The edit for a ray under the mouse; `None` if it meets no surface and the action needs one.
    fn edit(&self, view_ray: &Ray) -> Option<Edit> {
        let met = met(&self.surfaces, view_ray);
        match (self.does, met) {
            (DragAction::Put(light, distance_m), Some((point, normal))) => {
                let position = point + normal * distance_m;
                Some(Edit::Light(light, LightEdit::Position(position)))
            }
            (DragAction::Turn(light, from), Some((point, _))) => {
                let direction = (point - from).try_normalize()?;
                Some(Edit::Light(light, LightEdit::Direction(direction)))
            }
            (DragAction::TurnSun(light), met) => {
                let seen = met.map_or(view_ray.direction, |(_, normal)| {
                    view_ray.direction.reflect(normal)
                });
                let direction = -seen.try_normalize()?;
                Some(Edit::Light(light, LightEdit::Direction(direction)))
            }
            (DragAction::Put(..) | DragAction::Turn(..), None) => None,
        }
    }
}

/// First surface point along a ray, and the unit normal that faces the ray's origin.
fn met(surfaces: &Tracer, view_ray: &Ray) -> Option<(DVec3, DVec3)> {
    let (distance_m, normal) = surfaces.meets(view_ray.origin, view_ray.direction, f64::INFINITY)?;
    Some((view_ray.at(distance_m), normal))
}

impl Model {
    /// Picks the object along a ray, as soon as the collision surfaces are built.
    pub fn pick(&mut self, view_ray: Ray) {
        self.seek(|pending| pending.pick = Some(view_ray));
    }

    /// Selects a light or an object and gives it handles.
    pub fn hold(&mut self, held: GizmoTarget) {
        self.pending_tasks.pick = None;
        self.choices.selection.hold(Some(held));
        let scene = self.edits.scene();
        let name = match held {
            GizmoTarget::Light(light) => &scene.lights[light].name,
            GizmoTarget::Object(object) => &scene.objects[object].name,
        };
        self.log.write("picked", json!({"name": name}));
    }

    /// Moves along the view axis until the selected light or object, else the scene, fills a picture of that aspect
    /// ratio (width/height).
    pub fn frame(&mut self, aspect: f64) {
        let whole_m = self.navigator.radius_m();
        let ball = match self.choices.selection.held() {
            Some(GizmoTarget::Object(object)) => {
                let bounds = self.scene().objects.get(object);
                let bounds = bounds.and_then(|object| object.bounds());
                bounds.map(|(low, high)| (0.5 * (low + high), 0.5 * (high - low).length()))
            }
            Some(GizmoTarget::Light(light)) => {
                let light = self.scene().lights.get(light);
                let position = light.and_then(|light| light.kind.position());
                position.map(|position| (position, AROUND_LIGHT * whole_m))
            }
            None => None,
        };
        match ball {
            Some((centre, radius_m)) if radius_m > 0.0 => {
                self.navigator.frame_ball(centre, radius_m, aspect);
            }
            _ => self.navigator.frame(aspect),
        }
    }

    /// Begins to drag the panel's light over surfaces.
    pub fn begin_placing(&mut self, view_ray: Ray) {
        self.placing.is_down = true;
        self.placing.view_ray = Some(view_ray);
    }

    /// The mouse points along another ray.
    pub fn go_on_placing(&mut self, view_ray: Ray) {
        if self.placing.is_down {
            self.placing.view_ray = Some(view_ray);
        }
    }

    /// Ends the drag; the last ray is still applied.
    pub fn end_placing(&mut self) {
        self.placing.is_down = false;
    }

    /// The edit for the last ray of the drag, as soon as the collision surfaces are built.
    pub fn placed(&mut self) -> Option<Edit> {
        let view_ray = self.placing.view_ray?;
        if self.placing.hand.is_none() {
            self.placing.hand = self.take_light(&view_ray);
        }
        let hand = self.placing.hand.as_ref()?;
        let edit = hand.edit(&view_ray);
        self.placing.view_ray = None;
        if !self.placing.is_down {
            self.placing.hand = None;
        }
        edit
    }

    /// Begins a drag. A placed light keeps its present distance from the surface under the mouse.
    fn take_light(&mut self, view_ray: &Ray) -> Option<DragTool> {
        let placed = self.choices.selection.placed()?;
        let (PlaceTool::At(light) | PlaceTool::Towards(light)) = placed;
        let position = self.scene().lights.get(light)?.kind.position();
        let surfaces = self.surfaces()?;
        let (light, position) = match (placed, position) {
            (PlaceTool::At(light), Some(position)) => (light, position),
            (PlaceTool::At(_), None) => return None,
            (PlaceTool::Towards(light), from) => {
                let does = from.map_or(DragAction::TurnSun(light), |from| DragAction::Turn(light, from));
                return Some(DragTool { surfaces, does });
            }
        };
        let radius_m = self.navigator.radius_m();
        let distance_m = met(&surfaces, view_ray).map(|(point, normal)| normal.dot(position - point).abs());
        let distance_m = distance_m
            .filter(|distance_m| *distance_m > AT * radius_m)
            .unwrap_or(OFF * radius_m);
        let does = DragAction::Put(light, distance_m);
        Some(DragTool { surfaces, does })
    }
}
