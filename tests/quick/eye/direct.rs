//! Direct light against closed forms.

use std::time::Instant;

use nephroid::illumination::Side;
use nephroid::illumination::lookup::in_chart;
use nephroid::light_pass::direct::bake_direct;
use nephroid::optics::fresnel::dielectric_reflectance;

use crate::prelude::*;
use support::meshes::{cuboid, floor, inside_out, joined, moved, quad, sphere};
use support::scenes::{
    chart, diffuse, direct, flux_w, middles, point_light, spot, sun, surface, tinted, tracer,
};

/// The floor |x|, |z| ≤ 1 under lamps.
fn under(lights: Vec<Light>) -> Tracer {
    tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], lights)
}

fn lit(tracer: &Tracer, side: usize) -> Vec<[f32; 3]> {
    direct(tracer, &chart(tracer, 0, side, side)).irradiance
}

#[track_caller]
fn assert_even(irradiance: &[[f32; 3]], channel: usize, expected: f64, tolerance: f64) {
    for e in irradiance {
        assert_close(f64::from(e[channel]), expected, tolerance, "irradiance");
    }
}

/// Mean of I h/r³ over a texel of the floor |x|, |z| ≤ 1, y = 0, under a point light: by its exact integral, as the
/// solid angle of the texel seen from the light.
fn exact_point_mean(light: DVec3, intensity: f64, [x, z]: [f64; 2], side: f64) -> f64 {
    let corner = |x: f64, z: f64| {
        let (x, z, h) = (x - light.x, z - light.z, light.y);
        (x * z).atan2(h * (x * x + z * z + h * h).sqrt())
    };
    let (far_x, far_z) = (x + side, z + side);
    let sr = corner(far_x, far_z) - corner(x, far_z) - corner(far_x, z) + corner(x, z);
    intensity * sr / (side * side)
}

/// The floor has the light of a point lamp of 2 W/sr at a place.
fn assert_lit_as_by_a_point(irradiance: &[[f32; 3]], place: DVec3, n: usize) {
    let side = 2.0 / n as f64;
    for (texel, e) in irradiance.iter().enumerate() {
        let low = [texel % n, texel / n].map(|index| index as f64 * side - 1.0);
        let exact = exact_point_mean(place, 2.0, low, side);
        assert_close(f64::from(e[0]), exact, 2e-4, "irradiance");
        assert_eq!(e[0], e[2], "a white light is white");
    }
}

#[test]
fn point_light_follows_its_closed_form() {
    let (place, n) = (dvec3(0.3, 0.8, -0.2), 64);
    let tracer = under(vec![point_light(place, 2.0)]);
    let layer = direct(&tracer, &chart(&tracer, 0, n, n));
    assert_lit_as_by_a_point(&layer.irradiance, place, n);
    assert_eq!(layer.shadow_rays, 4 * (n * n) as u64, "no second look");
}

/// E = πL sin²α cos θ, without noise: a bulb above the horizon lights a surface as its centre would.
#[test]
fn bulb_follows_its_closed_form() {
    let (place, n) = (dvec3(0.3, 0.8, -0.2), 64);
    let tracer = under(vec![Light {
        size: LightSize::Radius { radius_m: 0.2 },
        ..point_light(place, 2.0)
    }]);
    let layer = direct(&tracer, &chart(&tracer, 0, n, n));
    assert_lit_as_by_a_point(&layer.irradiance, place, n);
    assert_eq!(layer.shadow_rays, 8 * (n * n) as u64, "no second look");
}

/// A wall is dark up to its sharp edge beside a sunlit side, though their charts meet there on the surface.
#[test]
fn light_stays_on_its_side_of_a_crease() {
    let cube = cuboid(dvec3(-1.0, -1.0, -1.0), dvec3(1.0, 1.0, 1.0));
    let tracer = tracer(vec![(cube, diffuse(0.5))], vec![sun(DVec3::NEG_Y, 1.0)]);
    let chart = chart(&tracer, 0, 64, 64);
    let irradiance = direct(&tracer, &chart).irradiance;
    let mesh = tracer.scene().objects[0].mesh_in_scene();
    for triangle in 0..mesh.triangles.len() {
        let lit = f64::from(u8::from(mesh.face_normal(triangle).y > 0.5));
        for corner in 0..3 {
            let mut weights = [0.0; 3];
            (weights[corner], weights[(corner + 1) % 3]) = (0.5, 0.5);
            let found = in_chart(&chart, &irradiance, chart.uv(triangle, weights));
            assert_close(found.g, lit, 1e-6, "irradiance at an edge");
        }
    }
}

