//! A camera that flies, walks or orbits, equally at every frame rate. Needs no window.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use super::files::config::KeptViews;
use super::walking::{self, Collider, Walker};
use crate::scene::{Camera, Scene};

/// Time constant with which the velocity approaches its target [s].
const SETTLING_S: f64 = 0.08;
/// Fraction of the flying speed below which the camera stops once no key is held.
const STILL: f64 = 1e-3;
/// Rotation per mouse count [rad]: half a turn in about 1250 counts.
const LOOK_RAD_PER_COUNT: f64 = 0.0025;
/// Speed factor per wheel notch.
const WHEEL_FACTOR: f64 = 1.05;
/// Speed factor while Shift is held.
const RUN_FACTOR: f64 = 4.0;
/// Range of the flying speed, in scene radii per second.
const SPEED_RANGE: (f64, f64) = (1e-3, 1e2);
/// Initial flying speed, in scene radii per second.
const FIRST_SPEED: f64 = 0.6;
/// Vertical field of view if the scene has no camera: 45° [rad].
const DEFAULT_FOV_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Aspect ratio (width/height) that cameras are composed for: a narrower picture still shows all that this one would.
const COMPOSED_FOR: f64 = 16.0 / 9.0;

/// Speed factor while Ctrl is held.
const CREEP_FACTOR: f64 = 0.25;
/// Range of the walking speed [m/s].
const WALKING_RANGE: (f64, f64) = (0.1, 20.0);
/// Smallest orbit radius, in scene radii.
const NEAREST_ORBIT: f64 = 1e-3;
/// Largest near-plane distance of a camera that moved, in scene radii.
const NEAR: f64 = 1e-3;
/// Largest near-plane distance, as a fraction of the distance to the framed object.
const NEAR_OF_FRAMED: f64 = 0.01;
/// Number of bookmarks.
pub const BOOKMARKS: usize = 9;

/// How the camera moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr, VariantArray)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum NavigationMode {
    /// Free flight, through walls.
    #[default]
    Fly,
    /// On foot: eyes 1.6 m above the ground, collides with walls.
    Walk,
    /// Orbits around a point.
    Orbit,
}

impl NavigationMode {
    /// Name in the panel and in the event log.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The next mode, cyclically.
    #[must_use]
    pub fn next(self) -> Self {
        Self::VARIANTS[(self as usize + 1) % Self::VARIANTS.len()]
    }
}

/// Which movement keys are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeldKeys {
    /// W
    pub forward: bool,
    /// S
    pub backward: bool,
    /// A
    pub left: bool,
    /// D
    pub right: bool,
    /// E
    pub up: bool,
    /// Q
    pub down: bool,
    /// Shift
    pub run: bool,
    /// Ctrl
    pub creep: bool,
}

impl HeldKeys {
    /// Components right, up and forward, each −1, 0 or 1.
    fn direction(self) -> DVec3 {
        let axis = |plus: bool, minus: bool| f64::from(i8::from(plus) - i8::from(minus));
        DVec3::new(
            axis(self.right, self.left),
            axis(self.up, self.down),
            axis(self.forward, self.backward),
        )
    }
}

/// Pose and speed of the camera, in scene coordinates [m], y up.
#[derive(Clone, Debug)]
pub struct Navigator {
    pub keys: HeldKeys,
    position: DVec3,
    velocity_m_per_s: DVec3,
    /// 0 looks along −z; positive turns to the right.
    yaw_rad: f64,
    /// Positive looks up, [−π/2, π/2]. Both ends are valid views because the yaw still defines the horizon.
    pitch_rad: f64,
    /// Roll of a tilted scene camera; kept while flying.
    roll_rad: f64,
    vertical_fov_rad: f64,
    near_m: f64,
    speed_m_per_s: f64,
    centre: DVec3,
    radius_m: f64,
    cameras: Vec<Camera>,
    /// Index of the scene camera that `C` shows next.
    next_camera: usize,
    travel: NavigationMode,
    walker: Walker,
    walking_m_per_s: f64,
    /// Distance of the orbit's pivot, straight ahead [m].
    orbit_m: f64,
    bookmarks: [Option<Camera>; BOOKMARKS],
}

