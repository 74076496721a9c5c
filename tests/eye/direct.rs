//! Direct light against closed forms.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use nephroid::illumination::Side;
use nephroid::light_pass::direct::bake_direct;
use nephroid::optics::LinearSrgb;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::progress::Control;
use nephroid::scene::{LightKind, Material, Mesh, SurfaceKind, Volume};
use nephroid::units::RadiantIntensity;

use crate::meshes::{cuboid, floor, joined, moved, quad};
use crate::scenes::{chart, diffuse, direct, flux_w, light, point_light, sun, surface, tracer};

/// Mean of I h/r³ over a texel of the floor |x|, |z| ≤ 1, y = 0, under a point light: by its exact integral, as the
/// solid angle of the texel seen from the light.
fn exact_point_mean(light: DVec3, intensity: f64, low: [f64; 2], side: f64) -> f64 {
    let corner = |x: f64, z: f64| {
        let (x, z, h) = (x - light.x, z - light.z, light.y);
        (x * z).atan2(h * (x * x + z * z + h * h).sqrt())
    };
    let solid_angle =
        corner(low[0] + side, low[1] + side) - corner(low[0], low[1] + side) - corner(low[0] + side, low[1])
            + corner(low[0], low[1]);
    intensity * solid_angle / (side * side)
}

#[test]
fn a_point_light_on_a_floor_follows_its_closed_form() {
    let lamp = DVec3::new(0.3, 0.8, -0.2);
    let tracer = tracer(
        vec![(floor(1.0, 0.0), diffuse(0.5))],
        vec![point_light(lamp, 2.0)],
    );
    let n = 64;
    let chart = chart(&tracer, 0, n, n);
    let layer = direct(&tracer, &chart);
    let side = 2.0 / n as f64;
    for (texel, e) in layer.irradiance.iter().enumerate() {
        let low = [(texel % n) as f64 * side - 1.0, (texel / n) as f64 * side - 1.0];
        let exact = exact_point_mean(lamp, 2.0, low, side);
        assert!(
            (f64::from(e[0]) / exact - 1.0).abs() < 2e-4,
            "texel {texel}: {} for {exact}",
            e[0]
        );
        assert_eq!(e[0], e[2], "a white light is white");
    }
    assert_eq!(
        layer.shadow_rays,
        4 * (n * n) as u64,
        "no texel needed a second look"
    );
}

/// Rays along the floor, far off and tiny scenes: a surface never shadows itself.
#[test]
fn no_surface_shadows_itself() {
    let tilt = DMat3::from_axis_angle(DVec3::new(0.3, 0.2, 1.0).normalize(), 0.7);
    for (scale, offset) in [
        (1.0, DVec3::ZERO),
        (1e-4, DVec3::ZERO),
        (1.0, DVec3::new(1234.5, -777.7, 4321.0)),
        (1e4, DVec3::new(1e5, 1e5, 0.0)),
    ] {
        for height in [1.0, 1e-3] {
            let mesh = moved(floor(scale, 0.0), tilt, offset);
            let lamp = tilt * DVec3::new(0.31 * scale, height * scale, 0.17 * scale) + offset;
            let tracer = tracer(vec![(mesh, diffuse(0.5))], vec![point_light(lamp, 1.0)]);
            let chart = chart(&tracer, 0, 33, 33);
            let layer = direct(&tracer, &chart);
            assert_eq!(
                layer.shadow_rays,
                4 * 33 * 33,
                "scale {scale}, height {height}: some ray was stopped"
            );
            assert!(layer.irradiance.iter().all(|e| e[0] > 0.0));
        }
    }
}

