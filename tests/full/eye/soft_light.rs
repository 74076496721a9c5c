//! Direct light from lamps with extent against closed forms.

use nephroid::illumination::Side;
use nephroid::scene::{Environment, PanelShape};

use support::meshes::{cuboid, floor, grid, quad, sphere};
use support::prelude::*;
use support::scenes::{chart, diffuse, direct, flux_w, light, middles, point_light, scene, sun, tracer};

/// A panel at a height over the floor's middle that shines down.
fn panel(half_m: f64, height_m: f64, radiance: f64, shape: PanelShape) -> Light {
    let sides = [DVec3::X * half_m, DVec3::Z * half_m];
    support::scenes::panel(DVec3::Y * height_m, sides, shape, radiance)
}

fn ball_lamp(place: DVec3, radius_m: f64, intensity: f64) -> Light {
    Light {
        size: LightSize::Radius { radius_m },
        ..point_light(place, intensity)
    }
}

fn wide_sun(diameter_rad: f64) -> Light {
    Light {
        size: LightSize::Angle { diameter_rad },
        ..sun(DVec3::NEG_Y, 2.0)
    }
}

fn glowing(object: usize, radiance: f64) -> Light {
    let radiance = Radiance(radiance);
    light(LightKind::Surface { object, radiance })
}

fn sided(double_sided: bool) -> Material {
    Material {
        double_sided,
        ..diffuse(0.5)
    }
}

fn matte(mesh: Mesh) -> (Mesh, Material) {
    (mesh, diffuse(0.5))
}

/// The square |x|, |z| ≤ half of the plane y = 0 under a lamp, and what else there is.
fn under(lamp: Light, half: f64, others: Vec<(Mesh, Material)>) -> Tracer {
    let parts = std::iter::once(matte(floor(half, 0.0))).chain(others);
    tracer(parts.collect(), vec![lamp])
}

fn under_sky(half: f64, others: Vec<(Mesh, Material)>, sky: Option<Environment>, scale: f64) -> Tracer {
    let parts = std::iter::once((floor(half, 0.0), sided(false))).chain(others);
    let scene = scene(parts.collect(), vec![]);
    Tracer::new(Arc::new(support::scenes::under_sky(scene, sky, scale)))
}

fn lit(tracer: &Tracer, object: usize, n: usize) -> Vec<[f32; 3]> {
    direct(tracer, &chart(tracer, object, n, n)).irradiance
}

/// E/L at the origin of the plane y = 0 from the part x ≤ a, z ≤ b, both ≥ 0, of a parallel rectangle at height h over
/// the corner (Siegel and Howell, Thermal Radiation Heat Transfer, parallel plane element to rectangle); odd in a and b.
fn corner_sr(a: f64, b: f64, h: f64) -> f64 {
    let (x, y) = (a / h, b / h);
    let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    0.5 * (x / rx * (y / rx).atan() + y / ry * (x / ry).atan())
}

/// E/L at (x, z) of the floor from a rectangle over x0..x1, z0..z1.
fn rectangle_sr([x, z]: [f64; 2], [x0, x1]: [f64; 2], [z0, z1]: [f64; 2], h: f64) -> f64 {
    let to = |a: f64, b: f64| corner_sr(a - x, b - z, h);
    to(x1, z1) - to(x0, z1) - to(x1, z0) + to(x0, z0)
}

/// The same from a square over |x|, |z| ≤ half.
fn square_sr(place: [f64; 2], half: f64, h: f64) -> f64 {
    rectangle_sr(place, [-half, half], [-half, half], h)
}

/// Middles of n × n texels on the floor |x|, |z| ≤ half.
fn places(n: usize, half: f64) -> impl Iterator<Item = [f64; 2]> {
    middles(n).map(move |middle| ((2.0 * middle - 1.0) * half).to_array())
}

