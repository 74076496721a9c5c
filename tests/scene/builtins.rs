//! The built-in scenes are the surfaces that the references were computed on.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use nephroid::optics::Nanometres;
use nephroid::optics::refraction::{reflect, refract};
use nephroid::optics::wavelength::D_LINE;
use nephroid::scene::builtin::{NAMES, build};
use nephroid::scene::{LightKind, Mesh, Object, Scene, SurfaceKind};

use crate::support::assert_close;

fn scene(name: &str) -> Scene {
    build(name).unwrap_or_else(|| panic!("there is no built-in `{name}`"))
}

fn object<'a>(scene: &'a Scene, name: &str) -> &'a Object {
    let found = scene.objects.iter().find(|object| object.name == name);
    found.unwrap_or_else(|| panic!("{} has no `{name}`", scene.name))
}

/// Directed edges whose twin is missing: 0 for a closed body of consistent winding. Vertices count as one where their
/// positions are equal bit by bit.
fn open_edges(mesh: &Mesh) -> usize {
    let mut ids = HashMap::new();
    let welded: Vec<usize> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = ids.len();
            *ids.entry((p + DVec3::ZERO).to_array().map(f64::to_bits))
                .or_insert(next)
        })
        .collect();
    let mut edges: HashMap<(usize, usize), i64> = HashMap::new();
    for triangle in &mesh.triangles {
        for side in 0..3 {
            let a = welded[triangle[side] as usize];
            let b = welded[triangle[(side + 1) % 3] as usize];
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    edges
        .iter()
        .filter(|((a, b), count)| edges.get(&(*b, *a)) != Some(count))
        .count()
}

fn volume_m3(mesh: &Mesh) -> f64 {
    let six_volumes = (0..mesh.triangles.len()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        a.dot(b.cross(c))
    });
    six_volumes.sum::<f64>() / 6.0
}

#[test]
fn every_name_builds_and_no_other() {
    for name in NAMES {
        let scene = scene(name);
        assert_eq!(scene.name, name);
        assert_eq!(scene.source, format!("builtin:{name}"));
        assert!(
            scene
                .objects
                .iter()
                .any(|object| ["floor", "wall"].contains(&object.name.as_str())),
            "{name} has neither floor nor wall"
        );
        assert!(!scene.lights.is_empty() && !scene.cameras.is_empty(), "{name}");
        assert!(
            scene
                .objects
                .iter()
                .enumerate()
                .any(|(index, _)| scene.material_of(index).surface.is_specular())
        );
        assert!(scene.warnings.is_empty());
    }
    assert!(build("Ring").is_none() && build("").is_none());
}

#[test]
fn meshes_are_sound() {
    for name in NAMES {
        for Object { name: part, mesh, .. } in &scene(name).objects {
            let at = format!("{name}/{part}");
            assert_eq!(mesh.positions.len(), mesh.normals.len(), "{at}");
            assert!(mesh.positions.iter().all(|p| p.is_finite()), "{at}");
            assert!(
                mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-14),
                "{at}: unit normals"
            );
            assert!(!mesh.triangles.is_empty(), "{at}");
            for triangle in 0..mesh.triangles.len() {
                let face = mesh.face_normal(triangle);
                for normal in mesh.corner_normals(triangle) {
                    assert!(
                        face.dot(normal) > 0.99,
                        "{at}: triangle {triangle} faces away from its normals"
                    );
                }
            }
        }
    }
}

