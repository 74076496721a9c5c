//! Scenes that are hard for estimators: coarse and faceted meshes, occluders, silhouettes within one surface, grazing
//! light, small casters, several receivers. Metres, watts, y up; each has one light, and receivers named `floor`,
//! `wall`, `blocker`, …

use nephroid::scene::PanelShape;

use crate::prelude::*;
use crate::scenes::panel;
use crate::tools::builtin_scene;

/// Normals of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    /// Normals of the exact surface.
    Smooth,
    /// Normals of the triangles.
    Flat,
}

/// Built-in `ring` (oracle S1) with a given number of segments.
pub fn ring(segments: u32, shading: Shading) -> Scene {
    let name = format!("ring_{segments}_{shading:?}").to_lowercase();
    let mut scene = named(&name, parts::reference_scene(1.0));
    let smooth = shapes::sheet(segments, 1, |u, v| {
        let (sine, cosine) = (TAU * u.fract()).sin_cos();
        let outward = dvec3(cosine, 0.0, sine);
        (outward + DVec3::Y * (0.5 * v), -outward)
    });
    let mesh = match shading {
        Shading::Smooth => smooth,
        Shading::Flat => flat(&smooth),
    };
    parts::add(&mut scene, "ring", mesh, parts::mirror());
    lamp(&mut scene, dvec3(-0.7, 1.2, 0.0));
    scene
}

/// The ring with a box that occludes its far wall.
pub fn ring_with_blocker() -> Scene {
    let mut scene = ring(256, Shading::Smooth);
    blocker(
        &mut scene,
        dvec3(0.05, 0.6, -0.15),
        dvec3(0.2, 0.8, 0.1),
    );
    scene.name = "ring_with_blocker".into();
    scene
}

/// Built-in `ball` (oracle S2) with 20,480 triangles.
pub fn ball() -> Scene {
    let mut scene = named("ball", parts::reference_scene(0.6));
    glass_ball(&mut scene, dvec3(0.0, 0.8, 0.0), 0.5, 5);
    lamp(&mut scene, dvec3(0.0, 3.0, 0.0));
    scene
}

/// The ball with a box in its converging light, off the axis.
pub fn ball_with_blocker() -> Scene {
    let mut scene = ball();
    blocker(
        &mut scene,
        dvec3(0.03, 0.1, -0.06),
        dvec3(0.15, 0.14, 0.05),
    );
    scene.name = "ball_with_blocker".into();
    scene
}

/// A tilted torus that occludes part of itself.
pub fn torus(material: Material) -> Scene {
    let name = format!("{}_torus", material.name);
    let mut scene = named(&name, parts::reference_scene(1.0));
    let tilt = DMat3::from_rotation_x(0.5) * DMat3::from_rotation_z(0.3);
    let (ring_m, tube_m) = (0.35, 0.14);
    let mesh = shapes::sheet(128, 64, |u, v| {
        let ((sine_u, cosine_u), (sine_v, cosine_v)) =
            ((TAU * u.fract()).sin_cos(), (TAU * v.fract()).sin_cos());
        let outward = dvec3(cosine_u, 0.0, sine_u);
        let normal = outward * cosine_v + DVec3::Y * sine_v;
        let point = outward * ring_m + normal * tube_m;
        (dvec3(0.0, 0.6, 0.0) + tilt * point, tilt * normal)
    });
    parts::add(&mut scene, "torus", mesh, material);
    lamp(&mut scene, dvec3(0.5, 2.0, 0.3));
    scene
}

/// Waves that occlude one another under a sun 10° above the horizon.
pub fn grazing_pool() -> Scene {
    let mut scene = named("grazing_pool", parts::reference_scene(1.0));
    // (kx, kz, phase) of waves of 2 cm amplitude.
    let waves = [(9.0, 0.0, 1.0), (0.0, 7.0, 2.0), (6.0, 5.0, 0.0)];
    let water = shapes::sheet(320, 192, |u, v| {
        let (x, z) = (-3.0 + 5.0 * u, -1.5 + 3.0 * v);
        let (mut height, mut slope_x, mut slope_z) = (1.0, 0.0, 0.0);
        for (kx, kz, phase) in waves {
            let (sine, cosine) = f64::sin_cos(kx * x + kz * z + phase);
            height += 0.02 * cosine;
            slope_x -= 0.02 * kx * sine;
            slope_z -= 0.02 * kz * sine;
        }
        (
            dvec3(x, height, z),
            dvec3(-slope_x, 1.0, -slope_z).normalize(),
        )
    });
    parts::add(&mut scene, "water", water, parts::dielectric("water", 1.333));
    let (sine, cosine) = 10.0_f64.to_radians().sin_cos();
    sun(&mut scene, dvec3(cosine, -sine, 0.0));
    scene
}