impl Navigator {
    /// Starts at the scene camera of that name, else at the scene's first camera, else frames the whole scene.
    pub fn new(scene: &Scene, camera: Option<&str>) -> Self {
        // Speed of flight and distances are in scene radii, so that scenes of all sizes are crossed in the same time.
        let (low, high) = scene.inner_bounds().unwrap_or((DVec3::splat(-1.0), DVec3::ONE));
        let half_diagonal_m = 0.5 * (high - low).length();
        let radius_m = if half_diagonal_m > 0.0 {
            half_diagonal_m
        } else {
            1.0
        };
        let mut navigator = Self {
            keys: HeldKeys::default(),
            position: DVec3::ZERO,
            velocity_m_per_s: DVec3::ZERO,
            yaw_rad: 0.6,
            pitch_rad: -0.5,
            roll_rad: 0.0,
            vertical_fov_rad: DEFAULT_FOV_RAD,
            near_m: NEAR * radius_m,
            speed_m_per_s: FIRST_SPEED * radius_m,
            centre: 0.5 * (low + high),
            radius_m,
            cameras: scene.cameras.clone(),
            next_camera: 0,
            travel: NavigationMode::Fly,
            walker: Walker::default(),
            walking_m_per_s: walking::SPEED_M_PER_S,
            orbit_m: radius_m,
            bookmarks: [const { None }; BOOKMARKS],
        };

        // `next_camera` shows the camera that is chosen here; without any, the whole scene is framed.
        if let Some(name) = camera {
            let found = scene.cameras.iter().position(|candidate| candidate.name == name);
            navigator.next_camera = found.unwrap_or(0);
        }
        if navigator.next_camera().is_none() {
            navigator.frame(1.0);
        }
        navigator
    }

    /// The present camera.
    pub fn camera(&self) -> Camera {
        let (right, level_up, forward) = self.level_axes();
        Camera {
            name: "viewer".into(),
            position: self.position,
            forward,
            up: level_up * self.roll_rad.cos() + right * self.roll_rad.sin(),
            vertical_fov_rad: self.vertical_fov_rad,
            near_m: self.near_m,
        }
    }

    /// Half the diagonal of the scene's inner bounding box [m, > 0].
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The camera for a picture of that aspect ratio (width/height). The picture beside the panel is narrower than
    /// most cameras are composed for, so the field of view is widened to keep everything at its sides in view.
    pub fn camera_for(&self, aspect: f64) -> Camera {
        Camera {
            vertical_fov_rad: self.vertical_fov_for(aspect),
            ..self.camera()
        }
    }

    /// Pictures taller than wide are widened no more than square ones.
    fn vertical_fov_for(&self, aspect: f64) -> f64 {
        let widened = (COMPOSED_FOR / aspect.max(1.0)).max(1.0);
        2.0 * ((0.5 * self.vertical_fov_rad).tan() * widened).atan()
    }

    /// Speed without modifier keys [m/s].
    pub fn speed_m_per_s(&self) -> f64 {
        match self.travel {
            NavigationMode::Walk => self.walking_m_per_s,
            NavigationMode::Fly | NavigationMode::Orbit => self.speed_m_per_s,
        }
    }

    pub fn travel(&self) -> NavigationMode {
        self.travel
    }

    /// Changes the mode. The pivot of an orbit is the surface straight ahead; if there is none, the point on the view
    /// axis nearest to the scene's centre; if that is behind the camera, a point one scene radius ahead.
    pub fn set_travel(&mut self, travel: NavigationMode, solid: Option<&dyn Collider>) {
        if travel == self.travel {
            return;
        }
        self.travel = travel;
        self.velocity_m_per_s = DVec3::ZERO;
        self.walker = Walker::default();
        if travel != NavigationMode::Fly {
            self.roll_rad = 0.0;
        }
        let (_, _, forward) = self.level_axes();
        let met = solid.and_then(|solid| solid.meets(self.position, forward, f64::INFINITY));
        let along_m = (self.centre - self.position).dot(forward);
        let nearest_m = NEAREST_ORBIT * self.radius_m;
        self.orbit_m = match met {
            Some((distance_m, _)) => distance_m.max(nearest_m),
            None if along_m > nearest_m => along_m,
            None => self.radius_m,
        };
    }

    /// Stores the present view as a bookmark, numbered from 0; false if there is no such number.
    pub fn set_bookmark(&mut self, number: usize) -> bool {
        let camera = self.camera();
        let kept = self.bookmarks.get_mut(number);
        kept.map(|kept| *kept = Some(camera)).is_some()
    }

    /// Goes to a bookmark; false if it is not set.
    pub fn go_to_bookmark(&mut self, number: usize) -> bool {
        let Some(camera) = self.bookmarks.get(number).cloned().flatten() else {
            return false;
        };
        self.stand_at(&camera);
        true
    }

    /// The views that are saved for the next start.
    pub fn views(&self) -> KeptViews {
        KeptViews {
            camera: Some(self.camera()),
            travel: self.travel,
            bookmarks: self.bookmarks.clone(),
        }
    }

    /// Restores saved bookmarks and mode, and with `with_camera` the camera.
    pub fn restore(&mut self, kept: &KeptViews, with_camera: bool) {
        self.bookmarks.clone_from(&kept.bookmarks);
        if !with_camera {
            return;
        }
        if let Some(camera) = kept.camera.as_ref().filter(|camera| camera.is_sound()) {
            self.stand_at(camera);
        }
        self.set_travel(kept.travel, None);
    }

