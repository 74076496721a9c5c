//! The device's rays: its search for the nearest triangle against the CPU's and against the exact answer, and shadow rays
//! from lamps against the baked layer.

use nephroid::eye_pass::renderer::{ProbedHit, probe};
use nephroid::scene::PanelShape;
use rayon::prelude::*;

use crate::gpu::rig::{AS_CPU, Rig, gpu, or_skip, unlike};
use support::floors::{diffuse, floor_scene};
use support::meshes::{inside_out, moved};
use support::prelude::*;
use support::scenes::{lamps_of_all_kinds, light, panel, point_light, spot, sun, tinted, view};
use support::tools::{bake, builtin_scene, set, to};

/// Evenly spread numbers that are the same in every run (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In [0, 1).
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn direction(&mut self) -> DVec3 {
        let y = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (TAU * self.next()).sin_cos();
        dvec3(cosine, 0.0, sine) * (1.0 - y * y).sqrt() + DVec3::Y * y
    }

    /// Within a ball.
    fn place(&mut self, centre: DVec3, radius: f64) -> DVec3 {
        centre + self.direction() * (radius * self.next().cbrt())
    }

    /// A corner of a triangle, or a place on one of its edges.
    fn rim(&mut self, triangles: &[[DVec3; 3]]) -> DVec3 {
        let corners = triangles[(self.next() * triangles.len() as f64) as usize];
        let first = (self.next() * 3.0) as usize;
        let share = if self.next() < 0.5 { 0.0 } else { self.next() };
        corners[first].lerp(corners[(first + 1) % 3], share)
    }

    /// From within a ball, every `nth` one at an edge or a corner.
    fn rays(&mut self, scene: &Scene, (centre, radius): (DVec3, f64), nth: usize, count: usize) -> Vec<Ray> {
        let meshes = scene.objects.iter().map(|object| object.mesh_in_scene());
        let corners = |mesh: &Arc<Mesh>| {
            (0..mesh.triangles.len())
                .map(|at| mesh.corners(at))
                .collect::<Vec<_>>()
        };
        let triangles: Vec<[DVec3; 3]> = meshes.flat_map(corners).collect();
        let ray = |index: usize| {
            let origin = self.place(centre, radius);
            let direction = match index % nth {
                0 => (self.rim(&triangles) - origin).normalize(),
                _ => self.direction(),
            };
            Ray { origin, direction }
        };
        (0..count).map(ray).collect()
    }
}

/// Icosphere pushed in and out, about 82,000 triangles.
fn bumpy_sphere() -> Scene {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, 6);
    for position in &mut mesh.positions {
        let p = *position * 7.0;
        *position *= 1.0 + 0.06 * (p.x.sin() * p.y.cos() + (2.0 * p.z).sin());
    }
    of(vec![mesh])
}

fn of(meshes: Vec<Mesh>) -> Scene {
    let mut scene = Scene::default();
    for mesh in meshes {
        let grey = parts::matte("grey", LinearSrgb::grey(0.5));
        parts::add(&mut scene, "part", mesh, grey);
    }
    scene
}

/// Far from the origin: a floor of 200 m twice at the same place, slivers 50 m long and 4 to 40 mm wide, balls of
/// 1 cm and of 0.1 mm, needles.
fn awkward() -> Scene {
    let mut numbers = Numbers::new(5);
    let cylinder = |radius: f64, segments: u32| {
        shapes::sheet(segments, 1, |u, v| {
            let (sine, cosine) = (TAU * u.fract()).sin_cos();
            let outward = dvec3(cosine, 0.0, sine);
            (outward * radius + DVec3::Y * (50.0 * v), outward)
        })
    };
    let mut needles = Mesh::default();
    for first in (0..1500).step_by(3) {
        let base = numbers.place(DVec3::ZERO, 80.0);
        let width = 10_f64.powf(-6.0 * numbers.next());
        let tip = base + numbers.direction() * 20.0;
        let beside = base + numbers.direction() * width;
        needles.positions.extend([base, beside, tip]);
        needles.normals.extend([DVec3::Y; 3]);
        needles.triangles.push([first, first + 1, first + 2]);
    }
    let floor = || shapes::floor([-100.0, 100.0], [-100.0, 100.0], 0.0);
    let mut scene = of(vec![
        floor(),
        floor(),
        cylinder(3.0, 4096),
        cylinder(12.0, 2048),
        shapes::sphere(dvec3(20.0, 3.0, 5.0), 0.01, 3),
        shapes::sphere(dvec3(-9.0, 0.5, 30.0), 1e-4, 2),
        shapes::sphere(dvec3(-30.0, 10.0, -20.0), 8.0, 4),
        needles,
    ]);
    let turn = DMat3::from_axis_angle(dvec3(0.6, 0.0, 0.8), 0.7);
    for object in &mut scene.objects {
        for position in &mut object.mesh_in_scene_mut().positions {
            *position = turn * *position + dvec3(3e5, -1e5, 7e5);
        }
    }
    scene
}

