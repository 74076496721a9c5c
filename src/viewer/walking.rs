//! Walk mode: eye height, gravity, walls and steps; and the surfaces to collide with, built on a thread of its own.

use std::sync::Arc;

use glam::DVec3;

use super::background::{Latest, Wake};
use crate::geometry::Ray;
use crate::scene::Scene;
use crate::transport::Tracer;

/// Height of the eyes above the ground [m].
pub const EYE_M: f64 = 1.6;
/// Mean walking speed of people on even ground [m/s] (Bohannon 1997).
pub const SPEED_M_PER_S: f64 = 1.4;
/// Steps up to this height are climbed [m].
const STEP_M: f64 = 0.35;
/// Distance kept between eyes and walls [m].
const BODY_M: f64 = 0.25;
/// Gravity [m/s²].
const GRAVITY_M_PER_S2: f64 = 9.81;
/// Terminal velocity [m/s]: low enough not to miss a floor within one sub-step.
const FASTEST_FALL_M_PER_S: f64 = 50.0;
/// Time constant of climbing a step [s].
const CLIMBING_S: f64 = 0.08;
/// Longest sub-step [s].
pub(super) const LOOK_S: f64 = 1.0 / 120.0;
/// Ground farther below than this is ignored [m], so that nobody falls out of the scene.
const DEEPEST_M: f64 = 1e4;
/// Feet nearer to the ground than this stand on it [m].
const STANDING_M: f64 = 1e-4;
/// Largest push away from a wall that is too near [m per sub-step].
const PUSH_M: f64 = 0.01;

/// Motion in walk mode; the position is kept by the caller.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walker {
    fall_m_per_s: f64,
    stands: bool,
}

impl Walker {
    /// Whether the camera still moves without input: falling, or climbing a step.
    pub fn is_moving(&self) -> bool {
        !self.stands
    }

    /// Forces a new check for ground, after a jump or an edit.
    pub fn look_again(&mut self) {
        self.stands = false;
    }

    /// One sub-step of `seconds` [> 0] at a velocity along the ground [m/s]. Returns the new eye position and the
    /// velocity that walls left.
    pub fn step(
        &mut self,
        mut eye: DVec3,
        mut velocity_m_per_s: DVec3,
        seconds: f64,
        solid: &dyn Collider,
    ) -> (DVec3, DVec3) {
        if velocity_m_per_s != DVec3::ZERO {
            let wanted = velocity_m_per_s * seconds;
            let Allowed { along, away } = beside_walls(eye, wanted, solid);
            if along != wanted {
                // Only the motion along the wall counts: the push off the wall divided by a short time could give any
                // speed.
                velocity_m_per_s = along / seconds;
            }
            eye += along + away;
        }
        eye.y += self.settle(eye, seconds, solid);
        (eye, velocity_m_per_s)
    }

    /// Vertical displacement of the eyes [m].
    fn settle(&mut self, eye: DVec3, seconds: f64, solid: &dyn Collider) -> f64 {
        // Cast from the eyes: a camera that arrives flying lands on whatever is below.
        let Some((below_m, _)) = solid.meets(eye, DVec3::NEG_Y, DEEPEST_M) else {
            // No ground below.
            self.fall_m_per_s = 0.0;
            self.stands = true;
            return 0.0;
        };
        // Height of the feet above the ground; negative in front of a higher step.
        let over_m = below_m - EYE_M;
        self.stands = over_m.abs() < STANDING_M;
        if over_m > STEP_M || (self.fall_m_per_s > 0.0 && over_m > 0.0) {
            self.fall_m_per_s = (self.fall_m_per_s + GRAVITY_M_PER_S2 * seconds).min(FASTEST_FALL_M_PER_S);
            return -(self.fall_m_per_s * seconds).min(over_m);
        }
        self.fall_m_per_s = 0.0;
        -over_m * (1.0 - (-seconds / CLIMBING_S).exp())
    }
}

/// What walls leave of a step along the ground [m].
#[derive(Clone, Copy)]
struct Allowed {
    /// Remaining part of the wanted step.
    along: DVec3,
    /// Push away from walls that are too near.
    away: DVec3,
}

