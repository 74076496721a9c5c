//! A camera that flies, walks or orbits, equally at every frame rate. Needs no window.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use super::files::config::KeptViews;
use super::walking::{self, Collider, Walker};
use crate::scene::{Camera, Scene};

/// Time after which the velocity has closed 1 − 1/e of its gap to what the keys ask for [s].
const SETTLING_S: f64 = 0.08;
/// Below this share of the flying speed a camera without a key held stands still.
const STILL: f64 = 1e-3;
/// Turn per counted step of the mouse [rad]: half a turn in about 1250 steps.
const LOOK_RAD_PER_COUNT: f64 = 0.0025;
/// Speed factor of one notch of the wheel.
const WHEEL_FACTOR: f64 = 1.05;
/// Speed factor while running.
const RUN_FACTOR: f64 = 4.0;
/// Slowest and fastest flying speed, in scene radii per second.
const SPEED_RANGE: (f64, f64) = (1e-3, 1e2);
/// First flying speed, in scene radii per second.
const FIRST_SPEED: f64 = 0.6;
/// Angle of view of a camera that the file does not give: 45° [rad].
const DEFAULT_FOV_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Shape of picture (width/height) that cameras are composed for: a narrower one still shows all that this would.
const COMPOSED_FOR: f64 = 16.0 / 9.0;

/// Speed factor while taking care.
const CREEP_FACTOR: f64 = 0.25;
/// Slowest and fastest walking speed [m/s].
const WALKING_RANGE: (f64, f64) = (0.1, 20.0);
/// Nearest that an orbit comes, in scene radii.
const NEAREST_ORBIT: f64 = 1e-3;
/// Nearest that is shown, of the distance to what is framed.
const NEAR_OF_FRAMED: f64 = 0.01;
/// Views that can be kept.
pub const BOOKMARKS: usize = 9;

/// How the camera gets about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr, VariantArray)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum NavigationMode {
    /// Anywhere, through walls.
    #[default]
    Fly,
    /// On foot: eyes 1.6 m above the ground, stopped by walls.
    Walk,
    /// Around a point.
    Orbit,
}

impl NavigationMode {
    /// Its name in the panel and in the event log.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The one after it.
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
    /// Right, up and forward, each −1, 0 or 1.
    fn direction(self) -> DVec3 {
        let axis = |plus: bool, minus: bool| f64::from(i8::from(plus) - i8::from(minus));
        DVec3::new(
            axis(self.right, self.left),
            axis(self.up, self.down),
            axis(self.forward, self.backward),
        )
    }
}

/// Position, gaze and speed of the fly camera, in scene coordinates [m], y up.
#[derive(Clone, Debug)]
pub struct Navigator {
    /// What is held down now.
    pub keys: HeldKeys,
    position: DVec3,
    velocity_m_per_s: DVec3,
    /// 0 looks along −z, positive turns to the right.
    yaw_rad: f64,
    /// Positive looks up, [−π/2, π/2]; both ends are proper views, as the horizon stays defined by the yaw.
    pitch_rad: f64,
    /// Of a tilted camera of the file; kept while flying.
    roll_rad: f64,
    vertical_fov_rad: f64,
    near_m: f64,
    speed_m_per_s: f64,
    centre: DVec3,
    radius_m: f64,
    cameras: Vec<Camera>,
    /// Which of the file's cameras `C` shows next.
    next_camera: usize,
    travel: NavigationMode,
    walker: Walker,
    walking_m_per_s: f64,
    /// Distance of the point that is orbited, straight ahead [m].
    orbit_m: f64,
    bookmarks: [Option<Camera>; BOOKMARKS],
}

impl Navigator {
    /// Starts at the file's camera of that name, else at its first camera, else so that the scene fills the picture.
    pub fn new(scene: &Scene, camera: Option<&str>) -> Self {
        let (low, high) = scene.bounds().unwrap_or((DVec3::splat(-1.0), DVec3::ONE));
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
            near_m: 1e-3 * radius_m,
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
        if let Some(name) = camera {
            let found = scene.cameras.iter().position(|candidate| candidate.name == name);
            navigator.next_camera = found.unwrap_or(0);
        }
        if navigator.next_camera().is_none() {
            navigator.frame(1.0);
        }
        navigator
    }