/// Fails unless the device's answers are the CPU's but where rounding may decide.
fn compare(scene: Scene, count: usize) {
    let gpu = or_skip!(gpu());
    let judge = Judge::new(Arc::new(scene.clone()));
    let (centre, radius) = judge.bounding_sphere();
    let rays = Numbers::new(count as u64).rays(&scene, (centre, 1.2 * radius), 2, count);
    let parts = rays.chunks(1 << 18);
    let answers = parts.flat_map(|part| probe(gpu, &scene, part).expect("the device holds it"));
    let answers: Vec<Answer> = answers.collect();
    let verdicts = judge.all(&rays, &answers);
    let of = |kind: Verdict| verdicts.iter().filter(|verdict| **verdict == kind).count();
    if let Some(first) = verdicts.iter().position(|verdict| *verdict == Verdict::Wrong) {
        let (name, ray, answer) = (&scene.name, &rays[first], &answers[first]);
        panic!(
            "{name}: {} are wrong, the first: {ray:?}, {answer:?}",
            of(Verdict::Wrong)
        );
    }
    assert!(of(Verdict::Met) > count / 4, "{} hits", of(Verdict::Met));
    // The comparison sees answers of other rays, and distances off by a thousandth.
    let is_wrong = |answers: &[Answer]| {
        let verdicts = judge.all(&rays[..1000], &answers[..1000]);
        verdicts
            .iter()
            .filter(|verdict| **verdict == Verdict::Wrong)
            .count()
    };
    assert!(is_wrong(&answers[1..]) > 250);
    let mut farther = answers.clone();
    for hit in farther.iter_mut().flatten() {
        hit.distance_m *= 1.001;
    }
    assert!(is_wrong(&farther) > 150);
}

#[test]
fn rays_meet_what_they_meet_on_the_cpu() {
    compare(builtin_scene("showroom"), 340_000);
    compare(bumpy_sphere(), 330_000);
    compare(awkward(), 330_000);
}

/// Aimed at edges and corners from inside: single precision leaves no gap between triangles.
#[test]
fn no_ray_leaves_a_closed_surface() {
    let (Some(gpu), scene) = (gpu(), bumpy_sphere()) else {
        return;
    };
    let rays = Numbers::new(9).rays(&scene, (DVec3::ZERO, 0.8), 1, 250_000);
    let hits = probe(gpu, &scene, &rays).expect("the device holds it");
    assert!(hits.iter().all(Option::is_some));
}

type Answer = Option<ProbedHit>;
/// A triangle and the distance to it in local units.
type Met = Option<(usize, f64)>;
type Corners = [DVec3; 3];

/// How far beside the asked ray the answered one may lie, in units in which the scene's radius is 1/2 to 1. With
/// u = 2⁻²⁴, rays that start within 1.2 radii and so at most 2.2 units to go: rounding the origin moves it by u, the
/// corners by u/2, their difference by 2u, and the direction turns by √3·u over 2.2 units; shear, product and
/// difference round to another 8u. Each along both axes of the plane across the ray's main axis: 2⁻¹⁹ = 32u.
const EPSILON: f64 = 1.0 / (1 << 19) as f64;

/// What is said of an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    /// Nothing on both.
    Missed,
    /// The same triangle.
    Met,
    /// Another triangle that a ray beside the asked one meets.
    Beside,
    /// None of these.
    Wrong,
}

