//! The built-in scenes are the surfaces that the references were computed on.

use std::collections::HashMap;

use nephroid::optics::refraction::{reflect, refract};
use nephroid::optics::wavelength::D_LINE;
use nephroid::scene::Object;
use nephroid::scene::builtin::{NAMES, build};
use nephroid::transport::bend;

use super::meshes::volume_m3;
use crate::prelude::*;

fn object<'a>(scene: &'a Scene, name: &str) -> &'a Object {
    let found = scene.objects.iter().find(|object| object.name == name);
    found.unwrap_or_else(|| panic!("{} has no `{name}`", scene.name))
}

/// Directed edges whose twin is missing: 0 for a closed body of consistent winding. Vertices count as one where their
/// positions are equal bit by bit.
fn open_edges(mesh: &Mesh) -> usize {
    let mut ids = HashMap::new();
    let mut weld = |p: &DVec3| {
        let (bits, next) = ((p + DVec3::ZERO).to_array().map(f64::to_bits), ids.len());
        *ids.entry(bits).or_insert(next)
    };
    let welded: Vec<usize> = mesh.positions.iter().map(&mut weld).collect();
    let mut edges: HashMap<(usize, usize), i64> = HashMap::new();
    for triangle in &mesh.triangles {
        for side in 0..3 {
            let [a, b] = [side, (side + 1) % 3].map(|corner| welded[triangle[corner] as usize]);
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    let is_open = |((a, b), count): &(&(usize, usize), &i64)| edges.get(&(*b, *a)) != Some(*count);
    edges.iter().filter(is_open).count()
}

#[test]
fn every_scene_is_whole_and_its_meshes_sound() {
    for name in NAMES {
        let scene = built_in(name);
        assert_eq!(
            (scene.name.as_str(), scene.source.as_str()),
            (name, &*format!("builtin:{name}"))
        );
        assert!(!scene.lights.is_empty() && !scene.cameras.is_empty(), "{name}");
        let mut names = scene.objects.iter().map(|object| object.name.as_str());
        assert!(names.any(|name| ["floor", "wall"].contains(&name)), "{name}");
        let mut kinds = (0..scene.objects.len()).map(|object| scene.material_of(object).surface);
        assert!(kinds.any(SurfaceKind::is_specular), "{name}");
        warns_not(&scene);
        for (index, object) in scene.objects.iter().enumerate() {
            let (part, mesh) = (&object.name, object.mesh_in_scene());
            let at = format!("{name}/{part}");
            // Normals of what waves lift are those of still water.
            let least = if scene.swells.contains_key(&index) {
                0.9
            } else {
                0.99
            };
            assert_eq!(mesh.positions.len(), mesh.normals.len(), "{at}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
            assert!(
                mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-14),
                "{at}"
            );
            assert!(!mesh.triangles.is_empty(), "{at}");
            for triangle in 0..mesh.triangles.len() {
                let face = mesh.face_normal(triangle);
                let agrees = |normal: DVec3| face.dot(normal) > least;
                assert!(
                    mesh.corner_normals(triangle).into_iter().all(agrees),
                    "{at}: {triangle}"
                );
            }
        }
    }
    assert!(build("Ring").is_none() && build("").is_none());
}

#[test]
fn floors_have_map_coordinates() {
    for (name, half) in [
        ("ring", 1.0),
        ("ball", 0.6),
        ("pool", 1.0),
        ("mirror", 1.0),
        ("slab", 1.0),
        ("paraboloid", 0.5),
        ("nephroid", 1.0),
    ] {
        let scene = built_in(name);
        let floor = object(&scene, "floor");
        let material = &scene.materials[floor.material];
        assert_eq!(material.surface, SurfaceKind::Diffuse);
        assert_eq!(material.base_colour.to_array(), [0.5; 3]);
        let mesh = floor.mesh_in_scene();
        assert_close(mesh.area_m2(), 4.0 * half * half, 1e-15, name);
        assert!(mesh.normals.iter().all(|n| *n == DVec3::Y));
        let uvs = mesh.uv0.as_ref().expect("floor has TEXCOORD_0");
        for (position, uv) in mesh.positions.iter().zip(uvs) {
            assert_eq!(position.y, 0.0);
            assert_close(position.x, half * (2.0 * uv.x - 1.0), 1e-15, "u runs along x");
            assert_close(position.z, half * (2.0 * uv.y - 1.0), 1e-15, "v runs along z");
        }
    }
}

/// Solids are closed and have their volume [m³]. That their light lands where it should is held by the references.
#[test]
fn solids_are_closed() {
    // Cone frustums around half an ellipsoid that is missing.
    let bowl_m3 = 0.00365 - 2.0 / 3.0 * PI * 0.128 * 0.128 * 0.084;
    let prism_m3 = |height_m: f64| 0.06 * 0.06 * 0.75_f64.sqrt() / 2.0 * height_m;
    for (name, part, expected_m3, tolerance) in [
        ("ball", "ball", 4.0 / 3.0 * PI * 0.125, 1e-12),
        ("slab", "slab", 8.0 * 8.0 * 0.3, 1e-14),
        ("prism", "prism", prism_m3(0.06), 1e-12),
        ("spectrum", "prism", prism_m3(0.1), 1e-12),
        ("spectrum", "ball", 4.0 / 3.0 * PI * 0.06_f64.powi(3), 0.01),
        ("bowl", "bowl", bowl_m3, 0.5),
    ] {
        let scene = built_in(name);
        let mesh = object(&scene, part).mesh_in_scene();
        assert_eq!(open_edges(mesh), 0, "{name}/{part}");
        assert_close(volume_m3(mesh), expected_m3, tolerance, name);
    }
    let gallery = built_in("gallery");
    for solid in ["wine glass", "wine", "tumbler", "prism", "block"] {
        let mesh = object(&gallery, solid).mesh_in_scene();
        assert_eq!(open_edges(mesh), 0, "{solid}");
        assert!(volume_m3(mesh) > 5e-5, "{solid}");
    }
    let mut cut = object(&built_in("ball"), "ball").mesh_in_scene().as_ref().clone();
    cut.triangles[17].swap(0, 1);
    assert_ne!(open_edges(&cut), 0, "a turned triangle is seen");
    cut.triangles.remove(17);
    assert_eq!(open_edges(&cut), 3, "a missing one too");
}

/// A ring faces inwards; the pool has its waves; a paraboloid sends a sun's light to its focus.
#[test]
fn shapes_are_those_of_the_references() {
    for name in ["ring", "nephroid"] {
        let scene = built_in(name);
        let ring = object(&scene, "ring").mesh_in_scene();
        for (position, normal) in ring.positions.iter().zip(&ring.normals) {
            near(*normal, -position.with_y(0.0), 1e-15, position);
        }
        assert_eq!(open_edges(ring), 2 * 1024, "both rims, no seam along the wall");
    }
}

#[test]
fn pool_has_its_waves() {
    let scene = built_in("pool");
    let water = object(&scene, "water");
    let waves = scene.materials[water.material]
        .waves
        .as_ref()
        .expect("it has waves");
    let water = water.mesh_in_scene();
    let height = |x: f64, z: f64| {
        1.0 + 0.02 * ((9.0 * x + 1.0).cos() + (7.0 * z + 2.0).cos() + (6.0 * x + 5.0 * z).cos())
    };
    let step = 1e-5;
    for (p, normal) in water.positions.iter().zip(&water.normals).step_by(97) {
        let bent = bend::bent(*normal, waves.gradient(*p));
        assert_close(p.y, height(p.x, p.z), 1e-14, "height");
        let slope_x = (height(p.x + step, p.z) - height(p.x - step, p.z)) / (2.0 * step);
        let slope_z = (height(p.x, p.z + step) - height(p.x, p.z - step)) / (2.0 * step);
        let expected = DVec3::new(-slope_x, 1.0, -slope_z).normalize();
        assert!(bent.distance(expected) < 1e-9, "{bent} instead of {expected}");
    }
    let scene = built_in("paraboloid");
    let dish = object(&scene, "paraboloid").mesh_in_scene();
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("paraboloid is lit by a sun");
    };
    for (position, normal) in dish.positions.iter().zip(&dish.normals) {
        let (reflected, to_focus) = (reflect(direction, *normal), DVec3::Y * -0.5 - *position);
        near(to_focus.cross(reflected), DVec3::ZERO, 1e-14, position);
        assert!(reflected.dot(to_focus) > 0.0);
    }
    let across = |triangle: usize| {
        let [a, b, c] = dish.corners(triangle);
        0.5 * (b - a).cross(c - a).dot(-direction)
    };
    let opening_m2: f64 = (0..dish.triangles.len()).map(across).sum();
    assert_close(opening_m2, PI * 0.16, 1e-4, "opening across the beam");
}

/// A plane surface's TEXCOORD_0 fills the unit square without overlap: area in uv of 1.
#[test]
fn showroom_has_its_own_coordinates() {
    let scene = built_in("showroom");
    assert!(scene.triangle_count() < 300_000, "{}", scene.triangle_count());
    for (index, object) in scene.objects.iter().enumerate() {
        let (name, mesh) = (&object.name, object.mesh_in_scene());
        if scene.material_of(index).surface != SurfaceKind::Diffuse {
            continue;
        }
        let uvs = mesh.uv0.as_ref().expect("it has TEXCOORD_0");
        let is_plane = mesh.normals.iter().all(|n| *n == mesh.normals[0]);
        assert!(is_plane, "{name} is not plane");
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| uvs[vertex as usize]);
            0.5 * (b - a).perp_dot(c - a).abs()
        };
        assert_close(mesh.triangles.iter().map(area).sum(), 1.0, 1e-14, name);
    }
}