impl Allowed {
    const NOTHING: Self = Self {
        along: DVec3::ZERO,
        away: DVec3::ZERO,
    };
}

/// Shortens a step along the ground and pushes it away from walls.
fn beside_walls(eye: DVec3, wanted: DVec3, solid: &dyn Collider) -> Allowed {
    let mut allowed = Allowed {
        along: wanted,
        away: DVec3::ZERO,
    };

    // A corner has two walls.
    for _ in 0..3 {
        let step = allowed.along + allowed.away;
        let Some(forward) = step.try_normalize() else {
            return Allowed::NOTHING;
        };
        let right = DVec3::new(-forward.z, 0.0, forward.x);

        // Rays in five directions at three heights find the walls that the step could touch.
        let reach_m = BODY_M + step.length();
        let fan = [
            forward,
            (forward + right).normalize(),
            (forward - right).normalize(),
            right,
            -right,
        ];
        // At the height of eyes, chest and knees; lower obstacles are climbed.
        let heights = [0.0, 0.5 * EYE_M, EYE_M - STEP_M - 0.05];

        let mut worst: Option<(f64, DVec3)> = None;
        for down_m in heights {
            for direction in fan {
                let Some((distance_m, normal)) =
                    solid.meets(eye - DVec3::Y * down_m, direction, 2.0 * reach_m)
                else {
                    continue;
                };
                // Floors, ceilings and ramps do not block.
                let Some(wall) = DVec3::new(normal.x, 0.0, normal.z).try_normalize() else {
                    continue;
                };
                if normal.y.abs() > 0.7 {
                    continue;
                }

                // Only the nearest wall counts; the second one of a corner is found in the next round.
                let away_m = distance_m * -direction.dot(wall) + step.dot(wall);
                let missing_m = BODY_M - away_m;
                if missing_m > 1e-9 && worst.is_none_or(|(most_m, _)| missing_m > most_m) {
                    worst = Some((missing_m, wall));
                }
            }
        }

        // What leads into the wall is taken from the step first. If that is not enough, the walker is pushed a little.
        let Some((missing_m, wall)) = worst else {
            return allowed;
        };
        let inward_m = (-step.dot(wall)).max(0.0);
        allowed.along += wall * missing_m.min(inward_m);
        allowed.away += wall * (missing_m - inward_m).clamp(0.0, PUSH_M);
    }
    // Stuck in a narrow corner.
    Allowed::NOTHING
}

/// Surfaces that block a walker.
pub trait Collider {
    /// Distance [m] along a unit direction to the first surface nearer than `within_m`, and its unit normal on the
    /// side of the ray's origin.
    fn meets(&self, from: DVec3, direction: DVec3, within_m: f64) -> Option<(f64, DVec3)>;
}

impl Collider for Tracer {
    fn meets(&self, origin: DVec3, direction: DVec3, within_m: f64) -> Option<(f64, DVec3)> {
        let place = self.intersect(&Ray { origin, direction })?;
        if place.distance_m >= within_m {
            return None;
        }
        let normal = self.surface_at(&place).geometric_normal;
        Some((place.distance_m, normal * -direction.dot(normal).signum()))
    }
}

/// The surfaces of the scene, built on a thread.
#[derive(Debug)]
pub struct CollisionScene(Latest<Arc<Scene>, Tracer>);

impl CollisionScene {
    /// Nothing is built yet. `wake` is called when a build ends.
    pub fn new(wake: &Wake) -> Self {
        Self(Latest::new("surroundings", wake))
    }

    /// The surfaces of a scene; `None` until they are built, and if the system cannot create a thread.
    pub fn of(&mut self, scene: &Arc<Scene>) -> Option<Arc<Tracer>> {
        let of = Arc::clone(scene);
        self.0.follow(scene, Arc::ptr_eq, move |before, _| match before {
            Some(before) => before.edited(of),
            None => Tracer::new(of),
        });
        let made = self.0.made().filter(|(of, _)| Arc::ptr_eq(of, scene));
        made.map(|(_, tracer)| Arc::clone(tracer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn surfaces_are_found_once_and_again_for_another_scene() {
        let scene = Arc::new(builtin::build("ring").expect("it is built in"));
        let mut surroundings = CollisionScene::new(&Wake::new(|| ()));
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
