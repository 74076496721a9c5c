//! Random scenes: a floor, perhaps a wall and a blocker, one or two specular things anywhere above it, in and through
//! one another too, and a lamp.

use glam::{DQuat, DVec3};
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Light, LightKind, LightSize, Material, Mesh, PanelShape, Scene, SurfaceKind, Volume};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::units::{Flux, Irradiance, Radiance};
use proptest::prelude::*;

/// Texels each way of every map.
pub const SIDE: usize = 32;

/// All that a scene and its bake are made of.
#[derive(Clone, Debug)]
pub struct Recipe {
    pub casters: Vec<Caster>,
    /// Whether the last caster stands once more in the same place.
    pub is_doubled: bool,
    pub has_wall: bool,
    /// Middle of a matte box [m].
    pub blocker: Option<[f64; 3]>,
    pub lamp: Lamp,
    /// For laws about two of them.
    pub other_lamp: Lamp,
    pub splat: bool,
    pub with_direct: bool,
    /// Light rays per steradian.
    pub density_per_sr: f64,
}

/// Something specular.
#[derive(Clone, Copy, Debug)]
pub struct Caster {
    shape: Shape,
    stuff: Stuff,
    centre: [f64; 3],
    size_m: f64,
    /// About y, then about x [rad].
    turn: [f64; 2],
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Ball,
    CutBall,
    Block,
    Panel,
    Dish,
    Triangle,
}

#[derive(Clone, Copy, Debug)]
enum Stuff {
    Mirror { tint: f64 },
    BrushedMetal { roughness: f64 },
    Glass { ior: f64 },
    ColouredGlass { ior: f64, distance_m: f64 },
    Flint,
    Pane { ior: f64 },
    Polish { ior: f64 },
}

/// Something that shines.
#[derive(Clone, Copy, Debug)]
pub enum Lamp {
    Point { place: [f64; 3] },
    Spot { place: [f64; 3], half_angle_rad: f64 },
    Sun { from: [f64; 3] },
    Bulb { place: [f64; 3], radius_m: f64 },
    Panel { place: [f64; 3], half_m: f64 },
}

/// Any of them.
pub fn recipe() -> impl Strategy<Value = Recipe> {
    let blocker = prop::option::weighted(0.3, place([-0.5, 0.05, -0.5], [0.5, 0.5, 0.5]));
    let things = (prop::collection::vec(caster(), 1..=2), prop::bool::weighted(0.08));
    let room = (prop::bool::weighted(0.3), blocker);
    let how = (prop::bool::weighted(0.3), any::<bool>(), 20.0..80.0_f64);
    (things, room, (lamp(), lamp()), how).prop_map(
        |((casters, is_doubled), (has_wall, blocker), (lamp, other_lamp), how)| Recipe {
            // The wavefront looks for every line at which light goes another way: where bodies of glass go through one
            // another these are so many that a scene takes a minute. Splats take it as it comes.
            splat: how.0 || clear_bodies(&casters, is_doubled) > 1,
            casters,
            is_doubled,
            has_wall,
            blocker,
            lamp,
            other_lamp,
            with_direct: how.1,
            density_per_sr: how.2,
        },
    )
}

/// Bodies that light goes into.
fn clear_bodies(casters: &[Caster], is_doubled: bool) -> usize {
    let is_clear = |caster: &&Caster| {
        matches!(
            caster.stuff,
            Stuff::Glass { .. } | Stuff::ColouredGlass { .. } | Stuff::Flint
        )
    };
    let again = casters.last().filter(|_| is_doubled);
    casters.iter().chain(again).filter(is_clear).count()
}

fn place(low: [f64; 3], high: [f64; 3]) -> impl Strategy<Value = [f64; 3]> {
    [low[0]..high[0], low[1]..high[1], low[2]..high[2]].prop_map(|place: [f64; 3]| place)
}