/// At minimum deviation light goes through a prism along its base, in and out at the same angle.
#[test]
fn prism_has_minimum_deviation() {
    let scene = built_in("prism");
    let prism = object(&scene, "prism");
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("prism is lit by a sun");
    };
    let glass = &scene.materials[prism.material];
    assert!(glass.is_dispersive());
    let deviation = |n: f64| {
        let [first, second] = [-1.0, 1.0].map(|side| dvec3(side * 0.75_f64.sqrt(), 0.5, 0.0));
        let inside = refract(direction, first, n).expect("it enters");
        let out = refract(inside, -second, 1.0 / n).expect("it leaves");
        (inside, direction.angle_between(out))
    };
    let (inside, yellow) = deviation(glass.index_at(D_LINE));
    near(inside, DVec3::X, 1e-12, "along the base");
    let expected = 2.0 * 0.8175_f64.asin().to_degrees() - 60.0;
    assert_close(yellow.to_degrees(), expected, 1e-12, "deviation");
    // As the solver's table of this scene has it.
    for (nm, degrees) in [(400.0, 51.637_754_065_4), (700.0, 49.182_654_092_7)] {
        let (_, found) = deviation(glass.index_at(Nanometres(nm)));
        assert_close(found.to_degrees(), degrees, 1e-6, "deviation");
    }
}