/// Tells right from wrong answers.
struct Judge {
    tracer: Tracer,
    /// Of the first triangle of each object.
    firsts: Vec<usize>,
    /// In local units.
    corners: Vec<Corners>,
    centre: DVec3,
    scale: f64,
}

/// A ray in local units, and what lies across it.
struct Across {
    origin: DVec3,
    direction: DVec3,
    axes: [DVec3; 2],
}

impl Across {
    fn flat(&self, corners: &Corners) -> [DVec2; 3] {
        let flat = |off: DVec3| dvec2(off.dot(self.axes[0]), off.dot(self.axes[1]));
        corners.map(|corner| flat(corner - self.origin))
    }

    /// From the ray to a triangle; 0 where it goes through.
    fn aside(&self, corners: &Corners) -> f64 {
        let flat = self.flat(corners);
        let sides = [0, 1, 2].map(|i| flat[i].perp_dot(flat[(i + 1) % 3]));
        if sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0) {
            return 0.0;
        }
        let to_edge = |i: usize| {
            let (from, along) = (flat[i], flat[(i + 1) % 3] - flat[i]);
            let share = -from.dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
            (from + along * share.clamp(0.0, 1.0)).length()
        };
        to_edge(0).min(to_edge(1)).min(to_edge(2))
    }

    /// Where along the ray a triangle begins and ends.
    fn reach(&self, corners: &Corners) -> (f64, f64) {
        let [a, b, c] = corners.map(|corner| (corner - self.origin).dot(self.direction));
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Bound of the error of the distance to a triangle: every corner, and with it every share, moves by EPSILON.
    fn distance_bound(&self, corners: &Corners) -> f64 {
        let (low, high) = self.reach(corners);
        let [a, b, c] = self.flat(corners);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let narrow = (b - a).perp_dot(c - a).abs() / longest.max(f64::MIN_POSITIVE);
        EPSILON + (high - low) * (3.0 * EPSILON / narrow.max(f64::MIN_POSITIVE)).min(1.0)
    }
}

impl Judge {
    fn new(scene: Arc<Scene>) -> Self {
        let tracer = Tracer::new(scene.clone());
        let (centre, scale) = (tracer.frame().centre, tracer.frame().scale);
        let (mut firsts, mut corners) = (Vec::new(), Vec::new());
        for object in &scene.objects {
            firsts.push(corners.len());
            let mesh = object.mesh_in_scene();
            let local = |triangle| mesh.corners(triangle).map(|corner| (corner - centre) * scale);
            corners.extend((0..mesh.triangles.len()).map(local));
        }
        Self {
            tracer,
            firsts,
            corners,
            centre,
            scale,
        }
    }

    fn bounding_sphere(&self) -> (DVec3, f64) {
        let (low, high) = self.tracer.scene().bounds().expect("it has triangles");
        let centre = low * 0.5 + high * 0.5;
        (centre, (high - centre).length())
    }

    fn all(&self, rays: &[Ray], answers: &[Answer]) -> Vec<Verdict> {
        assert_eq!(rays.len(), answers.len());
        let pairs = rays.par_iter().zip(answers);
        pairs.map(|(ray, answer)| self.verdict(ray, answer)).collect()
    }

    /// The CPU's answer.
    fn exact(&self, ray: &Ray) -> Met {
        let hit = self.tracer.intersect(ray)?;
        let triangle = self.firsts[hit.object as usize] + hit.triangle as usize;
        Some((triangle, hit.distance_m * self.scale))
    }

    fn verdict(&self, ray: &Ray, answer: &Answer) -> Verdict {
        let x = ray.direction.any_orthonormal_vector();
        let across = Across {
            origin: (ray.origin - self.centre) * self.scale,
            direction: ray.direction,
            axes: [x, ray.direction.cross(x)],
        };
        let exact = self.exact(ray);
        let found = answer.map(|hit| (hit.triangle as usize, hit.distance_m * self.scale));
        let is_right = match (exact, found) {
            (None, None) => return Verdict::Missed,
            (Some((a, exact)), Some((b, found))) if a == b => {
                let is_near = (found - exact).abs() <= across.distance_bound(&self.corners[a]);
                return if is_near { Verdict::Met } else { Verdict::Wrong };
            }
            _ => self.is_shared(&across, exact, found) || self.is_beside(ray, &across, exact, found),
        };
        if is_right { Verdict::Beside } else { Verdict::Wrong }
    }