/// Fails unless irradiance on the square |x|, |z| ≤ half is as expected: to a relative difference at a texel, and to
/// one in the mean.
#[track_caller]
fn assert_lit(
    irradiance: &[[f32; 3]],
    half: f64,
    [most, in_the_mean]: [f64; 2],
    expected: impl Fn([f64; 2]) -> f64,
) {
    let (mut largest, mut sum, mut whole) = (0.0_f64, 0.0, 0.0);
    let n = irradiance.len().isqrt();
    for (e, place) in irradiance.iter().zip(places(n, half)) {
        let (found, expected) = (f64::from(e[0]), expected(place));
        largest = largest.max((found / expected - 1.0).abs());
        sum += found;
        whole += expected;
    }
    let mean = (sum / whole - 1.0).abs();
    let is_right = largest < most && mean < in_the_mean;
    assert!(is_right, "{largest} at most, {mean} in the mean");
}

/// I h/r³ of a lamp at height 1 over the middle.
fn from_height_1([x, z]: [f64; 2]) -> f64 {
    (x * x + z * z + 1.0).powf(-1.5)
}

#[test]
fn even_sky_gives_pi_times_its_radiance() {
    for (width, height) in [(1, 1), (64, 32)] {
        let pixels = vec![[2.0, 1.0, 0.5]; width * height];
        let sky = Environment::new(width, height, pixels);
        let irradiance = lit(&under_sky(1.0, vec![], sky, 3.0), 0, 24);
        assert_lit(&irradiance, 1.0, [0.02, 1e-3], |_| 6.0 * PI);
        let is_coloured =
            |e: &[f32; 3]| (e[1] / e[0] - 0.5).abs() < 1e-6 && (e[2] / e[0] - 0.25).abs() < 1e-6;
        assert!(irradiance.iter().all(is_coloured));
    }
}

/// One pixel is a sun: its light comes from there, and a plate in front of it shadows it alone.
#[test]
fn sun_in_a_sky_casts_its_shadow() {
    let mut pixels = vec![[0.1_f32; 3]; 64 * 32];
    // Near the zenith, towards +x.
    pixels[4 * 64 + 16] = [1000.0; 3];
    let polar = |row: f64| row / 32.0 * PI;
    let sun_sr = 2.0 * PI / 64.0 * (polar(4.0).cos() - polar(5.0).cos());
    let elevation = polar(4.5);
    let sky = || Environment::new(64, 32, pixels.clone());
    let expected = 0.1 * PI + 999.9 * sun_sr * elevation.cos();
    let open = lit(&under_sky(1.0, vec![], sky(), 1.0), 0, 16);
    assert_lit(&open, 1.0, [0.03, 3e-3], |_| expected);
    // A small plate high up on the way to the sun.
    let centre = dvec3(1.5 * elevation.sin(), 1.5 * elevation.cos(), 0.001);
    let plate = quad(centre - dvec3(0.2, 0.0, 0.2), DVec3::X * 0.4, DVec3::Z * 0.4);
    let shadowed = under_sky(0.05, vec![matte(plate)], sky(), 1.0);
    for e in lit(&shadowed, 0, 4) {
        assert!((0.2..0.105 * PI).contains(&f64::from(e[0])), "{e:?}");
    }
}

#[test]
fn square_panel_follows_its_form_factor() {
    for (half, height) in [(0.5, 1.0), (1.0, 0.05), (0.01, 2.0)] {
        let lamp = panel(half, height, 7.0, PanelShape::Rectangle);
        // Two places across a texel see curvature as well as four, but for the steep edge of what hangs low.
        let most = if height < 0.1 { 0.05 } else { 1e-3 };
        let irradiance = lit(&under(lamp, 1.0, vec![]), 0, 40);
        assert_lit(&irradiance, 1.0, [most, 1e-3], |[x, z]| {
            let within_texel = places(4, 1.0 / 40.0).map(|[dx, dz]| [x + dx, z + dz]);
            let sum: f64 = within_texel.map(|place| square_sr(place, half, height)).sum();
            7.0 * sum / 16.0
        });
    }
}

