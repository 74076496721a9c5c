//! What a person bumps into and stands on: the surfaces of the scene, found on a thread of its own.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use glam::DVec3;

use crate::geometry::Ray;
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
pub struct Surroundings {
    wake: Arc<dyn Fn() + Send + Sync>,
    found: Option<(Arc<Scene>, Arc<Tracer>)>,
    coming: Option<(Arc<Scene>, Receiver<Arc<Tracer>>)>,
}

impl fmt::Debug for Surroundings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (is_found, is_coming) = (self.found.is_some(), self.coming.is_some());
        write!(f, "Surroundings {{ found: {is_found}, coming: {is_coming} }}")
    }
}

impl Surroundings {
    /// Nothing yet; `wake` is called from another thread when there is something.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            wake,
            found: None,
            coming: None,
        }
    }

    /// The surfaces of a scene; `None` until they are found, and where the system gives no thread to find them on.
    pub fn of(&mut self, scene: &Arc<Scene>) -> Option<Arc<Tracer>> {
        if let Some((of, coming)) = &self.coming {
            match coming.try_recv() {
                Ok(tracer) => {
                    self.found = Some((Arc::clone(of), tracer));
                    self.coming = None;
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => self.coming = None,
            }
        }
        if let Some((of, tracer)) = &self.found
            && Arc::ptr_eq(of, scene)
        {
            return Some(Arc::clone(tracer));
        }
        if self.coming.is_none() {
            self.start(scene);
        }
        None
    }

    fn start(&mut self, scene: &Arc<Scene>) {
        let (give, take) = channel();
        let before = self.found.as_ref().map(|(_, tracer)| Arc::clone(tracer));
        let (of, wake) = (Arc::clone(scene), Arc::clone(&self.wake));
        let search = move || {
            let tracer = match before {
                Some(before) => before.edited(of),
                None => Tracer::new(of),
            };
            // Nobody waits any more where the window was closed.
            let _ = give.send(Arc::new(tracer));
            wake();
        };
        let started = thread::Builder::new().name("surroundings".into()).spawn(search);
        self.coming = started.is_ok().then(|| (Arc::clone(scene), take));
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
            thread::sleep(std::time::Duration::from_millis(1));
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