    /// Another triangle at the same distance, the ray passing both.
    fn is_shared(&self, across: &Across, exact: Met, found: Met) -> bool {
        let (Some((a, exact)), Some((b, found))) = (exact, found) else {
            return false;
        };
        let (a, b) = (&self.corners[a], &self.corners[b]);
        let bound = across.distance_bound(a) + across.distance_bound(b);
        across.aside(a).max(across.aside(b)) <= EPSILON && (exact - found).abs() <= bound
    }

    /// One of the answers is of a triangle that the other one went past.
    fn is_beside(&self, ray: &Ray, across: &Across, exact: Met, found: Met) -> bool {
        let reached = |met: Met| met.map_or(f64::INFINITY, |met| met.1);
        if let Some((triangle, distance)) = found
            && distance < reached(exact)
        {
            // The CPU sees past it: without a gap, for it leaves none.
            let corners = &self.corners[triangle];
            let (low, high) = across.reach(corners);
            let is_at = (low - EPSILON..=high + EPSILON).contains(&distance);
            return across.aside(corners) <= EPSILON && is_at;
        }
        let Some((passed, _)) = exact else {
            return false;
        };
        // The device went past it: so must a ray beside this one on the CPU, and meet what the device met.
        let is_like = |beside: Met, passed: f64| match (beside, found) {
            (None, None) => true,
            (Some((a, _)), Some((b, _))) if a == b => true,
            (Some((_, at)), Some((b, distance))) => {
                (passed + at - distance).abs() <= across.distance_bound(&self.corners[b])
            }
            _ => false,
        };
        let rings = [(16, 0.05), (64, 0.2), (256, 0.5), (512, 1.0)];
        let mut offsets = rings.into_iter().flat_map(|(steps, share)| {
            let turn = TAU / f64::from(steps);
            (0..steps).map(move |step| DVec2::from_angle(turn * f64::from(step)) * share * EPSILON)
        });
        let sees_as_the_device = |offset: DVec2| {
            let moved = (across.axes[0] * offset.x + across.axes[1] * offset.y) / self.scale;
            let origin = ray.origin + moved;
            is_like(self.exact(&Ray { origin, ..*ray }), 0.0)
        };
        if offsets.any(sees_as_the_device) {
            return true;
        }
        // Around the origin it may have been behind: then the device met what comes next.
        let Some(hit) = self.tracer.closest_hit(ray) else {
            return false;
        };
        let corners = &self.corners[passed];
        let distance = hit.distance_m * self.scale;
        let is_around = distance <= across.distance_bound(corners) && across.reach(corners).0 <= EPSILON;
        is_around && is_like(self.exact(&hit.spawn(ray.direction)), distance)
    }
}

fn coloured(colour: [f64; 3], lamp: Light) -> Light {
    Light {
        colour: colour.into(),
        ..lamp
    }
}

/// One lamp of each kind, each of a colour of its own.
fn lamps() -> [Light; 3] {
    let place = dvec3(0.8, 0.7, 0.4);
    [
        coloured([1.0, 0.2, 0.1], point_light(dvec3(0.1, 0.9, 0.2), 2.0)),
        coloured(
            [0.1, 1.0, 0.3],
            spot(place, dvec3(-0.3, -1.0, 0.1), 3.0, [0.2, 0.5]),
        ),
        coloured([0.2, 0.3, 1.0], sun(dvec3(0.4, -1.0, -0.3), 2.0)),
    ]
}

/// A floor with a matte box, a glass ball that casts a shadow, and a mirror behind them.
fn scene(lights: Vec<Light>) -> Scene {
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.8)));
    let cuboid = shapes::cuboid(dvec3(0.3, 0.0, 0.5), dvec3(0.5, 0.2, 0.7));
    let grey = parts::matte("box", LinearSrgb::grey(0.5));
    parts::add(&mut scene, "box", cuboid, grey);
    let ball = shapes::sphere(dvec3(0.7, 0.15, 0.7), 0.1, 3);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let mirror = shapes::cuboid(dvec3(0.0, 0.0, -0.1), dvec3(1.0, 0.6, -0.05));
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    scene.lights = lights;
    scene
}