    /// The camera as the file has it, or as it was flown to.
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

    /// Half the diagonal of the scene's box [m, > 0].
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The camera for a picture of that aspect (width/height). Beside the panel a picture is narrower than most cameras
    /// are composed for: the view is widened then, so that nothing falls off its sides.
    pub fn camera_for(&self, aspect: f64) -> Camera {
        Camera {
            vertical_fov_rad: self.vertical_fov_for(aspect),
            ..self.camera()
        }
    }

    /// Pictures higher than wide are widened no further than square ones.
    fn vertical_fov_for(&self, aspect: f64) -> f64 {
        let widened = (COMPOSED_FOR / aspect.max(1.0)).max(1.0);
        2.0 * ((0.5 * self.vertical_fov_rad).tan() * widened).atan()
    }

    /// Speed without running [m/s].
    pub fn speed_m_per_s(&self) -> f64 {
        match self.travel {
            NavigationMode::Walk => self.walking_m_per_s,
            NavigationMode::Fly | NavigationMode::Orbit => self.speed_m_per_s,
        }
    }

    /// How it gets about.
    pub fn travel(&self) -> NavigationMode {
        self.travel
    }

    /// Gets about in another way from now on; an orbit is around what is straight ahead, or else around the scene.
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

    /// Keeps the present view under a number from 0 on; false where there is no such number.
    pub fn set_bookmark(&mut self, number: usize) -> bool {
        let camera = self.camera();
        let kept = self.bookmarks.get_mut(number);
        kept.map(|kept| *kept = Some(camera)).is_some()
    }

    /// Goes to a view that was kept; false where there is none.
    pub fn go_to_bookmark(&mut self, number: usize) -> bool {
        let Some(camera) = self.bookmarks.get(number).cloned().flatten() else {
            return false;
        };
        self.stand_at(&camera);
        true
    }

    /// What is kept for the next time.
    pub fn views(&self) -> KeptViews {
        KeptViews {
            camera: Some(self.camera()),
            travel: self.travel,
            bookmarks: self.bookmarks.clone(),
        }
    }

    /// Takes over what was kept: bookmarks, and the camera where that is wanted.
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

    /// The same place, gaze and way to get about in a scene that was read again.
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

    /// Lets time pass [s, ≥ 0] where nothing is in the way. The velocity approaches what the keys ask for exponentially and
    /// the path is its exact integral, so that one long frame ends where many short ones do.
    pub fn advance(&mut self, seconds: f64) {
        let path = self.drift(seconds);
        match self.travel {
            NavigationMode::Fly | NavigationMode::Walk => self.position += path,
            NavigationMode::Orbit => self.move_pivot(path),
        }
    }