fn caster() -> impl Strategy<Value = Caster> {
    let shape = prop_oneof![
        Just(Shape::Ball),
        Just(Shape::CutBall),
        Just(Shape::Block),
        Just(Shape::Panel),
        Just(Shape::Dish),
        Just(Shape::Triangle),
    ];
    let centre = place([-0.5, 0.1, -0.5], [0.5, 0.8, 0.5]);
    let turn = [0.0..6.3_f64, -1.6..1.6_f64];
    (shape, stuff(), centre, 0.08..0.35_f64, turn).prop_map(|(shape, stuff, centre, size_m, turn)| Caster {
        // Between the walls of a hollow body light goes on and on, a branch per wall.
        shape: if matches!(stuff, Stuff::Pane { .. }) {
            Shape::Panel
        } else {
            shape
        },
        stuff,
        centre,
        size_m,
        turn,
    })
}

fn stuff() -> impl Strategy<Value = Stuff> {
    prop_oneof![
        6 => (0.2..1.0).prop_map(|tint| Stuff::Mirror { tint }),
        2 => (0.05..0.3).prop_map(|roughness| Stuff::BrushedMetal { roughness }),
        6 => (1.0..2.5).prop_map(|ior| Stuff::Glass { ior }),
        2 => (1.1..1.9, 0.05..2.0).prop_map(|(ior, distance_m)| Stuff::ColouredGlass { ior, distance_m }),
        1 => Just(Stuff::Flint),
        2 => (1.1..1.9).prop_map(|ior| Stuff::Pane { ior }),
        2 => (1.2..2.5).prop_map(|ior| Stuff::Polish { ior }),
    ]
}

fn lamp() -> impl Strategy<Value = Lamp> {
    let above = || place([-0.9, 1.2, -0.9], [0.9, 2.4, 0.9]);
    prop_oneof![
        // Anywhere, within things too.
        2 => place([-0.9, 0.02, -0.9], [0.9, 1.2, 0.9]).prop_map(|place| Lamp::Point { place }),
        4 => above().prop_map(|place| Lamp::Point { place }),
        2 => (above(), 0.1..1.5).prop_map(|(place, half_angle_rad)| Lamp::Spot { place, half_angle_rad }),
        3 => above().prop_map(|from| Lamp::Sun { from }),
        1 => (above(), 0.01..0.2).prop_map(|(place, radius_m)| Lamp::Bulb { place, radius_m }),
        1 => (above(), 0.02..0.3).prop_map(|(place, half_m)| Lamp::Panel { place, half_m }),
    ]
}

impl Recipe {
    /// The scene under its first lamp.
    pub fn scene(&self) -> Scene {
        let mut scene = parts::reference_scene(1.0);
        scene.name = "random".into();
        scene.source = "test:random".into();
        let matte = |name| parts::matte(name, LinearSrgb::grey(0.5));
        if self.has_wall {
            let wall = shapes::rectangle(DVec3::new(-1.0, 0.5, 0.0), DVec3::Z * -1.0, DVec3::Y * 0.5);
            parts::add(&mut scene, "wall", wall, matte("wall"));
        }
        if let Some(centre) = self.blocker {
            let (centre, half) = (DVec3::from(centre), DVec3::new(0.12, 0.05, 0.08));
            let mesh = shapes::cuboid(centre - half, centre + half);
            parts::add(&mut scene, "blocker", mesh, matte("blocker"));
        }
        let again = self.casters.last().filter(|_| self.is_doubled);
        for (index, caster) in self.casters.iter().chain(again).enumerate() {
            let name = format!("caster {index}");
            parts::add(&mut scene, &name, caster.mesh(), caster.stuff.material());
        }
        scene.lights.push(self.lamp.light("lamp"));
        scene
    }

    /// Whether light is split by its wavelength.
    pub fn is_dispersive(&self) -> bool {
        let mut casters = self.casters.iter();
        casters.any(|caster| matches!(caster.stuff, Stuff::Flint))
    }

    /// The bake that belongs to it, on one thread.
    pub fn settings(&self) -> BakeSettings {
        let usual = if self.splat {
            BakeSettings::splat()
        } else {
            BakeSettings::default()
        };
        let mut layers = vec![LayerKind::Caustic];
        layers.extend(self.with_direct.then_some(LayerKind::Direct));
        BakeSettings {
            density_per_sr: self.density_per_sr,
            map_resolution: MapResolution::Fixed {
                width: SIDE,
                height: SIDE,
            },
            max_depth: 3,
            branch_threshold: Some(0.01),
            wavefronts: Some(2),
            layers,
            threads: 1,
            ..usual
        }
    }
}