/// All that a one-sided lamp sends, πLA, lands in the closed box around it; a disc has its area.
#[test]
fn closed_box_takes_all_that_lamps_send() {
    let ball = ball_lamp(dvec3(0.1, 0.2, -0.3), 0.2, 2.0);
    for (lamp, expected) in [
        (panel(0.3, 0.2, 5.0, PanelShape::Rectangle), PI * 5.0 * 0.36),
        (panel(0.3, 0.2, 5.0, PanelShape::Disc), PI * 5.0 * PI * 0.09),
        (ball, 4.0 * PI * 2.0),
    ] {
        let walls = cuboid(DVec3::NEG_ONE, dvec3(1.0, 1.3, 1.1));
        let tracer = tracer(vec![matte(walls)], vec![lamp]);
        let chart = chart(&tracer, 0, 128, 128).of_side(Side::Back);
        let flux = flux_w(&chart, &direct(&tracer, &chart));
        assert!((flux / expected - 1.0).abs() < 2e-3, "{flux} for {expected}");
    }
}

/// A plate over x ≤ 0 at a height.
fn half_plate(height: f64) -> (Mesh, Material) {
    matte(quad(dvec3(-3.0, height, -3.0), DVec3::X * 3.0, DVec3::Z * 6.0))
}

/// A plate half-way up hides a panel from one side of its edge: what is left of the panel is a rectangle.
#[test]
fn penumbra_follows_what_is_left_of_the_panel() {
    let half = 0.3;
    let lamp = panel(half, 1.0, 1.0, PanelShape::Rectangle);
    let irradiance = lit(&under(lamp, 0.6, vec![half_plate(0.5)]), 0, 32);
    let open = square_sr([0.0; 2], half, 1.0);
    let (mut sum, mut seen) = (0.0, 0);
    for (e, place) in irradiance.iter().zip(places(32, 0.6)) {
        // The edge x = 0 at half the height, seen from x, hides the panel up to −x.
        let edge = (-place[0]).clamp(-half, half);
        let expected = rectangle_sr(place, [edge, half], [-half, half], 1.0);
        let off = f64::from(e[0]) - expected;
        assert!(off.abs() < 0.04 * open, "{place:?}: {} for {expected}", e[0]);
        if expected == 0.0 {
            assert_eq!(e[0], 0.0, "no light in the core of the shadow");
        } else {
            sum += off;
            seen += 1;
        }
    }
    let mean = sum / f64::from(seen);
    assert!(seen > 500 && mean.abs() < 2e-3 * open, "{mean}");
}

/// The sun's disc behind the edge of a plate: the share of a circle beyond a line.
#[test]
fn suns_penumbra_is_as_wide_as_the_sun() {
    let diameter_rad = 0.53_f64.to_radians();
    let tracer = under(wide_sun(diameter_rad), 0.1, vec![half_plate(10.0)]);
    let half_width = 10.0 * (0.5 * diameter_rad).tan();
    let (mut between, mut squares, mut sum) = (0, 0.0, 0.0);
    for (e, [x, _]) in lit(&tracer, 0, 64).iter().zip(places(64, 0.1)) {
        let t = (x / half_width).clamp(-1.0, 1.0);
        let share = 0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / PI;
        let off = f64::from(e[0]) / 2.0 - share;
        assert!(off.abs() < 0.08, "at {x}: {} for {share}", e[0]);
        if share > 0.01 && share < 0.99 {
            between += 1;
            squares += off * off;
            sum += off;
        }
    }
    let count = f64::from(between);
    assert!(between > 64 * 25, "{between} texels lie in the penumbra");
    let (noise, mean) = ((squares / count).sqrt(), sum / count);
    assert!(noise < 0.02 && mean.abs() < 1e-3, "{noise}, {mean} in the mean");
}

/// Where all of a ball is above the horizon it shines as its middle does; across its beam a sun gives its normal
/// irradiance, however wide its disc is.
#[test]
fn wide_lamps_shine_as_their_middles() {
    let ball = lit(&under(ball_lamp(DVec3::Y, 0.5, 3.0), 0.5, vec![]), 0, 32);
    assert_lit(&ball, 0.5, [0.01, 1e-3], |place| 3.0 * from_height_1(place));
    for degrees in [1.0_f64, 30.0, 90.0] {
        let sun = lit(&under(wide_sun(degrees.to_radians()), 1.0, vec![]), 0, 16);
        assert_lit(&sun, 1.0, [0.02, 2e-3], |_| 2.0);
    }
}

