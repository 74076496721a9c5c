//! Picking in the picture: objects, and lights that the mouse drags over surfaces.

use std::sync::Arc;

use glam::DVec3;

use super::Model;
use crate::geometry::Ray;
use crate::scene::{Edit, LightEdit};
use crate::transport::Tracer;
use crate::viewer::gizmo::GizmoTarget;
use crate::viewer::panel::PlaceTool;
use serde_json::json;

/// A light at a surface has no place before it: it is put there as far off as this, in scene radii.
const OFF: f64 = 0.3;
/// What of a light's surroundings is framed, in scene radii.
const AROUND_LIGHT: f64 = 0.25;
/// Nearer to a surface than this, in scene radii, it counts as at it.
const AT: f64 = 0.01;

/// A light that the mouse drags over surfaces.
#[derive(Debug, Default)]
pub(super) struct DraggedLight {
    /// Whether the button is down.
    is_down: bool,
    /// Where the mouse pointed last, until the light is there.
    gaze: Option<Ray>,
    /// Until the button is up.
    hand: Option<DragTool>,
}

#[derive(Debug)]
struct DragTool {
    /// As they were when the drag began: lights are no surfaces.
    surfaces: Arc<Tracer>,
    does: DragAction,
}

/// What becomes of a light.
#[derive(Clone, Copy, Debug)]
enum DragAction {
    /// It is put so far before surfaces [m].
    Put(usize, f64),
    /// It is turned to them from there [m].
    Turn(usize, DVec3),
    /// A sun: it goes where it is seen.
    TurnSun(usize),
}

impl DragTool {
    /// What a gaze asks for; `None` where it meets nothing that it could be put before.
    fn edit(&self, gaze: &Ray) -> Option<Edit> {
        let met = met(&self.surfaces, gaze);
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
                let seen = met.map_or(gaze.direction, |(_, normal)| gaze.direction.reflect(normal));
                let direction = -seen.try_normalize()?;
                Some(Edit::Light(light, LightEdit::Direction(direction)))
            }
            (DragAction::Put(..) | DragAction::Turn(..), None) => None,
        }
    }
}

/// Where a gaze ends, and the surface's unit normal towards the eye.
fn met(surfaces: &Tracer, gaze: &Ray) -> Option<(DVec3, DVec3)> {
    let place = surfaces.intersect(gaze)?;
    let normal = surfaces.surface_at(&place).geometric_normal;
    let point = gaze.origin + gaze.direction * place.distance_m;
    Some((point, normal * -normal.dot(gaze.direction).signum()))
}

impl Model {
    /// Picks what a gaze meets, as soon as the surfaces of the scene are known.
    pub fn pick(&mut self, gaze: Ray) {
        self.picking = Some(gaze);
        self.poll_pick();
    }

    /// Gives handles to a light or an object.
    pub fn hold(&mut self, held: GizmoTarget) {
        self.picking = None;
        self.choices.selection.hold(Some(held));
        let scene = self.edits.scene();
        let name = match held {
            GizmoTarget::Light(light) => &scene.lights[light].name,
            GizmoTarget::Object(object) => &scene.objects[object].name,
        };
        self.log.write("picked", json!({"name": name}));
    }

    /// Steps back or forth until what has handles fills a picture of that aspect (width/height), or else the scene.
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

    pub(super) fn poll_pick(&mut self) {
        let Some(gaze) = self.picking else { return };
        let Some(surfaces) = self.surfaces() else {
            return;
        };
        self.picking = None;
        match surfaces.intersect(&gaze) {
            Some(place) => self.hold(GizmoTarget::Object(place.object as usize)),
            None => self.choices.selection.hold(None),
        }
    }

    /// Begins to drag the panel's light over surfaces.
    pub fn begin_placing(&mut self, gaze: Ray) {
        self.placing.is_down = true;
        self.placing.gaze = Some(gaze);
    }

    /// The mouse points elsewhere.
    pub fn go_on_placing(&mut self, gaze: Ray) {
        if self.placing.is_down {
            self.placing.gaze = Some(gaze);
        }
    }

    /// Lets the light go, once it is where the mouse pointed last.
    pub fn end_placing(&mut self) {
        self.placing.is_down = false;
    }

    /// The edit that puts the light before what the mouse points at, as soon as the surfaces of the scene are known.
    pub fn placed(&mut self) -> Option<Edit> {
        let gaze = self.placing.gaze?;
        if self.placing.hand.is_none() {
            self.placing.hand = self.take_light(&gaze);
        }
        let hand = self.placing.hand.as_ref()?;
        let edit = hand.edit(&gaze);
        self.placing.gaze = None;
        if !self.placing.is_down {
            self.placing.hand = None;
        }
        edit
    }

    /// Takes the panel's light in the hand: as far before surfaces as it is now before that at which a gaze ends.
    fn take_light(&mut self, gaze: &Ray) -> Option<DragTool> {
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
        let distance_m = met(&surfaces, gaze).map(|(point, normal)| normal.dot(position - point).abs());
        let distance_m = distance_m
            .filter(|distance_m| *distance_m > AT * radius_m)
            .unwrap_or(OFF * radius_m);
        let does = DragAction::Put(light, distance_m);
        Some(DragTool { surfaces, does })
    }
}