/// A ray of one wavelength behind a solid that it enters and leaves, after reflections within.
fn behind(tracer: &Tracer, mut ray: Ray, reflections: usize) -> Ray {
    let mut media = MediumStack::default();
    for step in 0..reflections + 2 {
        let hit = tracer.closest_hit(&ray).expect("it meets the solid");
        let met = tracer.interact(&hit, ray.direction, &media);
        let is_reflected = (1..=reflections).contains(&step);
        let branch = if is_reflected {
            met.reflection
        } else {
            met.transmission
        };
        let branch = branch.expect("light goes on");
        (ray, media) = (branch.ray, branch.media);
    }
    ray
}

/// Whether a point is in the picture of the scene's first camera, 3 wide and 2 high.
fn is_in_view(scene: &Scene, point: DVec3) -> bool {
    let camera = &scene.cameras[0];
    let to = point - camera.position;
    let (depth, half) = (to.dot(camera.forward), (0.5 * camera.vertical_fov_rad).tan());
    let (x, y) = (to.dot(camera.right()) / depth, to.dot(camera.up) / depth);
    depth > 0.0 && y.abs() < half && x.abs() < 1.5 * half
}

#[test]
fn spectra_fall_on_the_wall_in_view() {
    let tracer = Tracer::new(Arc::new(built_in("spectrum")));
    let scene = tracer.scene();
    let beam = |index: usize| match scene.lights[index].kind {
        LightKind::Spot {
            position: origin,
            direction,
            ..
        } => Ray { origin, direction },
        other => panic!("{other:?} is no beam"),
    };
    for (index, what, reflections, least_m) in [(0, "prism", 0, 0.08), (1, "ball", 1, 0.015)] {
        let places = [400.0, 550.0, 700.0].map(|nm| {
            let at = tracer.at_wavelength(Nanometres(nm));
            let out = behind(&at, beam(index), reflections);
            let hit = at.closest_hit(&out).expect("the wall");
            assert_eq!(scene.objects[hit.object].name, "wall", "{what}");
            assert!(is_in_view(scene, hit.point), "{what}: {}", hit.point);
            hit.point
        });
        let spread = places[0].distance(places[2]);
        assert!(spread > least_m, "{what}: {spread} m from violet to red");
        let share = places[0].distance(places[1]) / spread;
        assert!(
            (0.5..0.9).contains(&share),
            "{what}: green at {share}, nearer to red"
        );
    }
    // Rays beside the middle of the ball's beam leave it alike: a rainbow, not a blur.
    let at = tracer.at_wavelength(D_LINE);
    let way = |aside_m: f64| {
        let mut ray = beam(1);
        ray.origin.x += aside_m;
        behind(&at, ray, 1).direction
    };
    assert!(way(0.001).angle_between(way(-0.001)) < 1e-3);
}