#[test]
fn floors_are_grey_and_carry_the_reference_maps_coordinates() {
    for (name, half) in [
        ("ring", 1.0),
        ("ball", 0.6),
        ("pool", 1.0),
        ("mirror", 1.0),
        ("slab", 1.0),
        ("paraboloid", 0.5),
        ("nephroid", 1.0),
    ] {
        let scene = scene(name);
        let floor = object(&scene, "floor");
        let material = &scene.materials[floor.material];
        assert_eq!(material.surface, SurfaceKind::Diffuse);
        assert_eq!(material.base_colour.to_array(), [0.5; 3]);
        let mesh = &floor.mesh;
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

#[test]
fn ball_and_slab_are_closed_and_have_their_volume() {
    let ball = scene("ball");
    let mesh = &object(&ball, "ball").mesh;
    assert_eq!(open_edges(mesh), 0);
    assert_close(
        volume_m3(mesh),
        4.0 / 3.0 * PI * 0.125,
        1e-12,
        "volume of the ball",
    );
    assert_close(mesh.area_m2(), PI, 3e-5, "area of the ball");
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let from_centre = *position - DVec3::new(0.0, 0.8, 0.0);
        assert_close(from_centre.length(), 0.5, 2e-5, "radius");
        assert!((from_centre.normalize() - *normal).length() < 1e-14);
    }
    let slab = scene("slab");
    let mesh = &object(&slab, "slab").mesh;
    assert_eq!(open_edges(mesh), 0);
    assert_close(volume_m3(mesh), 8.0 * 8.0 * 0.3, 1e-14, "volume of the slab");
    for (name, part) in [("ball", "ball"), ("slab", "slab")] {
        let scene = scene(name);
        let material = &scene.materials[object(&scene, part).material];
        assert_eq!((material.surface, material.ior), (SurfaceKind::Dielectric, 1.5));
        assert!(material.volume.is_some());
    }
}

#[test]
fn the_closedness_check_sees_a_missing_and_a_turned_triangle() {
    let ball = scene("ball");
    let mut mesh = object(&ball, "ball").mesh.as_ref().clone();
    mesh.triangles[17].swap(0, 1);
    assert_ne!(open_edges(&mesh), 0);
    mesh.triangles.remove(17);
    assert_eq!(open_edges(&mesh), 3);
}

#[test]
fn ring_is_a_cylinder_that_faces_inwards() {
    for name in ["ring", "nephroid"] {
        let scene = scene(name);
        let ring = object(&scene, "ring");
        assert_eq!(scene.materials[ring.material].surface, SurfaceKind::Mirror);
        assert_eq!(ring.mesh.triangles.len(), 2048);
        assert_close(ring.mesh.area_m2(), PI, 1e-5, "area 2πRH");
        for (position, normal) in ring.mesh.positions.iter().zip(&ring.mesh.normals) {
            assert!(position.y == 0.0 || position.y == 0.5);
            let outward = DVec3::new(position.x, 0.0, position.z);
            assert!(
                (*normal + outward).length() < 1e-15,
                "normal {normal} at {position}"
            );
        }
        // Both rims, and no seam along the wall.
        assert_eq!(open_edges(&ring.mesh), 2 * 1024);
    }
}

#[test]
fn pool_is_the_wave_surface() {
    let scene = scene("pool");
    let water = object(&scene, "water");
    assert_eq!(water.mesh.triangles.len(), 2 * 512 * 512);
    let material = &scene.materials[water.material];
    assert_eq!((material.surface, material.ior), (SurfaceKind::Dielectric, 1.333));
    let height = |x: f64, z: f64| {
        1.0 + 0.02 * ((9.0 * x + 1.0).cos() + (7.0 * z + 2.0).cos() + (6.0 * x + 5.0 * z).cos())
    };
    let step = 1e-5;
    for (p, normal) in water.mesh.positions.iter().zip(&water.mesh.normals).step_by(97) {
        assert_close(p.y, height(p.x, p.z), 1e-14, "height");
        let slope_x = (height(p.x + step, p.z) - height(p.x - step, p.z)) / (2.0 * step);
        let slope_z = (height(p.x, p.z + step) - height(p.x, p.z - step)) / (2.0 * step);
        let expected = DVec3::new(-slope_x, 1.0, -slope_z).normalize();
        assert!(
            (*normal - expected).length() < 1e-9,
            "{normal} instead of {expected}"
        );
    }
    let (low, high) = water.mesh.bounds().expect("has vertices");
    assert_eq!((low.x, low.z, high.x, high.z), (-1.5, -1.5, 1.5, 1.5));
}

/// Every ray along the axis is reflected through the focus, and the opening is a disc of 0.4 m across the beam.
#[test]
fn paraboloid_gathers_the_sun_in_its_focus() {
    let scene = scene("paraboloid");
    let dish = object(&scene, "paraboloid");
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("paraboloid is lit by a sun");
    };
    let focus = DVec3::new(0.0, -0.5, 0.0);
    for (position, normal) in dish.mesh.positions.iter().zip(&dish.mesh.normals) {
        let reflected = reflect(direction, *normal);
        let miss = (focus - *position).cross(reflected).length();
        assert!(miss < 1e-14, "misses the focus by {miss} m");
        assert!(reflected.dot(focus - *position) > 0.0);
    }
    let across = |triangle: usize| {
        let [a, b, c] = dish.mesh.corners(triangle);
        0.5 * (b - a).cross(c - a).dot(-direction)
    };
    let opening: f64 = (0..dish.mesh.triangles.len()).map(across).sum();
    assert_close(opening, PI * 0.16, 1e-4, "opening across the beam");
}

#[test]
fn plane_mirror_is_turned_fifteen_degrees() {
    let scene = scene("mirror");
    let mesh = &object(&scene, "mirror").mesh;
    assert_close(mesh.area_m2(), 0.6 * 0.5, 1e-14, "area");
    let (low, high) = mesh.bounds().expect("has vertices");
    assert_close(0.5 * (high.x - low.x), 0.077_645_7, 1e-6, "half width in x");
    assert_close(0.5 * (high.z - low.z), 0.289_777_7, 1e-6, "half width in z");
    assert_close(low.y, 0.2, 1e-14, "lower edge");
    assert_close(high.y, 0.7, 1e-14, "upper edge");
}