/// A mirror bowl on its side with the lamp inside: light leaves it after one or several reflections.
pub fn mirror_bowl() -> Scene {
    let mut scene = named("mirror_bowl", parts::reference_scene(1.0));
    let tilt = DMat3::from_rotation_z(2.2);
    let centre = dvec3(-0.2, 0.8, 0.0);
    let inside = cap(96, 48, |direction| {
        (centre + tilt * direction * 0.5, -(tilt * direction))
    });
    parts::add(&mut scene, "bowl", inside, parts::mirror());
    lamp(&mut scene, centre + dvec3(0.1, -0.05, 0.07));
    scene
}

/// A glass bowl, open at the top, with the lamp above its rim.
pub fn glass_bowl() -> Scene {
    let mut scene = named("glass_bowl", parts::reference_scene(1.0));
    let (centre, outer_m, inner_m) = (dvec3(0.0, 0.65, 0.0), 0.5, 0.44);
    let mut bowl = cap(96, 48, |direction| (centre + direction * outer_m, direction));
    shapes::append(
        &mut bowl,
        &cap(96, 48, |direction| (centre + direction * inner_m, -direction)),
    );
    let rim = shapes::sheet(96, 1, |u, v| {
        let (sine, cosine) = (TAU * u.fract()).sin_cos();
        let radius = inner_m + (outer_m - inner_m) * v;
        (centre + dvec3(cosine, 0.0, sine) * radius, DVec3::Y)
    });
    shapes::append(&mut bowl, &rim);
    parts::add(&mut scene, "bowl", bowl, parts::dielectric("glass", 1.5));
    lamp(&mut scene, centre + dvec3(0.15, 0.6, 0.1));
    scene
}

/// A glass ball cut into 320 flat facets.
pub fn cut_glass() -> Scene {
    let mut scene = named("cut_glass", parts::reference_scene(1.0));
    let facets = flat(&shapes::sphere(dvec3(0.0, 0.7, 0.0), 0.4, 2));
    parts::add(&mut scene, "gem", facets, parts::dielectric("glass", 1.5));
    lamp(&mut scene, dvec3(0.3, 2.5, 0.1));
    scene
}

/// Parts of [`tiny_ball`]. Light of one part does not reach the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TinyBall {
    Both,
    Ball,
    Mirror,
}

/// A glass ball of 0.45 mm diameter, a hundredth of a lattice cell at 10³ rays/sr, beside a mirror of 0.4 m under one
/// sun.
pub fn tiny_ball(parts_of: TinyBall) -> Scene {
    let name = match parts_of {
        TinyBall::Both => "tiny_ball_and_mirror",
        TinyBall::Ball => "tiny_ball",
        TinyBall::Mirror => "mirror_of_the_tiny_ball",
    };
    let mut scene = named(name, parts::reference_scene(0.6));
    if parts_of != TinyBall::Mirror {
        glass_ball(&mut scene, dvec3(-0.3, 0.3, 0.0), 0.000_225, 4);
    }
    if parts_of != TinyBall::Ball {
        let mirror = shapes::rectangle(
            dvec3(0.55, 0.35, 0.0),
            dvec3(0.03, 0.2, 0.0),
            DVec3::Z * 0.2,
        );
        parts::add(&mut scene, "mirror", mirror, parts::mirror());
    }
    sun(&mut scene, dvec3(0.5, -1.0, 0.05));
    scene
}

/// A ball that is lit through another.
pub fn balls_in_series() -> Scene {
    let mut scene = named("balls_in_series", parts::reference_scene(0.6));
    glass_ball(&mut scene, dvec3(0.02, 1.4, 0.0), 0.3, 4);
    glass_ball(&mut scene, dvec3(-0.03, 0.6, 0.02), 0.25, 4);
    lamp(&mut scene, dvec3(0.1, 3.0, 0.05));
    scene
}

/// The ball above a floor, in front of a wall, with a table below part of it.
pub fn ball_in_a_room() -> Scene {
    let mut scene = ball();
    let wall = shapes::rectangle(dvec3(-0.6, 0.6, 0.0), DVec3::Z * -0.6, DVec3::Y * 0.6);
    let matte = |name| parts::matte(name, LinearSrgb::grey(0.5));
    parts::add(&mut scene, "wall", wall, matte("wall"));
    let table = shapes::cuboid(dvec3(0.05, 0.15, -0.4), dvec3(0.5, 0.19, 0.3));
    parts::add(&mut scene, "table", table, matte("table"));
    scene.name = "ball_in_a_room".into();
    scene
}

