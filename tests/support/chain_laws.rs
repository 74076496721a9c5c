//! Scenes in which the radiance of every chain is known: from within glass and water, and between mirrors.

use nephroid::eye_pass::ToneMap;
use nephroid::optics::fresnel::{dielectric_reflectance, metal_reflectance};

use crate::prelude::*;

/// Refractive indices.
pub const WATER: f64 = 1.333;
const GLASS: f64 = 1.5;
/// Radiance of floors and of the background [W/(m² sr)].
pub const FLOOR: f64 = 2.0;
pub const SKY: f64 = 7.0;
/// Largest number of specular surfaces on a chain.
const MAX_SURFACES: f64 = 32.0;

/// A scene and the expected radiance in a view of it.
pub struct Law {
    pub name: &'static str,
    pub scene: Scene,
    pub view: View,
    /// Radiance seen in a direction from the eye; `None` where rounding errors or the limits of chains decide.
    pub expected: Box<dyn Fn(DVec3) -> Option<f64>>,
    /// Upper bound of the radiance of any pixel.
    pub most: f64,
    /// Share that is lost if only the stronger branch is followed after four surfaces.
    pub left_out: f64,
    /// Whether the view contains chains without any light.
    pub ends_black: bool,
}

pub fn all() -> Vec<Law> {
    vec![
        under_a_sheet_of_water(),
        within_a_body_of_water(),
        through_a_prism(),
        within_a_plate(),
        within_a_ball(),
        between_mirrors(),
        rough_in_an_even_sky(),
    ]
}

impl Law {
    /// Counts the pixels with a known radiance, and the black ones among them. An error if a pixel is not finite, is
    /// out of range, or deviates by more than a relative tolerance.
    pub fn check(&self, picture: &Picture, tolerance: f64) -> Result<[usize; 2], String> {
        let (mut known, mut black) = (0, 0);
        for (pixel, radiance) in picture.radiance.iter().enumerate() {
            let expected = (self.expected)(direction(&self.view, pixel));
            for channel in radiance {
                let channel = f64::from(*channel);
                let is_possible = channel >= 0.0 && channel <= self.most * (1.0 + tolerance);
                let is_expected = |expected: f64| (channel - expected).abs() <= tolerance * expected;
                if !is_possible || !expected.is_none_or(is_expected) {
                    return Err(format!("{}: {channel} for {expected:?} at {pixel}", self.name));
                }
            }
            known += usize::from(expected.is_some());
            black += usize::from(expected == Some(0.0));
        }
        Ok([known, black])
    }

    /// Asserts that a picture satisfies the law, and that the same picture darkened by 1 % does not.
    #[track_caller]
    pub fn assert_kept(&self, picture: &Picture, tolerance: f64) {
        let [known, black] = self
            .check(picture, tolerance)
            .unwrap_or_else(|error| panic!("{error}"));
        let count = picture.radiance.len();
        assert!(known > count * 7 / 10, "{}: {known} pixels are known", self.name);
        assert_eq!(
            black > count / 100,
            self.ends_black,
            "{}: {black} are black",
            self.name
        );
        let mut darker = picture.clone();
        darker
            .radiance
            .iter_mut()
            .flatten()
            .for_each(|channel| *channel *= 0.99);
        assert!(self.check(&darker, tolerance).is_err(), "{}", self.name);
    }
}

/// Direction through the centre of a pixel.
pub fn direction(view: &View, pixel: usize) -> DVec3 {
    let (column, row) = (pixel as u32 % view.width, pixel as u32 / view.width);
    let x = (f64::from(column) + 0.5) / f64::from(view.width) * 2.0 - 1.0;
    let y = 1.0 - (f64::from(row) + 0.5) / f64::from(view.height) * 2.0;
    view.camera
        .direction(x, y, f64::from(view.width) / f64::from(view.height))
}

fn square_view(eye: DVec3, target: DVec3, half_height: f64, pixels: u32) -> View {
    View {
        camera: Camera::look_at("eye", eye, target, 2.0 * half_height.atan()),
        width: pixels,
        height: pixels,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::grey(SKY),
    }
}

fn wide(half_m: f64, height_m: f64) -> Mesh {
    shapes::floor([-half_m, half_m], [-half_m, half_m], height_m)
}