#[test]
fn bowl_stands_in_daylight() {
    let scene = built_in("bowl");
    let bowl = object(&scene, "bowl");
    // Between the half of an ellipsoid that is missing and the cone frustums around: rather thick.
    let filled_m3 = volume_m3(bowl.mesh_in_scene()) + 2.0 / 3.0 * PI * 0.128 * 0.128 * 0.084;
    assert!((0.0033..0.0040).contains(&filled_m3), "{filled_m3} m³");
    let (low, _) = bowl.mesh_in_scene().bounds().expect("has vertices");
    assert!(low.y > 0.0, "it does not stand in the table");
    let glass = &scene.materials[bowl.material];
    assert!(glass.is_dispersive());
    // F2 by SCHOTT's data sheet.
    assert_close(glass.ior, 1.62004, 1e-5, "index");
    assert!(scene.lights[0].spectrum.is_some());
    assert!(
        [0.14, -0.14]
            .iter()
            .all(|x| is_in_view(&scene, DVec3::new(*x, 0.1, 0.0)))
    );
}

/// What the references were computed with, to more digits than their maps can show.
#[test]
fn casters_are_those_of_the_references() {
    for (name, part, surface, ior, triangles, area_m2, tolerance) in [
        ("ring", "ring", SurfaceKind::Mirror, None, 2048, PI, 1e-5),
        ("nephroid", "ring", SurfaceKind::Mirror, None, 2048, PI, 1e-5),
        ("ball", "ball", SurfaceKind::Dielectric, Some(1.5), 0, PI, 3e-5),
        (
            "slab",
            "slab",
            SurfaceKind::Dielectric,
            Some(1.5),
            0,
            2.0 * (64.0 + 2.0 * 2.4),
            1e-14,
        ),
        (
            "pool",
            "water",
            SurfaceKind::Dielectric,
            Some(1.333),
            2 * 149 * 149,
            0.0,
            0.0,
        ),
        ("mirror", "mirror", SurfaceKind::Mirror, None, 0, 0.6 * 0.5, 1e-14),
    ] {
        let scene = built_in(name);
        let object = object(&scene, part);
        let mesh = object.mesh_in_scene();
        let material = &scene.materials[object.material];
        assert_eq!(material.surface, surface, "{name}");
        assert!(ior.is_none_or(|ior| material.ior == ior), "{name}");
        assert!(triangles == 0 || mesh.triangles.len() == triangles, "{name}");
        assert!(
            area_m2 == 0.0 || (mesh.area_m2() / area_m2 - 1.0).abs() < tolerance,
            "{name}: area"
        );
    }
    for name in ["ball", "slab"] {
        let scene = built_in(name);
        assert!(
            scene.materials[object(&scene, name).material].volume.is_some(),
            "{name}"
        );
    }
    let bounds = |name: &str, part: &str| {
        object(&built_in(name), part)
            .mesh_in_scene()
            .bounds()
            .expect("has vertices")
    };
    let (low, high) = bounds("ring", "ring");
    assert_eq!((low.y, high.y), (0.0, 0.5));
    let (low, high) = bounds("pool", "water");
    assert_eq!((low.x, low.z, high.x, high.z), (-1.5, -1.5, 1.5, 1.5));
    let (low, high) = bounds("mirror", "mirror");
    // Turned by fifteen degrees.
    assert_close(0.5 * (high.x - low.x), 0.077_645_7, 1e-6, "half width in x");
    assert_close(0.5 * (high.z - low.z), 0.289_777_7, 1e-6, "half width in z");
    assert_close(low.y, 0.2, 1e-14, "lower edge");
    assert_close(high.y, 0.7, 1e-14, "upper edge");
    let ball = built_in("ball");
    let mesh = object(&ball, "ball").mesh_in_scene();
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let from_centre = *position - DVec3::new(0.0, 0.8, 0.0);
        assert_close(from_centre.length(), 0.5, 2e-5, "radius");
        assert!((from_centre.normalize() - *normal).length() < 1e-14);
    }
}