/// A sheet that glows between a floor and a ceiling: upwards, or both ways.
#[test]
fn surfaces_glow_on_the_sides_they_have() {
    let ceiling = || matte(quad(dvec3(-1.0, 1.4, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0));
    for double_sided in [true, false] {
        let sheet = quad(dvec3(-0.5, 0.7, -0.5), DVec3::Z, DVec3::X);
        let others = vec![(sheet, sided(double_sided)), ceiling()];
        let tracer = under(glowing(1, 2.0), 1.0, others);
        let normal = |object: usize| tracer.scene().objects[object].mesh_in_scene().face_normal(0);
        let faces_up = normal(1).y > 0.0;
        for (object, is_lit) in [(0, double_sided || !faces_up), (2, double_sided || faces_up)] {
            let travels = if object == 0 { DVec3::NEG_Y } else { DVec3::Y };
            let side = Side::met(travels, normal(object));
            let layer = direct(&tracer, &chart(&tracer, object, 16, 16).of_side(side));
            if is_lit {
                let expected = |place| 2.0 * square_sr(place, 0.5, 0.7);
                assert_lit(&layer.irradiance, 1.0, [0.02, 2e-3], expected);
            } else {
                assert!(layer.irradiance.iter().all(|e| *e == [0.0; 3]));
            }
        }
        // A flat lamp does not light itself.
        assert_eq!(lit(&tracer, 1, 4), [[0.0; 3]; 16]);
    }
    // Of many triangles, so that it is looked for by samples alone; it faces up.
    let sheet = grid(6, 6, |s, t| dvec3(t - 0.5, 0.7, s - 0.5));
    let ceiling = quad(dvec3(-1.0, 1.4, -1.0), DVec3::Z * 2.0, DVec3::X * 2.0);
    let others = vec![(sheet, sided(false)), matte(ceiling)];
    let tracer = under(glowing(1, 2.0), 1.0, others);
    assert!(tracer.scene().objects[1].mesh_in_scene().face_normal(0).y > 0.0);
    for (object, is_lit) in [(0, false), (2, true)] {
        let chart = chart(&tracer, object, 8, 8);
        let e_w = flux_w(&chart, &direct(&tracer, &chart));
        assert_eq!(e_w > 0.0, is_lit, "object {object} gets {e_w} W");
    }
}

/// Far from the world's origin too, what glows is not its own shadow: a box and a ball of many triangles.
#[test]
fn lamps_do_not_shadow_themselves() {
    for offset in [DVec3::ZERO, dvec3(1234.5, -777.7, 4321.0)] {
        let place = |mut mesh: Mesh| {
            mesh.positions.iter_mut().for_each(|corner| *corner += offset);
            mesh
        };
        let beside = |half: f64, lamp: Mesh| {
            let parts = vec![matte(place(floor(half, 0.0))), (place(lamp), sided(false))];
            tracer(parts, vec![glowing(1, 5.0)])
        };
        let ball = lit(&beside(0.5, sphere(DVec3::Y, 0.1, 48, 24)), 0, 16);
        // The mesh lies within the ball.
        assert_lit(&ball, 0.5, [0.04, 0.02], |place| {
            PI * 0.01 * 5.0 * from_height_1(place)
        });
        let body = cuboid(dvec3(-0.2, 0.5, -0.2), dvec3(0.2, 0.6, 0.2));
        let body = lit(&beside(0.1, body), 0, 8);
        assert_lit(&body, 0.1, [2e-3, 2e-3], |place| 5.0 * square_sr(place, 0.2, 0.5));
    }
}

/// On, at and just above its receiver a lamp sends no more than πL, and no number that is none.
#[test]
fn lamp_on_its_receiver_stays_finite() {
    for (height, double_sided) in [(0.0, false), (0.0, true), (1e-12, true), (1e-6, true)] {
        let flat = quad(dvec3(-0.5, height, -0.5), DVec3::X, DVec3::Z);
        let ball = sphere(DVec3::Y * height, 0.5, 24, 12);
        for (lamp, most) in [(flat, PI), (ball, 2.0 * PI)] {
            let tracer = under(glowing(1, 1e30), 1.0, vec![(lamp, sided(double_sided))]);
            for e in lit(&tracer, 0, 20) {
                let share = f64::from(e[0]) / 1e30;
                assert!((0.0..1.01 * most).contains(&share), "{height}: {share}");
            }
        }
    }
}