/// A mesh above a large floor that emits light.
fn over_a_shining_floor(name: &str, height_m: f64, mesh: Mesh, material: Material) -> Scene {
    let mut scene = Scene {
        name: name.into(),
        ..Default::default()
    };
    let shining = Material {
        emitted_radiance: LinearSrgb::grey(FLOOR),
        ..parts::matte("shining", LinearSrgb::BLACK)
    };
    parts::add(&mut scene, "floor", wide(100.0, height_m), shining);
    parts::add(&mut scene, name, mesh, material);
    scene
}

/// The view straight up from under water, with a vertical field of view of 120°.
fn looking_up(name: &'static str, water: Mesh) -> Law {
    let eye = dvec3(0.2, 0.5, 0.1);
    let critical = (1.0 / WATER).asin();
    Law {
        name,
        scene: over_a_shining_floor("water", 0.0, water, parts::dielectric("water", WATER)),
        view: square_view(eye, eye + DVec3::Y, 3.0_f64.sqrt(), 240),
        expected: Box::new(move |direction| {
            let r = dielectric_reflectance(direction.y, 1.0 / WATER);
            let is_decided = (direction.y.acos() - critical).abs() > 1e-4;
            is_decided.then_some(r * FLOOR + (1.0 - r) * SKY * WATER * WATER)
        }),
        most: SKY * WATER * WATER,
        left_out: 0.0,
        ends_black: false,
    }
}

/// An open sheet; everything below it is water.
pub fn under_a_sheet_of_water() -> Law {
    looking_up("under a sheet of water", wide(90.0, 1.0))
}

/// A closed body that contains the eye and the floor.
pub fn within_a_body_of_water() -> Law {
    let body = shapes::cuboid(dvec3(-90.0, -0.5, -90.0), dvec3(90.0, 1.0, 90.0));
    looking_up("within a body of water", body)
}

/// Rough mirrors and panes that absorb nothing, whose lobes see the same sky and each other: they cannot be told from it.
fn rough_in_an_even_sky() -> Law {
    let rough = |material: Material, roughness: f64| Material { roughness, ..material };
    let pane = Material {
        surface: SurfaceKind::ThinWall,
        volume: None,
        ..parts::dielectric("pane", GLASS)
    };
    let mut scene = Scene {
        name: "rough".into(),
        ..Default::default()
    };
    for (roughness, x) in [(0.05, -0.8), (0.2, 0.0), (0.6, 0.8)] {
        let ball = shapes::sphere(dvec3(x, 0.3, 0.0), 0.3, 4);
        parts::add(&mut scene, "ball", ball, rough(parts::mirror(), roughness));
        let sheet = shapes::rectangle(dvec3(x, 0.3, 0.7), DVec3::X * 0.3, dvec3(0.0, 0.2, 0.1));
        parts::add(&mut scene, "pane", sheet, rough(pane.clone(), roughness));
    }
    Law {
        name: "rough in an even sky",
        scene,
        view: square_view(dvec3(0.3, 0.8, 2.5), dvec3(0.0, 0.3, 0.0), 0.5, 40),
        expected: Box::new(|_| Some(SKY)),
        most: SKY,
        // What the panes reflect more than four times.
        left_out: 0.01,
        ends_black: false,
    }
}

/// Transmittance and reflectance of a plate, summed over all orders.
fn plate(cos_incident: f64, eta: f64) -> (f64, f64) {
    let r = dielectric_reflectance(cos_incident, eta);
    ((1.0 - r) / (1.0 + r), 2.0 * r / (1.0 + r))
}

/// The long face of a right-angled prism turns the view down to the floor by total internal reflection.
fn through_a_prism() -> Law {
    // The front face is at z = 1/2, the bottom at y = 0; the long face runs from the front's top edge to the bottom's
    // back edge.
    let corner = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    let [front_low, front_high, back] = [(0.0, 0.5), (1.0, 0.5), (0.0, -0.5)];
    let at = |x: f64, (y, z): (f64, f64)| corner(x, y, z);
    let mut prism = Mesh::default();
    let mut add = |corners: &[DVec3]| {
        let first = prism.positions.len() as u32;
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize();
        prism.positions.extend(corners);
        prism.normals.extend(vec![normal; corners.len()]);
        let rest = 1..corners.len() as u32 - 1;
        prism
            .triangles
            .extend(rest.map(|i| [first, first + i, first + i + 1]));
    };
    let quad = |a, b| [at(-0.5, a), at(0.5, a), at(0.5, b), at(-0.5, b)];
    add(&quad(front_low, front_high));
    add(&quad(front_high, back));
    add(&quad(back, front_low));
    add(&[front_low, front_high, back]
        .map(|place| at(0.5, place))
        .into_iter()
        .rev()
        .collect::<Vec<_>>());
    add(&[front_low, front_high, back].map(|place| at(-0.5, place)));
    Law {
        name: "through a prism",
        scene: over_a_shining_floor("prism", -0.5, prism, parts::dielectric("glass", GLASS)),
        view: square_view(dvec3(0.0, 0.5, 2.5), dvec3(0.0, 0.5, 0.0), 0.03, 24),
        // Unfolded at its long face, the prism is a plate. Light that the plate reflects continues in the view's
        // direction; it reaches the floor if it falls by more than 1 m in 100 m.
        expected: Box::new(|direction| {
            let (through, back) = plate(-direction.z, GLASS);
            let fall = direction.y / direction.z;
            let behind = if fall > 0.01 { FLOOR } else { SKY };
            let is_decided = (fall - 0.01).abs() > 0.003;
            is_decided.then_some(through * FLOOR + back * behind)
        }),
        most: SKY,
        left_out: 0.002,
        ends_black: false,
    }
}