#[test]
fn lights_have_the_references_power() {
    for (name, position) in [
        ("ring", [-0.7, 1.2, 0.0]),
        ("ball", [0.0, 3.0, 0.0]),
        ("mirror", [-0.1, 1.2, 0.1]),
        ("slab", [0.1, 2.0, -0.05]),
    ] {
        let light = scene(name).lights[0].clone();
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
        let light = scene(name).lights[0].clone();
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

/// Whether a plane surface's TEXCOORD_0 fills the unit square without overlap: area in uv of 1.
#[test]
fn showrooms_receivers_are_plane_with_coordinates_of_their_own() {
    let scene = scene("showroom");
    assert!(scene.triangle_count() < 300_000, "{}", scene.triangle_count());
    for (index, Object { name, mesh, .. }) in scene.objects.iter().enumerate() {
        if scene.material_of(index).surface != SurfaceKind::Diffuse {
            continue;
        }
        let uvs = mesh
            .uv0
            .as_ref()
            .unwrap_or_else(|| panic!("{name} has no TEXCOORD_0"));
        assert!(
            mesh.normals.iter().all(|n| *n == mesh.normals[0]),
            "{name} is not plane"
        );
        let covered: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|vertex| uvs[vertex as usize]);
                0.5 * (b - a).perp_dot(c - a).abs()
            })
            .sum();
        assert_close(covered, 1.0, 1e-14, name);
    }
}

/// At minimum deviation light goes through a prism along its base, in and out at the same angle.
#[test]
fn prism_stands_at_minimum_deviation_for_yellow_light() {
    let scene = scene("prism");
    let prism = object(&scene, "prism");
    assert_eq!(open_edges(&prism.mesh), 0);
    // Equilateral, 6 cm each way.
    let volume = 0.06 * 0.06 * 3.0_f64.sqrt() / 4.0 * 0.06;
    assert_close(volume_m3(&prism.mesh), volume, 1e-12, "volume");
    let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
        panic!("prism is lit by a sun");
    };
    let glass = &scene.materials[prism.material];
    assert!(glass.is_dispersive());
    let deviation = |n: f64| {
        let (first, second) = (
            DVec3::new(-0.75_f64.sqrt(), 0.5, 0.0),
            DVec3::new(0.75_f64.sqrt(), 0.5, 0.0),
        );
        let inside = refract(direction, first, n).expect("it enters");
        let out = refract(inside, -second, 1.0 / n).expect("it leaves");
        (inside, direction.angle_between(out))
    };
    let (inside, yellow) = deviation(glass.index_at(D_LINE));
    assert!((inside - DVec3::X).length() < 1e-12, "{inside}");
    assert_close(
        yellow.to_degrees(),
        2.0 * (0.8175_f64).asin().to_degrees() - 60.0,
        1e-12,
        "deviation",
    );
    // As the solver's table of this scene has it.
    for (nm, degrees) in [(400.0, 51.637_754_065_4), (700.0, 49.182_654_092_7)] {
        let (_, found) = deviation(glass.index_at(Nanometres(nm)));
        assert_close(found.to_degrees(), degrees, 1e-6, "deviation");
    }
}

/// Where a ray meets the wall of `spectrum`.
fn at_wall(origin: DVec3, direction: DVec3) -> DVec3 {
    origin + direction * ((-0.6 - origin.z) / direction.z)
}

/// On the way through a flat face of a mesh, from where it is met.
fn through_face(mesh: &Mesh, origin: DVec3, direction: DVec3, eta: f64) -> (DVec3, DVec3) {
    let ray = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(c - a).normalize();
        let distance = (a - origin).dot(normal) / direction.dot(normal);
        let point = origin + direction * distance;
        let is_inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| (*to - *from).cross(point - *from).dot(normal) >= 0.0);
        (distance > 1e-9 && is_inside).then_some((distance, point, normal))
    };
    let hits = (0..mesh.triangles.len()).filter_map(ray);
    let (_, point, normal) = hits.min_by(|a, b| a.0.total_cmp(&b.0)).expect("it meets a face");
    let facing = if direction.dot(normal) > 0.0 {
        -normal
    } else {
        normal
    };
    (point, refract(direction, facing, eta).expect("it goes through"))
}