    /// The same among surfaces: those who walk stand on them and are stopped by them.
    pub fn advance_among(&mut self, seconds: f64, solid: &dyn Collider) {
        if self.travel != NavigationMode::Walk || seconds <= 0.0 {
            return self.advance(seconds);
        }
        // Whoever has come past a corner walks on where he wants to, within one long frame too.
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
            // A wall took some of it.
            self.velocity_m_per_s = left_m_per_s;
        }
    }

    /// The path of some time, and the velocity after it.
    fn drift(&mut self, seconds: f64) -> DVec3 {
        let wanted = self.wanted_velocity();
        let remaining = (-seconds / SETTLING_S).exp();
        let gap = self.velocity_m_per_s - wanted;
        self.velocity_m_per_s = wanted + gap * remaining;
        if wanted == DVec3::ZERO && self.velocity_m_per_s.length() < STILL * self.speed_m_per_s() {
            self.velocity_m_per_s = DVec3::ZERO;
        }
        wanted * seconds + gap * (SETTLING_S * (1.0 - remaining))
    }

    /// Steps towards the point that is orbited, or moves it aside with the camera.
    fn move_pivot(&mut self, path: DVec3) {
        let (_, _, forward) = self.level_axes();
        let ahead_m = path.dot(forward);
        let pivot = self.position + forward * self.orbit_m + (path - forward * ahead_m);
        self.orbit_m = (self.orbit_m - ahead_m).max(NEAREST_ORBIT * self.radius_m);
        self.position = pivot - forward * self.orbit_m;
    }

    /// Turns the gaze by a movement of the mouse [counts, x to the right, y down].
    pub fn look(&mut self, counts: DVec2) {
        let pivot = self.position + self.level_axes().2 * self.orbit_m;
        self.yaw_rad = (self.yaw_rad + counts.x * LOOK_RAD_PER_COUNT).rem_euclid(std::f64::consts::TAU);
        self.pitch_rad = (self.pitch_rad - counts.y * LOOK_RAD_PER_COUNT).clamp(-FRAC_PI_2, FRAC_PI_2);
        if self.travel == NavigationMode::Orbit {
            self.position = pivot - self.level_axes().2 * self.orbit_m;
        }
    }

    /// Changes the speed by notches of the wheel, 5 % each: when flying it stays within 0.001 to 100 scene radii per second,
    /// on foot within 0.1 to 20 m/s. In orbit the same notches bring the camera nearer.
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

    /// Releases every key and stands still: the window lost the keyboard.
    pub fn stop(&mut self) {
        self.keys = HeldKeys::default();
        self.velocity_m_per_s = DVec3::ZERO;
    }

    /// Goes to the file's next camera and tells its name; `None` where the file has no camera.
    pub fn next_camera(&mut self) -> Option<&str> {
        let index = self.next_camera.checked_rem(self.cameras.len())?;
        self.next_camera = index + 1;
        let camera = self.cameras[index].clone();
        self.stand_at(&camera);
        Some(&self.cameras[index].name)
    }

    /// Steps back or forth along the gaze until the scene fills a picture of that aspect (width/height).
    pub fn frame(&mut self, aspect: f64) {
        self.frame_ball(self.centre, self.radius_m, aspect);
    }

    /// The same for a ball around a point of the scene [m, radius > 0].
    pub fn frame_ball(&mut self, centre: DVec3, radius_m: f64, aspect: f64) {
        let half_height = 0.5 * self.vertical_fov_for(aspect);
        let half_width = (half_height.tan() * aspect).atan();
        let distance_m = radius_m / half_height.min(half_width).sin();
        let (_, _, forward) = self.level_axes();
        self.velocity_m_per_s = DVec3::ZERO;
        self.position = centre - forward * distance_m;
        self.orbit_m = distance_m;
        // Small things are not cut away.
        self.near_m = self.near_m.min(NEAR_OF_FRAMED * distance_m);
        self.walker.look_again();
    }

    /// Stands there and looks at a point [m], its horizon level.
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

    /// Stands where a camera does and looks where it looks.
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
            // Straight up or down: the picture's upper edge tells the heading.
            let heading = camera.up * -forward.y.signum();
            heading.x.atan2(-heading.z)
        };
        self.roll_rad = 0.0;
        let (right, level_up, _) = self.level_axes();
        self.roll_rad = camera.up.dot(right).atan2(camera.up.dot(level_up));
        self.vertical_fov_rad = camera.vertical_fov_rad;
        self.near_m = camera.near_m.min(1e-3 * self.radius_m);
    }

    /// Right, up and forward of the camera without its roll: orthonormal at every pitch.
    fn level_axes(&self) -> (DVec3, DVec3, DVec3) {
        let (sin_yaw, cos_yaw) = self.yaw_rad.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch_rad.sin_cos();
        let heading = DVec3::new(sin_yaw, 0.0, -cos_yaw);
        let right = DVec3::new(cos_yaw, 0.0, sin_yaw);
        let forward = heading * cos_pitch + DVec3::Y * sin_pitch;
        let up = DVec3::Y * cos_pitch - heading * sin_pitch;
        (right, up, forward)
    }

    /// What the held keys ask for [m/s]: along the gaze, sideways, and straight up; on foot along the ground.
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