#[test]
fn a_sun_gives_its_irradiance_times_the_cosine() {
    let direction = DVec3::new(1.0, -2.0, 0.5);
    let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![sun(direction, 700.0)]);
    let chart = chart(&tracer, 0, 8, 8);
    let expected = 700.0 * 2.0 / direction.length();
    for e in direct(&tracer, &chart).irradiance {
        assert!((f64::from(e[1]) / expected - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_spot_lights_its_cone() {
    let cone = LightKind::Spot {
        position: DVec3::Y,
        direction: DVec3::NEG_Y,
        intensity: RadiantIntensity(3.0),
        inner_cone_rad: 0.2,
        outer_cone_rad: 0.5,
    };
    let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![light(cone)]);
    let n = 101;
    let chart = chart(&tracer, 0, n, n);
    let layer = direct(&tracer, &chart);
    let at = |x: f64, z: f64| {
        let r2 = 1.0 + x * x + z * z;
        let cosine = 1.0 / r2.sqrt();
        let ramp = ((cosine - 0.5f64.cos()) / (0.2f64.cos() - 0.5f64.cos())).clamp(0.0, 1.0);
        3.0 * ramp * ramp * cosine / r2
    };
    let fine = 16;
    let place =
        |index: usize, step: usize| ((index * fine + step) as f64 + 0.5) * 2.0 / (n * fine) as f64 - 1.0;
    // At the inner cone the slope jumps from 0 to −2 E sin θ cos²θ/(cos θi − cos θo); two samples across a texel see
    // a jump of slope wrongly by a sixteenth of it times the texel's width at most.
    let slope = 2.0 * 3.0 * 0.2f64.sin() / (0.2f64.cos() - 0.5f64.cos());
    let kink = slope * (2.0 / n as f64) / 16.0;
    let (mut lit, mut dark) = (0, 0);
    for (texel, e) in layer.irradiance.iter().enumerate() {
        let mean = (0..fine * fine)
            .map(|step| at(place(texel % n, step % fine), place(texel / n, step / fine)))
            .sum::<f64>()
            / (fine * fine) as f64;
        assert!(
            (f64::from(e[0]) - mean).abs() < kink,
            "texel {texel}: {} for {mean}",
            e[0]
        );
        if mean == 0.0 {
            assert_eq!(e[0], 0.0, "texel {texel}: light outside the cone");
            dark += 1;
        } else {
            lit += 1;
        }
    }
    assert!(
        lit > 2000 && dark > 7000,
        "{lit} texels in the cone, {dark} outside"
    );
}

/// All of a lamp's light lands on the closed box around it, on the side of its walls that faces the lamp.
#[test]
fn a_closed_box_takes_the_whole_flux() {
    let walls = cuboid(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
    let mut inward = walls.clone();
    for triangle in &mut inward.triangles {
        triangle.swap(1, 2);
    }
    for normal in &mut inward.normals {
        *normal = -*normal;
    }
    for (name, mesh, front) in [("inwards", inward, 1.0), ("outwards", walls, 0.0)] {
        let tracer = tracer(
            vec![(mesh, diffuse(0.5))],
            vec![point_light(DVec3::new(0.4, 0.9, 0.7), 5.0)],
        );
        let expected = 4.0 * PI * 5.0;
        for (side, share) in [(Side::Front, front), (Side::Back, 1.0 - front)] {
            let chart = chart(&tracer, 0, 256, 256).of_side(side);
            let flux = flux_w(&chart, &direct(&tracer, &chart));
            assert!(
                (flux - share * expected).abs() <= 5e-4 * share * expected,
                "{name}, {side:?}: {flux} of {expected}"
            );
        }
    }
}

/// A lamp over a floor with a square plate half-way: the shadow is the plate at twice its size.
fn shadow_of(plate: Material) -> (f64, Vec<[f32; 3]>) {
    let lamp = DVec3::new(0.0, 2.0, 0.0);
    let half = 0.173;
    let tracer = tracer(
        vec![(floor(1.0, 0.0), diffuse(0.5)), (floor(half, 1.0), plate)],
        vec![point_light(lamp, 10.0)],
    );
    let chart = chart(&tracer, 0, 64, 64);
    (2.0 * half, direct(&tracer, &chart).irradiance)
}

/// Share of texel `index` of 64 across 2 m that lies within ±half.
fn share_within(index: usize, half: f64) -> f64 {
    let (low, high) = (index as f64 / 32.0 - 1.0, (index + 1) as f64 / 32.0 - 1.0);
    ((high.min(half) - low.max(-half)) * 32.0).clamp(0.0, 1.0)
}

#[test]
fn a_shadow_ends_where_geometry_says() {
    let (half, irradiance) = shadow_of(diffuse(0.5));
    let lamp = DVec3::new(0.0, 2.0, 0.0);
    for (texel, e) in irradiance.iter().enumerate() {
        let (column, row) = (texel % 64, texel / 64);
        let low = [column as f64 / 32.0 - 1.0, row as f64 / 32.0 - 1.0];
        let open = exact_point_mean(lamp, 10.0, low, 1.0 / 32.0);
        let lit = 1.0 - share_within(column, half) * share_within(row, half);
        // The border texels are sampled at 8 × 8 places: each border is met within a sixteenth.
        let tolerance = if lit == 0.0 {
            0.0
        } else if lit == 1.0 {
            2e-4
        } else {
            1.0 / 16.0 + 2e-3
        };
        assert!(
            (f64::from(e[0]) / open - lit).abs() <= tolerance,
            "texel {column}, {row}: {} for {lit}",
            f64::from(e[0]) / open
        );
    }
}

/// Light that comes through glass or off a mirror is caustic light: every surface stops direct light.
#[test]
fn glass_and_mirrors_stop_direct_light() {
    let (half, black) = shadow_of(diffuse(0.0));
    assert_eq!(black[32 * 64 + 32], [0.0; 3]);
    assert!(share_within(31, half) == 1.0);
    for kind in [
        SurfaceKind::Dielectric,
        SurfaceKind::ThinWall,
        SurfaceKind::Mirror,
        SurfaceKind::Mixed,
    ] {
        assert_eq!(shadow_of(surface(kind, 1.5)).1, black, "{kind:?}");
    }
}

/// Light from below shows on the back of a sheet, and there alone.
#[test]
fn sides_of_a_sheet() {
    for (side, expected) in [(Side::Back, 1.0), (Side::Front, 0.0)] {
        let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![sun(DVec3::Y, 1.0)]);
        let chart = chart(&tracer, 0, 4, 4).of_side(side);
        assert!(
            direct(&tracer, &chart)
                .irradiance
                .iter()
                .all(|e| e[0] == expected)
        );
    }
}

/// Smooth shading: the cosine is that to the interpolated normal.
#[test]
fn light_falls_by_the_interpolated_normal() {
    let lean = DVec3::new(0.6, 0.8, 0.0);
    let mut mesh = floor(1.0, 0.0);
    mesh.normals.fill(lean);
    let direction = DVec3::new(-0.3, -1.0, 0.2).normalize();
    let tracer = tracer(vec![(mesh, diffuse(0.5))], vec![sun(direction, 700.0)]);
    let chart = chart(&tracer, 0, 8, 8);
    let expected = 700.0 * -direction.dot(lean);
    for e in direct(&tracer, &chart).irradiance {
        assert!(
            (f64::from(e[1]) / expected - 1.0).abs() < 1e-6,
            "{} for {expected}",
            e[1]
        );
    }
}

/// Vertex normals may lean so far that a lamp below the surface is before them: it lights the other side all the same.
#[test]
fn a_leaning_normal_lets_no_light_through_its_surface() {
    let mut mesh = floor(1.0, 0.0);
    mesh.normals.fill(DVec3::new(0.9, 0.3, 0.0).normalize());
    let lamp = DVec3::new(4.0, -0.5, 0.3);
    let tracer = tracer(vec![(mesh, diffuse(0.5))], vec![point_light(lamp, 1.0)]);
    let above = chart(&tracer, 0, 8, 8);
    assert_eq!(flux_w(&above, &direct(&tracer, &above)), 0.0);
}

#[test]
fn polish_takes_its_share() {
    let tracer = tracer(
        vec![(floor(1.0, 0.0), surface(SurfaceKind::Mixed, 1.5))],
        vec![sun(DVec3::new(3.0, -4.0, 0.0), 1.0)],
    );
    let chart = chart(&tracer, 0, 4, 4);
    let expected = 0.8 * (1.0 - dielectric_reflectance(0.8, 1.5));
    for e in direct(&tracer, &chart).irradiance {
        assert!((f64::from(e[0]) - expected).abs() < 1e-7);
    }
}

/// A lamp under water: its light crosses no surface, the water takes its share on the way, and a polish reflects less
/// than in air.
#[test]
fn water_around_a_lamp_takes_its_share_and_weakens_polish() {
    let water = Material {
        volume: Some(Volume {
            attenuation_distance_m: 2.0,
            attenuation_colour: LinearSrgb::new(0.2, 0.5, 0.9),
        }),
        ..surface(SurfaceKind::Dielectric, 1.33)
    };
    let height_m = 1.0;
    let lamp = DVec3::Y * height_m;
    let body = cuboid(DVec3::new(-3.0, -0.5, -3.0), DVec3::new(3.0, 2.0, 3.0));
    let polished = surface(SurfaceKind::Mixed, 1.5);
    let tracer = tracer(
        vec![(floor(1.0, 0.0), polished), (body, water)],
        vec![point_light(lamp, 2.0)],
    );
    let n = 64;
    let chart = chart(&tracer, 0, n, n);
    for (texel, e) in direct(&tracer, &chart).irradiance.iter().enumerate() {
        let along = |index: usize| (index as f64 + 0.5) * 2.0 / n as f64 - 1.0;
        let distance_m = DVec3::new(along(texel % n), height_m, along(texel / n)).length();
        let cosine = height_m / distance_m;
        let taken = 1.0 - dielectric_reflectance(cosine, 1.5 / 1.33);
        let open = 2.0 * cosine / (distance_m * distance_m) * taken;
        for (found, colour) in e.iter().zip([0.2_f64, 0.5, 0.9]) {
            let expected = open * colour.powf(distance_m / 2.0);
            assert!(
                (f64::from(*found) / expected - 1.0).abs() < 1e-3,
                "texel {texel}: {found} for {expected}"
            );
        }
    }
}

#[test]
fn lights_add_up_in_their_colours() {
    let red = nephroid::scene::Light {
        colour: LinearSrgb::new(1.0, 0.25, 0.0),
        ..sun(DVec3::NEG_Y, 2.0)
    };
    let blue = nephroid::scene::Light {
        colour: LinearSrgb::new(0.0, 0.0, 1.0),
        ..sun(DVec3::NEG_Y, 3.0)
    };
    let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![red, blue]);
    let chart = chart(&tracer, 0, 2, 2);
    assert!(
        direct(&tracer, &chart)
            .irradiance
            .iter()
            .all(|e| *e == [2.0, 0.5, 3.0])
    );
}

/// Beside the surface the nearest values go on, and add no flux.
#[test]
fn gutters_are_filled() {
    let mut mesh: Mesh = joined(
        quad(DVec3::ZERO, DVec3::X * 8.0, DVec3::Z),
        quad(DVec3::Z, DVec3::X, DVec3::Z * 7.0),
    );
    mesh.uv0 = None;
    let area = mesh.area_m2();
    let tracer = tracer(vec![(mesh, diffuse(0.5))], vec![sun(DVec3::NEG_Y, 1.0)]);
    let chart = chart(&tracer, 0, 8, 8);
    let layer = direct(&tracer, &chart);
    for row in 0..8 {
        for column in 0..8 {
            let expected = if row.min(column) <= 2 { 1.0 } else { 0.0 };
            assert_eq!(
                layer.irradiance[row * 8 + column][0],
                expected,
                "texel {column}, {row}"
            );
        }
    }
    assert!((flux_w(&chart, &layer) - area).abs() < 1e-5);
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let ball = crate::meshes::sphere(DVec3::new(0.0, 0.5, 0.0), 0.3, 24, 12);
    let tracer = tracer(
        vec![(floor(1.0, 0.0), diffuse(0.5)), (ball, diffuse(0.5))],
        vec![
            point_light(DVec3::new(0.2, 1.7, 0.1), 1.0),
            sun(DVec3::new(0.2, -1.0, 0.3), 1.0),
        ],
    );
    let charts = [chart(&tracer, 0, 50, 50), chart(&tracer, 1, 64, 64)];
    let bake = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads");
        let layers = pool.install(|| {
            bake_direct(
                &tracer,
                &tracer.scene().lights,
                &[&charts[0], &charts[1]],
                &(),
                &Control::default(),
            )
        });
        layers
            .into_iter()
            .map(|layer| (layer.irradiance, layer.shadow_rays))
            .collect::<Vec<_>>()
    };
    let one = bake(1);
    assert!(one[0].1 > 8 * 50 * 50, "the ball's shadow is looked at twice");
    assert_eq!(one, bake(2));
    assert_eq!(one, bake(4));
}

#[test]
fn a_cancelled_bake_says_so() {
    let tracer = tracer(
        vec![(floor(1.0, 0.0), diffuse(0.5))],
        vec![sun(DVec3::NEG_Y, 1.0)],
    );
    let chart = chart(&tracer, 0, 4, 4);
    let control = Control::default();
    control.cancel();
    let layers = bake_direct(&tracer, &tracer.scene().lights, &[&chart], &(), &control);
    assert!(!layers[0].complete);
}