/// One reflection within a ball, from where a ray meets it: the way of a rainbow's light.
fn through_ball(centre: DVec3, radius: f64, origin: DVec3, direction: DVec3, n: f64) -> (DVec3, DVec3) {
    let meet = |origin: DVec3, direction: DVec3, first: bool| {
        let to = origin - centre;
        let half = to.dot(direction);
        let root = (half * half - to.length_squared() + radius * radius).sqrt();
        let point = origin + direction * (if first { -half - root } else { -half + root });
        (point, (point - centre).normalize())
    };
    let (point, normal) = meet(origin, direction, true);
    let inside = refract(direction, normal, n).expect("it enters");
    let (point, normal) = meet(point, inside, false);
    let back = reflect(inside, normal);
    let (point, normal) = meet(point, back, false);
    (point, refract(back, -normal, 1.0 / n).expect("it leaves"))
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
fn prism_and_ball_throw_their_spectra_onto_the_wall_in_view() {
    let scene = scene("spectrum");
    let (prism, ball) = (object(&scene, "prism"), object(&scene, "ball"));
    let glass = &scene.materials[prism.material];
    assert_eq!((open_edges(&prism.mesh), open_edges(&ball.mesh)), (0, 0));
    assert_close(
        volume_m3(&prism.mesh),
        0.06 * 0.06 * 0.75_f64.sqrt() / 2.0 * 0.1,
        1e-12,
        "volume",
    );
    let (low, high) = ball.mesh.bounds().expect("has vertices");
    let centre = 0.5 * (low + high);
    let beam = |index: usize| match scene.lights[index].kind {
        LightKind::Spot {
            position, direction, ..
        } => (position, direction),
        other => panic!("{other:?} is no beam"),
    };
    let hits = |nm: f64| {
        let n = glass.index_at(Nanometres(nm));
        let (origin, direction) = beam(0);
        let (entry, inside) = through_face(&prism.mesh, origin, direction, n);
        let (exit, out) = through_face(&prism.mesh, entry, inside, 1.0 / n);
        let (origin, direction) = beam(1);
        let (last, back) = through_ball(centre, 0.06, origin, direction, n);
        [at_wall(exit, out), at_wall(last, back)]
    };
    let [violet, green, red] = [400.0, 550.0, 700.0].map(hits);
    for (index, what, least_m) in [(0, "prism", 0.08), (1, "ball", 0.015)] {
        let places = [violet[index], green[index], red[index]];
        for place in places {
            assert!(
                (0.0..1.0).contains(&place.y) && place.x.abs() < 1.3,
                "{what}: {place} is off the wall"
            );
            assert!(is_in_view(&scene, place), "{what}: {place}");
        }
        let spread = places[0].distance(places[2]);
        assert!(spread > least_m, "{what}: {spread} m from violet to red");
        let share = places[0].distance(places[1]) / spread;
        assert!(
            (0.5..0.9).contains(&share),
            "{what}: green at {share}, nearer to red"
        );
    }
    // Rays beside the middle of the ball's beam leave it alike: a rainbow, not a blur.
    let n = glass.index_at(D_LINE);
    let (origin, direction) = beam(1);
    let way = |aside_m: f64| through_ball(centre, 0.06, origin + DVec3::X * aside_m, direction, n).1;
    assert!(way(0.001).angle_between(way(-0.001)) < 1e-3);
}

#[test]
fn bowl_is_closed_cut_glass_under_daylight() {
    let scene = scene("bowl");
    let bowl = object(&scene, "bowl");
    assert_eq!(open_edges(&bowl.mesh), 0);
    // Between the ellipsoid's half that is missing and the cone frustums around: rather thick.
    let hollow = 2.0 / 3.0 * PI * 0.128 * 0.128 * 0.084;
    let filled = volume_m3(&bowl.mesh) + hollow;
    assert!((0.0033..0.0040).contains(&filled), "{filled} m³");
    let (low, _) = bowl.mesh.bounds().expect("has vertices");
    assert!(low.y > 0.0, "it does not stand in the table");
    let glass = &scene.materials[bowl.material];
    assert!(glass.is_dispersive());
    // F2 by SCHOTT's data sheet.
    assert_close(glass.ior, 1.62004, 1e-5, "index");
    assert!(scene.lights[0].spectrum.is_some());
    assert!(
        is_in_view(&scene, DVec3::new(0.14, 0.1, 0.0)) && is_in_view(&scene, DVec3::new(-0.14, 0.1, 0.0))
    );
}

#[test]
fn what_the_gallery_shows_of_glass_is_solid() {
    let gallery = scene("gallery");
    for solid in ["bowl", "ball", "prism"] {
        let mesh = &object(&gallery, solid).mesh;
        let volume_m3 = volume_m3(mesh);
        assert!(volume_m3 > 1e-4, "{solid}: {volume_m3} m3");
        assert_eq!(open_edges(mesh), 0, "{solid}");
    }
}