impl Caster {
    fn mesh(&self) -> Mesh {
        let size = self.size_m;
        let mut mesh = match self.shape {
            Shape::Ball => shapes::sphere(DVec3::ZERO, size, 0),
            Shape::CutBall => facets(&shapes::sphere(DVec3::ZERO, size, 0)),
            Shape::Block => {
                let half = DVec3::new(size, 0.4 * size, 0.7 * size);
                shapes::cuboid(-half, half)
            }
            Shape::Panel => shapes::rectangle(DVec3::ZERO, DVec3::X * size, DVec3::Z * (0.6 * size)),
            Shape::Dish => dish(size),
            Shape::Triangle => shapes::facet([DVec3::ZERO, DVec3::Z * size, DVec3::X * size]),
        };
        let [about_y, about_x] = self.turn;
        let turn = DQuat::from_rotation_y(about_y) * DQuat::from_rotation_x(about_x);
        let centre = DVec3::from(self.centre);
        mesh.positions.iter_mut().for_each(|p| *p = centre + turn * *p);
        mesh.normals.iter_mut().for_each(|n| *n = (turn * *n).normalize());
        mesh
    }
}

/// A half of a hollow sphere.
fn dish(radius: f64) -> Mesh {
    shapes::sheet(6, 3, |u, v| {
        let (sine, cosine) = (std::f64::consts::TAU * u.fract()).sin_cos();
        let (down, out) = f64::sin_cos((0.02 + 0.98 * v) * std::f64::consts::FRAC_PI_2);
        let outward = DVec3::new(cosine * down, -out, sine * down);
        (outward * radius, -outward)
    })
}

fn facets(mesh: &Mesh) -> Mesh {
    let mut flat = Mesh::default();
    for triangle in 0..mesh.triangles.len() {
        shapes::append(&mut flat, &shapes::facet(mesh.corners(triangle)));
    }
    flat
}

impl Stuff {
    fn material(self) -> Material {
        match self {
            Self::Mirror { tint } => Material {
                base_colour: LinearSrgb::new(1.0, tint, 0.5 * tint),
                ..parts::mirror()
            },
            Self::BrushedMetal { roughness } => Material {
                roughness,
                ..parts::mirror()
            },
            Self::Glass { ior } => parts::dielectric("glass", ior),
            Self::ColouredGlass { ior, distance_m } => Material {
                volume: Some(Volume {
                    attenuation_distance_m: distance_m,
                    attenuation_colour: LinearSrgb::new(0.9, 0.5, 0.1),
                }),
                ..parts::dielectric("coloured glass", ior)
            },
            Self::Flint => parts::glass("N-SF11"),
            Self::Pane { ior } => Material {
                surface: SurfaceKind::ThinWall,
                volume: None,
                base_colour: LinearSrgb::new(0.8, 0.9, 1.0),
                ..parts::dielectric("pane", ior)
            },
            Self::Polish { ior } => Material {
                surface: SurfaceKind::Mixed,
                roughness: 0.0,
                ior,
                ..parts::matte("lacquer", LinearSrgb::new(0.7, 0.2, 0.1))
            },
        }
    }
}

impl Lamp {
    /// Its light, under a name.
    pub fn light(self, name: &str) -> Light {
        match self {
            Self::Point { place } => parts::point_light(name, place.into(), Flux(10.0)),
            Self::Spot {
                place,
                half_angle_rad,
            } => {
                let place = DVec3::from(place);
                parts::beam(name, place, DVec3::Y * 0.3 - place, half_angle_rad, Flux(10.0))
            }
            Self::Sun { from } => parts::sun(name, -DVec3::from(from), Irradiance(1.0)),
            Self::Bulb { place, radius_m } => Light {
                size: LightSize::Radius { radius_m },
                ..parts::point_light(name, place.into(), Flux(10.0))
            },
            Self::Panel { place, half_m } => Light {
                kind: LightKind::Panel {
                    centre: place.into(),
                    across: DVec3::X * half_m,
                    down: DVec3::Z * half_m,
                    shape: PanelShape::Rectangle,
                    radiance: Radiance(10.0),
                },
                ..parts::point_light(name, DVec3::ZERO, Flux(1.0))
            },
        }
    }
}