#[test]
fn lights_have_the_references_power() {
    for (name, position) in [
        ("ring", [-0.7, 1.2, 0.0]),
        ("ball", [0.0, 3.0, 0.0]),
        ("mirror", [-0.1, 1.2, 0.1]),
        ("slab", [0.1, 2.0, -0.05]),
    ] {
        let light = built_in(name).lights[0].clone();
        let LightKind::Point {
            position: at,
            intensity,
        } = light.kind
        else {
            panic!("{name} is lit by a point light");
        };
        assert_eq!(at.to_array(), position);
        assert_close(
            intensity.0 * 4.0 * PI * light.colour.luminance(),
            100.0,
            1e-12,
            name,
        );
    }
    for (name, along) in [
        ("pool", DVec3::new(0.3, -1.0, 0.2)),
        ("paraboloid", DVec3::new(0.8, -0.6, 0.0)),
        (
            "nephroid",
            DVec3::new(0.939_692_620_785_908_4, -0.342_020_143_325_668_7, 0.0),
        ),
    ] {
        let light = built_in(name).lights[0].clone();
        let LightKind::Sun {
            direction,
            normal_irradiance,
        } = light.kind
        else {
            panic!("{name} is lit by a sun");
        };
        assert!(
            (direction - along.normalize()).length() < 1e-15,
            "{name}: {direction}"
        );
        assert_close(normal_irradiance.0 * light.colour.luminance(), 1.0, 1e-12, name);
    }
}