/// The scene with its floor rotated by 30° about a horizontal axis through its centre.
pub fn with_tilted_floor(mut scene: Scene) -> Scene {
    let tilt = DMat3::from_axis_angle(dvec3(0.6, 0.0, 0.8), PI / 6.0);
    for object in scene.objects.iter_mut().filter(|object| object.name == "floor") {
        let mesh = object.mesh_in_scene_mut();
        mesh.positions.iter_mut().for_each(|p| *p = tilt * *p);
        mesh.normals.iter_mut().for_each(|n| *n = tilt * *n);
    }
    scene.name += "_over_a_tilted_floor";
    scene
}

/// The scene with its floor cut into two objects at x = 7 % of its half width.
pub fn with_cut_floor(mut scene: Scene) -> Scene {
    let floor = scene
        .objects
        .iter()
        .position(|object| object.name == "floor")
        .expect("a floor");
    let half = scene.objects[floor].mesh_in_scene().positions[2].x.abs();
    let (cut, z) = (0.07 * half, [-half, half]);
    *scene.objects[floor].mesh_in_scene_mut() = shapes::floor([-half, cut], z, 0.0);
    let material = scene.objects[floor].material;
    parts::add_with(
        &mut scene,
        "other floor",
        shapes::floor([cut, half], z, 0.0),
        material,
    );
    scene.name += "_over_a_cut_floor";
    scene
}

/// The mesh with separate triangles and their face normals.
pub fn flat(mesh: &Mesh) -> Mesh {
    let mut facets = Mesh::default();
    for triangle in 0..mesh.triangles.len() {
        let first = facets.positions.len() as u32;
        facets.positions.extend(mesh.corners(triangle));
        facets.normals.extend([mesh.face_normal(triangle); 3]);
        facets.triangles.push([first, first + 1, first + 2]);
    }
    facets
}

fn named(name: &str, mut scene: Scene) -> Scene {
    scene.name = name.into();
    scene.source = format!("test:{name}");
    scene
}

/// A point light of 100 W.
fn lamp(scene: &mut Scene, position: DVec3) {
    scene
        .lights
        .push(parts::point_light("light", position, Flux(100.0)));
}

/// A sun of 1 W/m².
fn sun(scene: &mut Scene, direction: DVec3) {
    scene.lights.push(parts::sun("light", direction, Irradiance(1.0)));
}

fn glass_ball(scene: &mut Scene, centre: DVec3, radius: f64, levels: u32) {
    let name = format!("ball {}", scene.objects.len());
    let mesh = shapes::sphere(centre, radius, levels);
    parts::add(scene, &name, mesh, parts::dielectric("glass", 1.5));
}

fn blocker(scene: &mut Scene, low: DVec3, high: DVec3) {
    let material = parts::matte("blocker", LinearSrgb::grey(0.5));
    parts::add(scene, "blocker", shapes::cuboid(low, high), material);
}

/// The lower half of a sphere; `surface` maps a direction to position and normal.
fn cap(columns: u32, rows: u32, surface: impl Fn(DVec3) -> (DVec3, DVec3)) -> Mesh {
    shapes::sheet(columns, rows, |u, v| {
        let (sine_u, cosine_u) = (TAU * u.fract()).sin_cos();
        let (sine_v, cosine_v) = (0.5 * PI * v).sin_cos();
        surface(dvec3(sine_v * cosine_u, -cosine_v, sine_v * sine_u))
    })
}

/// A built-in scene with a square panel of a given side [m] in place of its point light. The panel faces down; its
/// intensity on the axis does not depend on the side.
pub fn under_square_lamp(name: &str, side_m: f64) -> Scene {
    let mut scene = builtin_scene(name);
    let centre = scene.lights[0].kind.position().expect("a point light");
    let sides = [DVec3::X, DVec3::Z].map(|side| side * (0.5 * side_m));
    scene.lights[0].kind = panel(centre, sides, PanelShape::Rectangle, 8.0 / (side_m * side_m)).kind;
    scene
}

/// Built-in `nephroid` under a sun of 0.53° diameter.
pub fn under_the_suns_disc() -> Scene {
    let mut scene = builtin_scene("nephroid");
    let diameter_rad = 0.53_f64.to_radians();
    scene.lights[0].size = LightSize::Angle { diameter_rad };
    scene
}

/// A built-in scene with a given roughness of its specular materials.
pub fn roughened(name: &str, roughness: f64) -> Scene {
    let mut scene = builtin_scene(name);
    let specular = |material: &&mut Material| material.surface.is_specular();
    for material in scene.materials.iter_mut().filter(specular) {
        material.roughness = roughness;
    }
    scene
}