/// The view down from within a glass plate: beyond the critical angle light never leaves the plate, and the chain
/// ends black.
fn within_a_plate() -> Law {
    let mesh = shapes::cuboid(dvec3(-90.0, 0.4, -90.0), dvec3(90.0, 0.7, 90.0));
    let eye = dvec3(0.1, 0.6, 0.2);
    Law {
        name: "within a plate",
        scene: over_a_shining_floor("plate", 0.0, mesh, parts::dielectric("glass", GLASS)),
        view: square_view(eye, eye - DVec3::Y, 1.0, 120),
        expected: Box::new(|direction| {
            let r = dielectric_reflectance(-direction.y, 1.0 / GLASS);
            if r == 1.0 {
                return Some(0.0);
            }
            // Near the critical angle many orders contribute.
            (r < 0.1).then(|| GLASS * GLASS * (FLOOR + r * SKY) / (1.0 + r))
        }),
        most: SKY * GLASS * GLASS,
        left_out: 0.0005,
        ends_black: true,
    }
}

/// Within a ball under a uniform sky, the radiance is n² times that of the sky.
fn within_a_ball() -> Law {
    let centre = dvec3(0.4, 2.0, -0.3);
    let mut scene = Scene::default();
    let ball = shapes::sphere(centre, 0.5, 4);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", GLASS));
    let eye = centre + dvec3(0.1, -0.05, 0.08);
    Law {
        name: "within a ball",
        scene,
        view: square_view(eye, eye + dvec3(1.0, 0.3, -0.4), 1.0, 60),
        expected: Box::new(|_| Some(SKY * GLASS * GLASS)),
        most: SKY * GLASS * GLASS,
        left_out: 0.0005,
        ends_black: false,
    }
}

/// Two mirrors at x = ±1 with a reflectance of 0.9, a floor below and the sky above y = 2. Near the horizon, chains
/// reflect again and again and end after 32 surfaces.
fn between_mirrors() -> Law {
    const F0: f64 = 0.9;
    const TOP: f64 = 2.0;
    let metal = || Material {
        base_colour: LinearSrgb::grey(F0),
        ..parts::mirror()
    };
    let (up, along) = (DVec3::Y * 1.25, DVec3::Z * 60.0);
    let place = |x: f64| dvec3(x, TOP - 1.25, 0.0);
    let right = shapes::rectangle(place(1.0), along, up);
    let mut scene = over_a_shining_floor("right mirror", 0.0, right, metal());
    let left = shapes::rectangle(place(-1.0), up, along);
    parts::add(&mut scene, "left mirror", left, metal());
    let eye = dvec3(0.1, 1.0, 0.0);
    Law {
        name: "between mirrors",
        scene,
        view: square_view(eye, eye + DVec3::X, 0.4, 160),
        expected: Box::new(move |direction| {
            let height = if direction.y < 0.0 { eye.y } else { TOP - eye.y };
            // Where the ray ends in the unfolded hall.
            let end = eye.x + direction.x / direction.y.abs() * height;
            let surfaces = (0.5 * (end + 1.0)).floor();
            if surfaces > MAX_SURFACES {
                return Some(0.0);
            }
            let is_decided = (0.5 * (end + 1.0) - surfaces - 0.5).abs() < 0.499;
            let share = metal_reflectance(direction.x, LinearSrgb::grey(F0))
                .r
                .powf(surfaces);
            let sent = if direction.y < 0.0 { FLOOR } else { SKY };
            is_decided.then_some(share * sent)
        }),
        most: SKY,
        left_out: 0.0,
        ends_black: true,
    }
}