    /// Adopts a reloaded scene with the same pose, mode and bookmarks.
    pub fn stay_in(&mut self, scene: &Scene) {
        let mut there = Self::new(scene, None);
        there.restore(&self.views(), true);
        *self = there;
    }

    /// Whether the next [`advance`](Self::advance) would move the camera.
    pub fn is_moving(&self) -> bool {
        self.keys.direction() != DVec3::ZERO
            || self.velocity_m_per_s != DVec3::ZERO
            || (self.travel == NavigationMode::Walk && self.walker.is_moving())
    }

    /// Advances by a time [s, ≥ 0] without collisions. The velocity approaches its target exponentially and the path
    /// is the exact integral, so one long frame ends where many short ones do.
    pub fn advance(&mut self, seconds: f64) {
        let path = self.drift(seconds);
        match self.travel {
            NavigationMode::Fly | NavigationMode::Walk => self.position += path,
            NavigationMode::Orbit => self.move_pivot(path),
        }
    }

    /// Advances by a time [s, ≥ 0] with collisions: a walking camera stands on surfaces and is stopped by walls.
    pub fn advance_among(&mut self, seconds: f64, solid: &dyn Collider) {
        if self.travel != NavigationMode::Walk || seconds <= 0.0 {
            return self.advance(seconds);
        }
        // Sub-steps let a walker who has passed a corner turn freely even within one long frame.
        let looks = (seconds / walking::LOOK_S).ceil();
        for _ in 0..looks as u64 {
            self.look_and_step(seconds / looks, solid);
        }
    }

    fn look_and_step(&mut self, seconds: f64, solid: &dyn Collider) {
        let asked_m_per_s = self.drift(seconds) / seconds;
        let (eye, left_m_per_s) = self.walker.step(self.position, asked_m_per_s, seconds, solid);
        self.position = eye;
        if left_m_per_s != asked_m_per_s {
            // A wall stopped part of the motion.
            self.velocity_m_per_s = left_m_per_s;
        }
    }

    /// Displacement over a time [s]; updates the velocity.
    fn drift(&mut self, seconds: f64) -> DVec3 {
        let wanted = self.wanted_velocity();
        let remaining = (-seconds / SETTLING_S).exp();
        let gap = self.velocity_m_per_s - wanted;
        self.velocity_m_per_s = wanted + gap * remaining;
        if wanted == DVec3::ZERO && self.velocity_m_per_s.length() < STILL * self.speed_m_per_s() {
            self.velocity_m_per_s = DVec3::ZERO;
        }
        let path = wanted * seconds + gap * (SETTLING_S * (1.0 - remaining));
        if path != DVec3::ZERO {
            self.see_near();
        }
        path
    }

    /// Shows again what the near plane of a scene's camera cuts away.
    fn see_near(&mut self) {
        self.near_m = self.near_m.min(NEAR * self.radius_m);
    }

    /// Moves forward towards the orbit's pivot; shifts the pivot sideways along with the camera.
    fn move_pivot(&mut self, path: DVec3) {
        let (_, _, forward) = self.level_axes();
        let ahead_m = path.dot(forward);
        let pivot = self.position + forward * self.orbit_m + (path - forward * ahead_m);
        self.orbit_m = (self.orbit_m - ahead_m).max(NEAREST_ORBIT * self.radius_m);
        self.position = pivot - forward * self.orbit_m;
        self.see_near();
    }

    /// Turns the camera by a mouse movement [counts, x to the right, y down].
    pub fn look(&mut self, counts: DVec2) {
        let pivot = self.position + self.level_axes().2 * self.orbit_m;
        self.yaw_rad = (self.yaw_rad + counts.x * LOOK_RAD_PER_COUNT).rem_euclid(std::f64::consts::TAU);
        self.pitch_rad = (self.pitch_rad - counts.y * LOOK_RAD_PER_COUNT).clamp(-FRAC_PI_2, FRAC_PI_2);
        if self.travel == NavigationMode::Orbit {
            self.position = pivot - self.level_axes().2 * self.orbit_m;
            self.see_near();
        }
    }

    /// Changes the speed by wheel notches of 5 % each: within 0.001 to 100 scene radii per second when flying, within
    /// 0.1 to 20 m/s on foot. In orbit the same notches change the distance instead.
    pub fn wheel(&mut self, notches: f64) {
        let factor = WHEEL_FACTOR.powf(notches);
        match self.travel {
            NavigationMode::Fly => {}
            NavigationMode::Walk => {
                let (slowest, fastest) = WALKING_RANGE;
                self.walking_m_per_s = (self.walking_m_per_s * factor).clamp(slowest, fastest);
                return;
            }
            NavigationMode::Orbit => {
                let (_, _, forward) = self.level_axes();
                let ahead_m = self.orbit_m * (1.0 - 1.0 / factor);
                return self.move_pivot(forward * ahead_m);
            }
        }
        let (slowest, fastest) = (SPEED_RANGE.0 * self.radius_m, SPEED_RANGE.1 * self.radius_m);
        self.speed_m_per_s = (self.speed_m_per_s * factor).clamp(slowest, fastest);
    }