/// Rays along the floor, far off and tiny scenes: a surface never shadows itself.
#[test]
fn no_surface_shadows_itself() {
    let tilt = DMat3::from_axis_angle(dvec3(0.3, 0.2, 1.0).normalize(), 0.7);
    for (scale, offset) in [
        (1.0, DVec3::ZERO),
        (1e-4, DVec3::ZERO),
        (1.0, dvec3(1234.5, -777.7, 4321.0)),
        (1e4, dvec3(1e5, 1e5, 0.0)),
    ] {
        for height in [1.0, 1e-3] {
            let mesh = moved(floor(scale, 0.0), tilt, offset);
            let lamp = tilt * dvec3(0.31 * scale, height * scale, 0.17 * scale) + offset;
            let tracer = tracer(vec![(mesh, diffuse(0.5))], vec![point_light(lamp, 1.0)]);
            let layer = direct(&tracer, &chart(&tracer, 0, 33, 33));
            assert_eq!(layer.shadow_rays, 4 * 33 * 33, "{scale}, {height}");
            assert!(layer.irradiance.iter().all(|e| e[0] > 0.0));
        }
    }
}

#[test]
fn sun_gives_irradiance_times_cosine() {
    let direction = dvec3(1.0, -2.0, 0.5);
    let flat = under(vec![sun(direction, 700.0)]);
    assert_even(&lit(&flat, 8), 1, 700.0 * 2.0 / direction.length(), 1e-6);

    // Smooth shading: the cosine is that to the interpolated normal.
    let lean = dvec3(0.6, 0.8, 0.0);
    let mut mesh = floor(1.0, 0.0);
    mesh.normals.fill(lean);
    let direction = dvec3(-0.3, -1.0, 0.2).normalize();
    let smooth = tracer(vec![(mesh, diffuse(0.5))], vec![sun(direction, 700.0)]);
    assert_even(&lit(&smooth, 8), 1, 700.0 * -direction.dot(lean), 1e-6);

    // Polish sends its share away.
    let coated = surface(SurfaceKind::Coated, 1.5);
    let lamp = sun(dvec3(3.0, -4.0, 0.0), 1.0);
    let coated = tracer(vec![(floor(1.0, 0.0), coated)], vec![lamp]);
    let taken = 1.0 - dielectric_reflectance(0.8, 1.5);
    assert_even(&lit(&coated, 4), 0, 0.8 * taken, 1e-7);
}

#[test]
fn spot_lights_its_cone() {
    let tracer = under(vec![spot(DVec3::Y, DVec3::NEG_Y, 3.0, [0.2, 0.5])]);
    let n = 101;
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
    let (mut in_cone, mut dark) = (0, 0);
    for (texel, e) in lit(&tracer, n).iter().enumerate() {
        let steps = (0..fine * fine).map(|step| (step % fine, step / fine));
        let values = steps.map(|(x, z)| at(place(texel % n, x), place(texel / n, z)));
        let mean = values.sum::<f64>() / (fine * fine) as f64;
        near(f64::from(e[0]), mean, kink, texel);
        assert!(mean > 0.0 || e[0] == 0.0, "texel {texel}: light outside the cone");
        *if mean == 0.0 { &mut dark } else { &mut in_cone } += 1;
    }
    assert!(in_cone > 2000 && dark > 7000, "{in_cone} {dark}");
}

/// All of a lamp's light lands on the closed box around it, on the side of its walls that faces the lamp.
#[test]
fn closed_box_takes_the_whole_flux() {
    let walls = cuboid(DVec3::ZERO, dvec3(1.0, 1.5, 2.0));
    let inward = inside_out(walls.clone());
    let lamp = point_light(dvec3(0.4, 0.9, 0.7), 5.0);
    for (mesh, front) in [(inward, 1.0), (walls, 0.0)] {
        let tracer = tracer(vec![(mesh, diffuse(0.5))], vec![lamp.clone()]);
        for (side, share) in [(Side::Front, front), (Side::Back, 1.0 - front)] {
            let chart = chart(&tracer, 0, 256, 256).of_side(side);
            let (flux, expected) = (flux_w(&chart, &direct(&tracer, &chart)), share * 4.0 * PI * 5.0);
            assert!((flux - expected).abs() <= 5e-4 * expected, "{side:?}: {flux}");
        }
    }
}