fn ahead() -> View {
    view(dvec3(0.45, 0.7, 1.7), dvec3(0.5, 0.1, 0.3), 0.8, [150, 100])
}

fn by_layer(scene: &Scene) -> Picture {
    let settings = set(to(0.05, 512), |s| s.layers = vec![LayerKind::Direct]);
    let maps = bake(scene.clone(), &settings).maps;
    let mut rig = Rig::at(AS_CPU, scene, &maps).expect("there is a device");
    rig.picture(&ahead())
}

/// A renderer that traces lamps.
fn tracing(scene: &Scene) -> Option<Rig<'static>> {
    let mut rig = Rig::at(AS_CPU, scene, &[])?;
    rig.renderer.set_traces_lights(true);
    Some(rig)
}

/// Fails unless shadow rays show what the baked layer shows, which is returned.
#[track_caller]
fn assert_traced(rig: &mut Rig) -> Picture {
    let (found, expected) = (rig.picture(&ahead()), by_layer(&rig.scene));
    let off = unlike(&expected, &found);
    assert!(off < 0.02, "{:?} {off}", rig.scene.lights[0].kind);
    expected
}

#[test]
fn shadow_rays_show_the_baked_layer() {
    let all = lamps();
    for lights in all.iter().map(|lamp| vec![lamp.clone()]).chain([all.to_vec()]) {
        let mut scene = scene(lights);
        let mut rig = or_skip!(tracing(&scene));
        let before = assert_traced(&mut rig);
        // The comparison sees that a lamp has moved.
        for light in &mut scene.lights {
            light.kind = light.kind.moved(dvec3(0.1, 0.0, 0.0));
            if let LightKind::Sun { direction, .. } = &mut light.kind {
                *direction = DVec3::NEG_Y;
            }
        }
        rig.set_scene(&scene);
        assert!(unlike(&before, &assert_traced(&mut rig)) > 0.1);
    }
}

#[test]
fn moved_object_takes_its_shadow_along() {
    let mut scene = scene(lamps().to_vec());
    let mut rig = or_skip!(tracing(&scene));
    let before = rig.picture(&ahead());
    let mesh = scene.objects[1].mesh_in_scene_mut();
    mesh.positions.iter_mut().for_each(|corner| corner.x -= 0.2);
    rig.set_scene(&scene);
    assert!(unlike(&before, &assert_traced(&mut rig)) > 0.02);
}

/// Under water, which takes its share on the way.
#[test]
fn water_weakens_shadow_rays_as_the_layer() {
    let [point, ..] = lamps();
    let mut scene = floor_scene(diffuse(LinearSrgb::grey(0.8)));
    let water = parts::dielectric("water", 1.33);
    let water = tinted(water, 0.5, rgb(0.3, 0.7, 0.9));
    let body = shapes::cuboid(dvec3(-1.0, -0.5, -1.0), dvec3(2.0, 1.2, 2.5));
    parts::add(&mut scene, "water", body, water);
    scene.lights = vec![point];
    let mut rig = or_skip!(tracing(&scene));
    let expected = assert_traced(&mut rig);
    // The comparison sees what the water takes.
    scene.materials[1].volume = None;
    assert!(unlike(&expected, &by_layer(&scene)) > 0.1);
}

/// While hands move, each pixel of a picture aims at one point of a lamp, and the mean of pictures at all of it. Panels
/// that shine from their middles, a quarter as wide as they are far away, are 2 % too bright.
#[test]
fn soft_lamps_keep_their_size() {
    // Means over blocks of pixels, which leave little of the grain.
    let sampled = |rig: &mut Rig| blocks(&rig.sampled(&ahead(), 4), 10);
    for lamp in lamps_of_all_kinds(dvec3(0.3, 0.8, 0.4)) {
        let scene = scene(vec![wide(&lamp, 2.0)]);
        let found = sampled(&mut or_skip!(tracing(&scene)));
        let settings = set(to(0.05, 512), |s| s.layers = vec![LayerKind::Direct]);
        let maps = bake(scene.clone(), &settings).maps;
        let expected = sampled(&mut Rig::at(AS_CPU, &scene, &maps).expect("there is a device"));
        let off = apart(&found, &expected);
        // The comparison sees another size.
        let narrow = sampled(&mut tracing(&self::scene(vec![wide(&lamp, 0.1)])).expect("there is a device"));
        let other = apart(&narrow, &expected);
        assert!(
            off < 0.025 && other > 1.5 * off,
            "{:?}: {off}, {other}",
            lamp.kind
        );
    }
}

