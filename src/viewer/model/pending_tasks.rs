//! Tasks that wait for the scene's surfaces: objects to pick, lights to add, and the search for the brightest spot.

use std::sync::Arc;

use glam::DVec3;

use super::Model;
use crate::geometry::Ray;
use crate::scene::Edit;
use crate::transport::Tracer;
use crate::viewer::brightest::{self, BrightSpot};
use crate::viewer::gizmo::GizmoTarget;
use crate::viewer::new_light::{NewLight, ViewTarget};
use crate::viewer::probe;

/// Distance from which the brightest spot is viewed, in scene radii.
const DISTANCE: f64 = 0.6;
/// A spot is visible if the view ray ends within this distance of it, in scene radii.
const SEEN: f64 = 1e-3;
/// Smallest cosine between view direction and normal at which a surface is well visible.
const FLATTEST: f64 = 0.25;
/// Offset of the probe ray's origin from the surface, in scene radii.
const OFF: f64 = 1e-6;
/// How often the distance is halved while the spot is hidden.
const HALVINGS: i32 = 6;

/// Tasks for when the collision surfaces are built.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PendingTasks {
    /// Picks the object along this ray.
    pub pick: Option<Ray>,
    pub light: Option<NewLight>,
    pub brightest: bool,
}

impl Model {
    /// Adds a task and runs it as soon as the collision surfaces are built.
    pub(super) fn seek(&mut self, what: impl FnOnce(&mut PendingTasks)) {
        what(&mut self.pending_tasks);
        self.poll_pending();
    }

    /// Runs the pending tasks if the collision surfaces are built.
    pub(super) fn poll_pending(&mut self) {
        if self.pending_tasks == PendingTasks::default() {
            return;
        }
        let Some(surfaces) = self.surfaces() else { return };
        let PendingTasks {
            pick,
            light,
            brightest,
        } = std::mem::take(&mut self.pending_tasks);
        if let Some(view_ray) = pick {
            match surfaces.intersect(&view_ray) {
                Some(hit) => self.hold(GizmoTarget::Object(hit.object as usize)),
                None => self.choices.selection.hold(None),
            }
        }
        if let Some(light) = light {
            self.add_light(light, &surfaces);
        }
        if brightest {
            self.show_brightest(&surfaces);
        }
    }

    /// Adds a light near what the camera looks at, and gives it handles.
    fn add_light(&mut self, light: NewLight, surfaces: &Arc<Tracer>) {
        let (camera, radius_m) = (self.navigator.camera(), self.navigator.radius_m());
        let view_ray = Ray {
            origin: camera.position,
            direction: camera.forward,
        };
        let scene = Arc::clone(self.edits.scene());
        let (low, high) = scene.inner_bounds().unwrap_or((DVec3::ZERO, DVec3::ZERO));
        let target = ViewTarget::of(surfaces, &view_ray, 0.5 * (low + high));
        let stops = self.choices.display.exposure_stops;
        let added = light.make((surfaces, radius_m), &target, stops, &scene);
        let is_added = self.edit(&Edit::AddLight(Arc::new(added)));
        self.edits.release();
        if is_added {
            self.hold(GizmoTarget::Light(scene.lights.len()));
        }
    }

    /// Moves the camera to a view of the brightest texel and probes it.
    fn show_brightest(&mut self, surfaces: &Arc<Tracer>) {
        let Some(spot) = brightest::find(self.edits.scene(), &self.lit_maps()) else {
            self.refusal = Some("There is no light in the maps, and so no brightest spot.".into());
            return;
        };
        let radius_m = self.navigator.radius_m();
        let eye = self.view_of(&spot, surfaces);
        self.navigator.look_at(eye, spot.point);
        self.probe(Some(Ray {
            origin: spot.point + spot.normal * (OFF * radius_m),
            direction: -spot.normal,
        }));
    }

    /// Position from which a spot is visible: along the present view direction if possible, and as near as needed.
    fn view_of(&self, spot: &BrightSpot, surfaces: &Tracer) -> DVec3 {
        let radius_m = self.navigator.radius_m();
        let back = -self.navigator.camera().forward;
        let level = DVec3::new(back.x, 0.0, back.z).normalize_or(DVec3::X);
        let ways = [back, spot.normal + level, spot.normal - level, spot.normal].map(DVec3::normalize);
        let is_seen = |eye: DVec3| {
            let view_ray = Ray {
                origin: eye,
                direction: (spot.point - eye).normalize(),
            };
            let seen = surfaces.closest_hit(&view_ray);
            let through = probe::seen(surfaces, &view_ray).map(|seen| seen.hit);
            [seen, through]
                .into_iter()
                .flatten()
                .any(|hit| hit.point.distance(spot.point) < SEEN * radius_m)
        };
        let eye =
            |way: DVec3, halvings: i32| spot.point + way * (DISTANCE * radius_m * 0.5_f64.powi(halvings));
        let views = (0..=HALVINGS).flat_map(|halvings| ways.map(|way| (way, eye(way, halvings))));
        let mut views = views.filter(|(way, _)| way.dot(spot.normal) > FLATTEST);
        let found = views.find(|(_, eye)| is_seen(*eye));
        found.map_or_else(|| eye(spot.normal, HALVINGS), |(_, eye)| eye)
    }
}