/// A lamp over a floor with a square plate half-way: the shadow is the plate at twice its size.
fn shadow_of(plate: Material) -> Vec<[f32; 3]> {
    let parts = vec![(floor(1.0, 0.0), diffuse(0.5)), (floor(0.173, 1.0), plate)];
    lit(&tracer(parts, vec![point_light(DVec3::Y * 2.0, 10.0)]), 64)
}

/// Share of texel `index` of 64 across 2 m that lies within ±0.346.
fn share_within(index: usize) -> f64 {
    let (low, high) = (index as f64 / 32.0 - 1.0, (index + 1) as f64 / 32.0 - 1.0);
    ((high.min(0.346) - low.max(-0.346)) * 32.0).clamp(0.0, 1.0)
}

#[test]
fn shadow_ends_where_geometry_says() {
    for (texel, e) in shadow_of(diffuse(0.5)).iter().enumerate() {
        let (column, row) = (texel % 64, texel / 64);
        let low = [column, row].map(|index| index as f64 / 32.0 - 1.0);
        let open = exact_point_mean(DVec3::Y * 2.0, 10.0, low, 1.0 / 32.0);
        let lit = 1.0 - share_within(column) * share_within(row);
        // The border texels are sampled at 8 × 8 places: each border is met within a sixteenth.
        let tolerance = match lit {
            0.0 => 0.0,
            1.0 => 2e-4,
            _ => 1.0 / 16.0 + 2e-3,
        };
        let found = f64::from(e[0]) / open;
        assert!((found - lit).abs() <= tolerance, "{column} {row} {found} {lit}");
    }
}

/// The same shadow in texels of a quarter of the side, where it ends and nowhere else.
#[test]
fn texels_are_divided_where_a_shadow_ends() {
    let parts = vec![(floor(1.0, 0.0), diffuse(0.5)), (floor(0.173, 1.0), diffuse(0.5))];
    let tracer = tracer(parts, vec![point_light(DVec3::Y * 2.0, 10.0)]);
    let [whole, small] = [64, 256].map(|side| chart(&tracer, 0, side, side));
    let charts = [(&whole, Some(&small))];
    let layer = bake_direct(&tracer, &tracer.scene().lights, &charts, &(), &Control::default()).remove(0);
    let fine = direct(&tracer, &small);
    let divided = layer.divided.as_ref().expect("it was asked for");
    let mut small_texels = 0;
    for (texel, e) in fine.irradiance.iter().enumerate() {
        let (column, row) = (texel % 256, texel / 256);
        let low = [column, row].map(|index| index as f64 / 128.0 - 1.0);
        let open = exact_point_mean(DVec3::Y * 2.0, 10.0, low, 1.0 / 128.0);
        let exact = f64::from(e[0]) / open;
        match divided.at((dvec2(column as f64, row as f64) + 0.5) / 256.0) {
            Some(found) => {
                // 4 × 4 places of the small texels beside 8 × 8 of the fine map's.
                assert!((found.r / open - exact).abs() < 0.19, "{column} {row}");
                small_texels += 1;
            }
            None => assert!(
                exact == 0.0 || (exact - 1.0).abs() < 1e-3,
                "{column} {row} {exact}"
            ),
        }
    }
    assert!((2_000..12_000).contains(&small_texels), "{small_texels}");
    let [coarse_w, fine_w] = [flux_w(&whole, &layer), flux_w(&small, &fine)];
    assert!((coarse_w / fine_w - 1.0).abs() < 1e-3, "{coarse_w} W, {fine_w} W");
    assert!(
        layer.shadow_rays < fine.shadow_rays / 4,
        "{} rays",
        layer.shadow_rays
    );
}

/// Light that comes through glass or off a mirror is caustic light: every surface stops direct light.
#[test]
fn glass_and_mirrors_stop_direct_light() {
    use SurfaceKind::{Coated, Dielectric, Mirror, ThinWall};
    let black = shadow_of(diffuse(0.0));
    assert_eq!((black[32 * 64 + 32], share_within(31)), ([0.0; 3], 1.0));
    for kind in [Dielectric, ThinWall, Mirror, Coated] {
        assert_eq!(shadow_of(surface(kind, 1.5)), black, "{kind:?}");
    }
}