/// Sum of all differences relative to that of the second picture.
fn apart(found: &Picture, expected: &Picture) -> f32 {
    let channels = found
        .radiance
        .iter()
        .flatten()
        .zip(expected.radiance.iter().flatten());
    let [off, sum] = channels.fold([0.0; 2], |[off, sum], (a, b)| [off + (a - b).abs(), sum + b]);
    off / sum
}

/// Means over squares of so many pixels a side.
fn blocks(picture: &Picture, side: u32) -> Picture {
    let [width, height] = [picture.width, picture.height].map(|pixels| pixels / side);
    let mut radiance = vec![[0.0; 3]; (width * height) as usize];
    for (pixel, value) in (0..).zip(&picture.radiance) {
        let [column, row] = [pixel % picture.width, pixel / picture.width].map(|place| place / side);
        let mean = &mut radiance[(row * width + column) as usize];
        for channel in 0..3 {
            mean[channel] += value[channel] / (side * side) as f32;
        }
    }
    Picture {
        width,
        height,
        radiance,
    }
}

/// A lamp of the same strength that is so many times as wide.
fn wide(lamp: &Light, times: f64) -> Light {
    let mut lamp = lamp.clone();
    match &mut lamp.size {
        LightSize::None => {}
        LightSize::Radius { radius_m } => *radius_m *= times,
        LightSize::Angle { diameter_rad } => *diameter_rad *= times,
    }
    if let LightKind::Panel {
        across,
        down,
        radiance,
        ..
    } = &mut lamp.kind
    {
        (*across, *down) = (*across * times, *down * times);
        radiance.0 /= times * times;
    }
    lamp
}

/// While hands move, a lamp with a surface is its middle: so small a one is nothing else.
#[test]
fn small_surfaces_are_traced_as_their_middles() {
    let half_m = 1e-3;
    let (centre, colour) = (dvec3(0.3, 0.8, 0.6), [1.0, 0.6, 0.2]);
    let radiance = 0.5 / (4.0 * half_m * half_m);
    let small = |down: DVec3| {
        let sides = [DVec3::X * half_m, down * half_m];
        coloured(colour, panel(centre, sides, PanelShape::Rectangle, radiance))
    };
    // It shines up, on nothing; turned, down.
    let mut up = or_skip!(tracing(&scene(vec![small(DVec3::NEG_Z)])));
    let dark = up.picture(&ahead());
    assert!(dark.radiance.iter().flatten().all(|channel| *channel == 0.0));
    up.set_scene(&scene(vec![small(DVec3::Z)]));
    let expected = assert_traced(&mut up);

    // The same lamp as a surface that glows.
    let glow = LightKind::Surface {
        object: 4,
        radiance: Radiance(radiance),
    };
    let mut glowing = scene(vec![coloured(colour, light(glow))]);
    let patch = shapes::floor([-half_m, half_m], [-half_m, half_m], 0.0);
    let patch = moved(inside_out(patch), DMat3::IDENTITY, centre);
    let mut material = parts::matte("lamp", LinearSrgb::BLACK);
    material.double_sided = false;
    parts::add(&mut glowing, "lamp", patch, material);
    let found = tracing(&glowing).expect("there is a device").picture(&ahead());
    assert!(unlike(&expected, &found) < 0.02, "{}", unlike(&expected, &found));
}

#[test]
fn lamps_cost_nothing_where_not_traced() {
    let mut scene = scene(lamps().to_vec());
    scene.objects.truncate(2);
    let mut rig = or_skip!(Rig::at(AS_CPU, &scene, &[]));
    rig.picture(&ahead());
    let counts = rig.renderer.counts();
    assert_eq!((counts.pipelines, counts.chain_bytes), (1, 0));
    rig.renderer.set_traces_lights(true);
    rig.picture(&ahead());
    assert!(rig.renderer.counts().chain_bytes > 0);
}
