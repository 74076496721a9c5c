//! What a person bumps into and stands on: the surfaces of the scene, found on a thread of its own.

use std::sync::Arc;

use glam::DVec3;

use super::background::Background;
use crate::geometry::Ray;
use crate::progress::Control;
use crate::scene::Scene;
use crate::transport::Tracer;

/// Surfaces that stop a person.
pub trait Solid {
    /// Distance [m] along a unit direction to the first surface that is nearer than `within_m`, and its unit normal on the
    /// side it is met from.
    fn meets(&self, from: DVec3, direction: DVec3, within_m: f64) -> Option<(f64, DVec3)>;
}

impl Solid for Tracer {
    fn meets(&self, origin: DVec3, direction: DVec3, within_m: f64) -> Option<(f64, DVec3)> {
        let place = self.closest_place(&Ray { origin, direction })?;
        if place.distance_m >= within_m {
            return None;
        }
        let normal = self.surface_at(&place).geometric_normal;
        Some((place.distance_m, normal * -direction.dot(normal).signum()))
    }
}

/// The surfaces of the scene in the window, once somebody asks for them.
#[derive(Debug)]
pub struct Surroundings {
    found: Option<(Arc<Scene>, Arc<Tracer>)>,
    coming: Background<Arc<Scene>, Tracer>,
}

impl Surroundings {
    /// Nothing yet; `wake` is called from another thread when there is something.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            found: None,
            coming: Background::new("surroundings", wake),
        }
    }

    /// The surfaces of a scene; `None` until they are found, and where the system gives no thread to find them on.
    pub fn of(&mut self, scene: &Arc<Scene>) -> Option<Arc<Tracer>> {
        if let Some((of, Some(tracer))) = self.coming.take() {
            self.found = Some((of, Arc::new(tracer)));
        }
        if let Some((of, tracer)) = &self.found
            && Arc::ptr_eq(of, scene)
        {
            return Some(Arc::clone(tracer));
        }
        if self.coming.of().is_none() {
            self.start(scene);
        }
        None
    }

    fn start(&mut self, scene: &Arc<Scene>) {
        let before = self.found.as_ref().map(|(_, tracer)| Arc::clone(tracer));
        let of = Arc::clone(scene);
        let search = move |_: &Control| match before {
            Some(before) => before.edited(of),
            None => Tracer::new(of),
        };
        if let Err(error) = self.coming.start(Arc::clone(scene), search) {
            log::warn!("{error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn surfaces_are_found_once_and_again_for_another_scene() {
        let scene = Arc::new(builtin::build("ring").expect("it is built in"));
        let mut surroundings = Surroundings::new(Arc::new(|| {}));
        let mut wait = |scene: &Arc<Scene>| loop {
            if let Some(tracer) = surroundings.of(scene) {
                return tracer;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        };
        let first = wait(&scene);
        assert!(Arc::ptr_eq(&first, &wait(&scene)));
        let down = first.meets(DVec3::new(0.9, 1.0, 0.9), DVec3::NEG_Y, 10.0);
        let (distance_m, normal) = down.expect("the floor");
        assert!(
            (distance_m - 1.0).abs() < 1e-6 && normal == DVec3::Y,
            "{distance_m}, {normal}"
        );
        assert_eq!(first.meets(DVec3::new(0.9, 1.0, 0.9), DVec3::NEG_Y, 0.5), None);
        let other = Arc::new((*scene).clone());
        assert!(!Arc::ptr_eq(&first, &wait(&other)));
    }
}