/// Light from below shows on the back of a sheet, and there alone. Vertex normals may lean so far that a lamp below
/// the surface is before them: it lights the other side all the same.
#[test]
fn light_stays_on_its_side_of_a_sheet() {
    let below = under(vec![sun(DVec3::Y, 1.0)]);
    for (side, expected) in [(Side::Back, 1.0), (Side::Front, 0.0)] {
        let layer = direct(&below, &chart(&below, 0, 4, 4).of_side(side));
        assert_even(&layer.irradiance, 0, expected, 0.0);
    }
    let mut mesh = floor(1.0, 0.0);
    mesh.normals.fill(dvec3(0.9, 0.3, 0.0).normalize());
    let lamp = point_light(dvec3(4.0, -0.5, 0.3), 1.0);
    let leaning = tracer(vec![(mesh, diffuse(0.5))], vec![lamp]);
    assert_even(&lit(&leaning, 8), 0, 0.0, 0.0);
}

/// A lamp under water: its light crosses no surface, the water takes its share on the way, and a coat reflects less
/// than in air.
#[test]
fn water_around_a_lamp_takes_its_share() {
    let colour = [0.2, 0.5, 0.9];
    let water = tinted(surface(SurfaceKind::Dielectric, 1.33), 2.0, colour.into());
    let body = cuboid(dvec3(-3.0, -0.5, -3.0), dvec3(3.0, 2.0, 3.0));
    let coated = surface(SurfaceKind::Coated, 1.5);
    let parts = vec![(floor(1.0, 0.0), coated), (body, water)];
    let tracer = tracer(parts, vec![point_light(DVec3::Y, 2.0)]);
    for (e, middle) in lit(&tracer, 64).iter().zip(middles(64)) {
        let distance_m = (2.0 * middle - 1.0).extend(1.0).length();
        let cosine = 1.0 / distance_m;
        let taken = 1.0 - dielectric_reflectance(cosine, 1.5 / 1.33);
        let open = 2.0 * cosine.powi(3) * taken;
        for (found, share) in e.iter().zip(colour) {
            let expected = open * f64::powf(share, distance_m / 2.0);
            assert_close(f64::from(*found), expected, 1e-3, "irradiance");
        }
    }
}

#[test]
fn lights_add_up_in_their_colours() {
    let coloured = |colour, strength| with(sun(DVec3::NEG_Y, strength), |it| it.colour = colour);
    let red = coloured(rgb(1.0, 0.25, 0.0), 2.0);
    let blue = coloured(rgb(0.0, 0.0, 1.0), 3.0);
    assert_eq!(lit(&under(vec![red, blue]), 2), [[2.0, 0.5, 3.0]; 4]);
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
    for (texel, e) in layer.irradiance.iter().enumerate() {
        let is_near = (texel / 8).min(texel % 8) <= 2;
        assert_eq!(e[0], if is_near { 1.0 } else { 0.0 }, "texel {texel}");
    }
    assert!((flux_w(&chart, &layer) - area).abs() < 1e-5);
}

#[test]
fn cancelled_bake_says_so() {
    let tracer = under(vec![sun(DVec3::NEG_Y, 1.0)]);
    let chart = chart(&tracer, 0, 4, 4);
    let control = Control::default();
    control.cancel();
    let layers = bake_direct(&tracer, &tracer.scene().lights, &[(&chart, None)], &(), &control);
    assert!(!layers[0].complete);
}

/// Once the time is up, texels keep what a few samples found.
#[test]
fn late_layers_are_rough_but_right() {
    let lamp = Light {
        size: LightSize::Radius { radius_m: 0.3 },
        ..point_light(dvec3(0.0, 1.5, 0.0), 1.0)
    };
    let ball = sphere(dvec3(0.0, 0.5, 0.0), 0.3, 24, 12);
    let tracer = tracer(
        vec![(floor(1.0, 0.0), diffuse(0.5)), (ball, diffuse(0.5))],
        vec![lamp],
    );
    let chart = chart(&tracer, 0, 32, 32);
    let bake = |control: &Control| {
        bake_direct(&tracer, &tracer.scene().lights, &[(&chart, None)], &(), control).remove(0)
    };
    let (late, fine) = (
        bake(&Control::default().with_deadline(Instant::now())),
        bake(&Control::default()),
    );
    assert!(late.complete && !late.is_refined && fine.is_refined);
    assert!(
        late.shadow_rays <= 8 * 32 * 32,
        "{} shadow rays",
        late.shadow_rays
    );
    assert_close(flux_w(&chart, &late), flux_w(&chart, &fine), 0.01, "flux");
}
