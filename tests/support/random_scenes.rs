//! Random scenes: a floor, one to three casters, some of them enclosed, up to three walls, one to three lamps.

use crate::prelude::*;
use crate::laws::scenes::{Build, floor, random, spot, tinted};

/// Largest number of lamps in a scene.
pub const MAX_LAMPS: u32 = 3;

/// The random scene of a seed.
pub fn scene(seed: u64) -> Scene {
    let mut dice = Dice(random(0xeffec7 ^ seed << 20));
    let mut scene = floor(1.0);
    for _ in 0..1 + dice.below(3) {
        scene = dice.with_caster(scene);
    }
    for index in 0..dice.below(4) {
        let centre = dice.place([0.1, 1.2]);
        let turn = dice.turn();
        let (width, height) = (dice.between(0.1, 0.8), dice.between(0.1, 0.8));
        let wall = shapes::rectangle(centre, turn * DVec3::X * width, turn * DVec3::Z * height);
        scene = scene.diffuse(&format!("wall{index}"), wall);
    }
    for index in 0..1 + dice.below(MAX_LAMPS) {
        let name = format!("lamp{index}");
        scene = scene.lit(Light { name, ..dice.lamp() });
    }
    scene.name = format!("random {seed}");
    scene
}

struct Dice<F>(F);

impl<F: FnMut() -> f64> Dice<F> {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0)()
    }

    fn below(&mut self, count: u32) -> u32 {
        self.between(0.0, f64::from(count)) as u32
    }

    fn place(&mut self, height: [f64; 2]) -> DVec3 {
        let x = self.between(-0.8, 0.8);
        dvec3(x, self.between(height[0], height[1]), self.between(-0.8, 0.8))
    }

    fn turn(&mut self) -> DQuat {
        DQuat::from_rotation_y(self.between(0.0, 6.3)) * DQuat::from_rotation_x(self.between(0.0, 3.2))
    }

    fn glass(&mut self) -> Material {
        let glass = parts::dielectric("glass", self.between(1.2, 1.9));
        if self.below(3) == 0 {
            return tinted(glass, self.between(0.05, 1.0), rgb(0.9, 0.5, 0.3));
        }
        glass
    }

    fn with_caster(&mut self, scene: Scene) -> Scene {
        let (centre, size) = (self.place([0.2, 1.0]), self.between(0.15, 0.3));
        let turn = self.turn();
        let panel = shapes::rectangle(centre, turn * DVec3::X * size, turn * DVec3::Z * size);
        let pane = Material {
            surface: SurfaceKind::ThinWall,
            volume: None,
            ..parts::dielectric("pane", 1.5)
        };
        let (mesh, material) = match self.below(5) {
            0 => (shapes::sphere(centre, size, 2), self.glass()),
            1 => (shapes::sphere(centre, size, 2), parts::mirror()),
            2 => (panel, parts::mirror()),
            3 => (panel, pane),
            _ => (shapes::cuboid(centre - size, centre + size), self.glass()),
        };
        let scene = scene.with("caster", mesh, material);
        // One caster in four is enclosed in a diffuse box.
        if self.below(4) > 0 {
            return scene;
        }
        let half = size * self.between(1.8, 2.5);
        scene.diffuse("safe", shapes::cuboid(centre - half, centre + half))
    }

    fn lamp(&mut self) -> Light {
        let place = self.place([0.8, 2.2]);
        match self.below(4) {
            0 => {
                let direction = dvec3(self.between(-1.0, 1.0), -1.0, self.between(-1.0, 1.0));
                parts::sun("sun", direction, Irradiance(2.0))
            }
            1 => spot(place, self.place([0.0, 0.6]) - place, 2.0, [0.2, self.between(0.3, 1.0)]),
            _ => parts::point_light("lamp", place, Flux(10.0)),
        }
    }
}