    /// Releases every key and stops; for when the window loses the keyboard focus.
    pub fn stop(&mut self) {
        self.keys = HeldKeys::default();
        self.velocity_m_per_s = DVec3::ZERO;
    }

    /// Goes to the scene's next camera and returns its name; `None` if the scene has no camera.
    pub fn next_camera(&mut self) -> Option<&str> {
        let index = self.next_camera.checked_rem(self.cameras.len())?;
        self.next_camera = index + 1;
        let camera = self.cameras[index].clone();
        self.stand_at(&camera);
        Some(&self.cameras[index].name)
    }

    /// Moves along the view axis until the scene fills a picture of that aspect ratio (width/height).
    pub fn frame(&mut self, aspect: f64) {
        self.frame_ball(self.centre, self.radius_m, aspect);
    }

    /// The same for a sphere [m, radius > 0].
    pub fn frame_ball(&mut self, centre: DVec3, radius_m: f64, aspect: f64) {
        let half_height = 0.5 * self.vertical_fov_for(aspect);
        let half_width = (half_height.tan() * aspect).atan();
        let distance_m = radius_m / half_height.min(half_width).sin();
        let (_, _, forward) = self.level_axes();
        self.velocity_m_per_s = DVec3::ZERO;
        self.position = centre - forward * distance_m;
        self.orbit_m = distance_m;
        // Keeps small objects out of the near plane.
        self.near_m = self.near_m.min(NEAR_OF_FRAMED * distance_m);
        self.walker.look_again();
    }

    /// Moves to `eye` and looks at a point [m], with a level horizon.
    pub fn look_at(&mut self, eye: DVec3, point: DVec3) {
        let mut camera = self.camera();
        let forward = (point - eye).normalize_or(camera.forward);
        let (level_right, _, _) = self.level_axes();
        let right = forward.cross(DVec3::Y).try_normalize().unwrap_or(level_right);
        (camera.position, camera.forward) = (eye, forward);
        camera.up = right.cross(forward);
        self.stand_at(&camera);
        self.orbit_m = eye.distance(point);
        self.near_m = self.near_m.min(NEAR_OF_FRAMED * self.orbit_m);
    }

    /// Takes over the pose and field of view of a camera.
    pub fn stand_at(&mut self, camera: &Camera) {
        let forward = camera.forward;
        let across = DVec2::new(forward.x, forward.z);
        self.velocity_m_per_s = DVec3::ZERO;
        self.walker.look_again();
        self.position = camera.position;
        self.pitch_rad = forward.y.clamp(-1.0, 1.0).asin();
        self.yaw_rad = if across.length() > 1e-9 {
            across.x.atan2(-across.y)
        } else {
            // Looking straight up or down: the camera's up vector defines the heading.
            let heading = camera.up * -forward.y.signum();
            heading.x.atan2(-heading.z)
        };
        self.roll_rad = 0.0;
        let (right, level_up, _) = self.level_axes();
        self.roll_rad = camera.up.dot(right).atan2(camera.up.dot(level_up));
        self.vertical_fov_rad = camera.vertical_fov_rad;
        self.near_m = camera.near_m;
    }

    /// Right, up and forward of the camera without roll: orthonormal at every pitch.
    fn level_axes(&self) -> (DVec3, DVec3, DVec3) {
        let (sin_yaw, cos_yaw) = self.yaw_rad.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch_rad.sin_cos();
        let heading = DVec3::new(sin_yaw, 0.0, -cos_yaw);
        let right = DVec3::new(cos_yaw, 0.0, sin_yaw);
        let forward = heading * cos_pitch + DVec3::Y * sin_pitch;
        let up = DVec3::Y * cos_pitch - heading * sin_pitch;
        (right, up, forward)
    }

    /// Velocity that the held keys ask for [m/s]: along the view axis, sideways and straight up; on foot along the
    /// ground.
    fn wanted_velocity(&self) -> DVec3 {
        let keys = self.keys.direction();
        let (right, _, forward) = self.level_axes();
        let direction = if self.travel == NavigationMode::Walk {
            right * keys.x + DVec3::Y.cross(right) * keys.z
        } else {
            right * keys.x + DVec3::Y * keys.y + forward * keys.z
        };
        let run = if self.keys.run { RUN_FACTOR } else { 1.0 };
        let creep = if self.keys.creep { CREEP_FACTOR } else { 1.0 };
        direction.normalize_or_zero() * (self.speed_m_per_s() * run * creep)
    }
}
