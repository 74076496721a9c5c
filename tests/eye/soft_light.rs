//! Direct light from lamps with extent against closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use nephroid::illumination::Side;
use nephroid::light_pass::direct::bake_direct;
use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::{Environment, Light, LightKind, LightSize, Material, Mesh, PanelShape};
use nephroid::transport::Tracer;
use nephroid::units::Radiance;

use crate::meshes::{cuboid, floor, grid, quad, sphere};
use crate::scenes::{chart, diffuse, direct, flux_w, light, point_light, scene, sun, tracer};

/// A panel at a height over the floor's middle that shines down.
fn panel(half_m: f64, height_m: f64, radiance: f64, shape: PanelShape) -> Light {
    light(LightKind::Panel {
        centre: DVec3::Y * height_m,
        across: DVec3::X * half_m,
        down: DVec3::Z * half_m,
        shape,
        radiance: Radiance(radiance),
    })
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

/// Middle of a texel of n × n on the floor |x|, |z| ≤ half.
fn middle(texel: usize, n: usize, half: f64) -> [f64; 2] {
    [texel % n, texel / n].map(|index| ((index as f64 + 0.5) / n as f64 * 2.0 - 1.0) * half)
}

/// Largest relative difference from what is expected, and that of the mean.
fn errors(irradiance: &[[f32; 3]], expected: impl Fn(usize) -> f64) -> (f64, f64) {
    let (mut largest, mut sum, mut whole) = (0.0_f64, 0.0, 0.0);
    for (texel, e) in irradiance.iter().enumerate() {
        let (found, expected) = (f64::from(e[0]), expected(texel));
        largest = largest.max((found / expected - 1.0).abs());
        sum += found;
        whole += expected;
    }
    (largest, (sum / whole - 1.0).abs())
}

fn under_sky(parts: Vec<(Mesh, Material)>, sky: Environment, scale: f64) -> Tracer {
    let mut scene = scene(parts, vec![light(LightKind::Environment { scale })]);
    scene.environment = Some(Arc::new(sky));
    Tracer::new(Arc::new(scene))
}

#[test]
fn an_even_sky_gives_pi_times_its_radiance() {
    for (width, height) in [(1, 1), (64, 32)] {
        let sky = Environment::new(width, height, vec![[2.0, 1.0, 0.5]; width * height]).expect("sound");
        let tracer = under_sky(vec![(floor(1.0, 0.0), sided(false))], sky, 3.0);
        let layer = direct(&tracer, &chart(&tracer, 0, 24, 24));
        let (largest, mean) = errors(&layer.irradiance, |_| 6.0 * PI);
        assert!(
            largest < 0.02 && mean < 1e-3,
            "{largest} at most, {mean} in the mean"
        );
        assert!(layer.irradiance.iter().all(|e| (e[1] / e[0] - 0.5).abs() < 1e-6));
    }
}

/// One pixel is a sun: its light comes from there, and a plate in front of it shadows it alone.
#[test]
fn a_sun_in_a_sky_casts_its_shadow() {
    let (width, height) = (64, 32);
    let mut pixels = vec![[0.1_f32; 3]; width * height];
    // Near the zenith, towards +x.
    let (column, row) = (16, 4);
    pixels[row * width + column] = [1000.0; 3];
    let polar = |row: usize| row as f64 / height as f64 * PI;
    let sun_sr = 2.0 * PI / width as f64 * (polar(row).cos() - polar(row + 1).cos());
    let elevation = polar(row) + 0.5 * PI / height as f64;
    let sky = || Environment::new(width, height, pixels.clone()).expect("sound");
    let open = under_sky(vec![(floor(1.0, 0.0), sided(false))], sky(), 1.0);
    let layer = direct(&open, &chart(&open, 0, 16, 16));
    let expected = 0.1 * PI + 999.9 * sun_sr * elevation.cos();
    let (largest, mean) = errors(&layer.irradiance, |_| expected);
    assert!(
        largest < 0.03 && mean < 3e-3,
        "{largest} at most, {mean} in the mean"
    );
    // A small plate high up on the way to the sun.
    let towards = DVec3::new(elevation.sin(), elevation.cos(), 0.0);
    let plate = |centre: DVec3| quad(centre - DVec3::new(0.2, 0.0, 0.2), DVec3::X * 0.4, DVec3::Z * 0.4);
    let parts = vec![
        (floor(0.05, 0.0), sided(false)),
        (plate(towards * 1.5 + DVec3::Z * 0.001), diffuse(0.5)),
    ];
    let shadowed = under_sky(parts, sky(), 1.0);
    let layer = direct(&shadowed, &chart(&shadowed, 0, 4, 4));
    for e in layer.irradiance {
        assert!(
            (0.2..0.105 * PI).contains(&f64::from(e[0])),
            "only the sky is left: {e:?}"
        );
    }
}

#[test]
fn a_square_panel_follows_its_form_factor() {
    for (half, height) in [(0.5, 1.0), (1.0, 0.05), (0.01, 2.0)] {
        let tracer = tracer(
            vec![(floor(1.0, 0.0), diffuse(0.5))],
            vec![panel(half, height, 7.0, PanelShape::Rectangle)],
        );
        let n = 40;
        let layer = direct(&tracer, &chart(&tracer, 0, n, n));
        let fine = 4;
        let (largest, mean) = errors(&layer.irradiance, |texel| {
            let [x, z] = middle(texel, n, 1.0);
            let step = |index: usize| ((index as f64 + 0.5) / fine as f64 - 0.5) * 2.0 / n as f64;
            let at = |index: usize| [x + step(index % fine), z + step(index / fine)];
            let sum: f64 = (0..fine * fine)
                .map(|index| rectangle_sr(at(index), [-half, half], [-half, half], height))
                .sum();
            7.0 * sum / (fine * fine) as f64
        });
        // Two places across a texel see curvature as well as four, but for the steep edge of what hangs low.
        let most = if height < 0.1 { 0.05 } else { 1e-3 };
        assert!(
            largest < most && mean < 1e-3,
            "{half} at {height}: {largest} at most, {mean} in the mean"
        );
    }
}

/// All that a one-sided lamp sends, πLA, lands in the closed box around it; a disc has its area.
#[test]
fn a_closed_box_takes_all_that_panels_and_balls_send() {
    let ball = Light {
        size: LightSize::Radius { radius_m: 0.2 },
        ..point_light(DVec3::new(0.1, 0.2, -0.3), 2.0)
    };
    for (lamp, expected) in [
        (panel(0.3, 0.2, 5.0, PanelShape::Rectangle), PI * 5.0 * 0.36),
        (panel(0.3, 0.2, 5.0, PanelShape::Disc), PI * 5.0 * PI * 0.09),
        (ball, 4.0 * PI * 2.0),
    ] {
        let walls = cuboid(DVec3::NEG_ONE, DVec3::new(1.0, 1.3, 1.1));
        let tracer = tracer(vec![(walls, diffuse(0.5))], vec![lamp.clone()]);
        let chart = chart(&tracer, 0, 128, 128).of_side(Side::Back);
        let flux = flux_w(&chart, &direct(&tracer, &chart));
        assert!(
            (flux / expected - 1.0).abs() < 2e-3,
            "{:?}: {flux} for {expected}",
            lamp.kind
        );
    }
}

/// A plate half-way up hides a panel from one side of its edge: what is left of the panel is a rectangle.
#[test]
fn a_penumbra_follows_what_is_left_of_the_panel() {
    let (half, height) = (0.3, 1.0);
    let plate = quad(DVec3::new(-3.0, 0.5, -3.0), DVec3::X * 3.0, DVec3::Z * 6.0);
    let tracer = tracer(
        vec![(floor(0.6, 0.0), diffuse(0.5)), (plate, diffuse(0.5))],
        vec![panel(half, height, 1.0, PanelShape::Rectangle)],
    );
    let n = 32;
    let layer = direct(&tracer, &chart(&tracer, 0, n, n));
    let open = rectangle_sr([0.0; 2], [-half, half], [-half, half], height);
    let (mut sum, mut seen) = (0.0, 0);
    for (texel, e) in layer.irradiance.iter().enumerate() {
        let [x, z] = middle(texel, n, 0.6);
        // The edge x = 0 at half the height, seen from x, hides the panel up to −x.
        let edge = (-x).clamp(-half, half);
        let expected = rectangle_sr([x, z], [edge, half], [-half, half], height);
        let off = f64::from(e[0]) - expected;
        assert!(off.abs() < 0.04 * open, "texel {texel}: {} for {expected}", e[0]);
        if expected == 0.0 {
            assert_eq!(e[0], 0.0, "no light in the core of the shadow");
        } else {
            sum += off;
            seen += 1;
        }
    }
    assert!(
        seen > 500 && (sum / f64::from(seen)).abs() < 2e-3 * open,
        "{}",
        sum / f64::from(seen)
    );
}

/// The sun's disc behind the edge of a plate: the share of a circle beyond a line.
#[test]
fn the_suns_penumbra_is_as_wide_as_the_sun() {
    let diameter_rad = 0.53_f64.to_radians();
    let disc = Light {
        size: LightSize::Angle { diameter_rad },
        ..sun(DVec3::NEG_Y, 2.0)
    };
    let height = 10.0;
    let plate = quad(DVec3::new(-3.0, height, -3.0), DVec3::X * 3.0, DVec3::Z * 6.0);
    let tracer = tracer(
        vec![(floor(0.1, 0.0), diffuse(0.5)), (plate, diffuse(0.5))],
        vec![disc],
    );
    let n = 64;
    let layer = direct(&tracer, &chart(&tracer, 0, n, n));
    let half_width = height * (0.5 * diameter_rad).tan();
    let (mut between, mut squares, mut sum) = (0, 0.0, 0.0);
    for (texel, e) in layer.irradiance.iter().enumerate() {
        let t = (middle(texel, n, 0.1)[0] / half_width).clamp(-1.0, 1.0);
        let share = 0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / PI;
        let off = f64::from(e[0]) / 2.0 - share;
        assert!(off.abs() < 0.08, "texel {texel}: {} for {share}", e[0]);
        if share > 0.01 && share < 0.99 {
            between += 1;
            squares += off * off;
            sum += off;
        }
    }
    let count = f64::from(between);
    assert!(between > 64 * 25, "{between} texels lie in the penumbra");
    let (noise, mean) = ((squares / count).sqrt(), sum / count);
    assert!(
        noise < 0.02 && mean.abs() < 1e-3,
        "{noise} from texel to texel, {mean} in the mean"
    );
}

#[test]
fn a_ball_shines_as_its_middle_does_where_all_of_it_is_above_the_horizon() {
    let lamp = Light {
        size: LightSize::Radius { radius_m: 0.5 },
        ..point_light(DVec3::Y, 3.0)
    };
    let tracer = tracer(vec![(floor(0.5, 0.0), diffuse(0.5))], vec![lamp]);
    let n = 32;
    let layer = direct(&tracer, &chart(&tracer, 0, n, n));
    let (largest, mean) = errors(&layer.irradiance, |texel| {
        let [x, z] = middle(texel, n, 0.5);
        3.0 / (x * x + z * z + 1.0).powf(1.5)
    });
    assert!(
        largest < 0.01 && mean < 1e-3,
        "{largest} at most, {mean} in the mean"
    );
}

fn glowing(object: usize, radiance: f64) -> Light {
    light(LightKind::Surface {
        object,
        radiance: Radiance(radiance),
    })
}

fn sided(double_sided: bool) -> Material {
    Material {
        double_sided,
        ..diffuse(0.5)
    }
}

/// A sheet that glows between a floor and a ceiling: upwards, or both ways.
#[test]
fn surfaces_glow_on_the_sides_that_they_have() {
    let sheet = || quad(DVec3::new(-0.5, 0.7, -0.5), DVec3::Z, DVec3::X);
    let ceiling = || quad(DVec3::new(-1.0, 1.4, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
    for double_sided in [true, false] {
        let parts = vec![
            (floor(1.0, 0.0), diffuse(0.5)),
            (sheet(), sided(double_sided)),
            (ceiling(), diffuse(0.5)),
        ];
        let tracer = tracer(parts, vec![glowing(1, 2.0)]);
        let facing_up = tracer.scene().objects[1].mesh.face_normal(0).y > 0.0;
        for (object, lit) in [(0, double_sided || !facing_up), (2, double_sided || facing_up)] {
            let travels = if object == 0 { DVec3::NEG_Y } else { DVec3::Y };
            let side = Side::met(travels, tracer.scene().objects[object].mesh.face_normal(0));
            let layer = direct(&tracer, &chart(&tracer, object, 16, 16).of_side(side));
            if lit {
                let (largest, mean) = errors(&layer.irradiance, |texel| {
                    2.0 * rectangle_sr(middle(texel, 16, 1.0), [-0.5, 0.5], [-0.5, 0.5], 0.7)
                });
                assert!(
                    largest < 0.02 && mean < 2e-3,
                    "{largest} at most, {mean} in the mean"
                );
            } else {
                assert!(layer.irradiance.iter().all(|e| *e == [0.0; 3]));
            }
        }
        let own = direct(&tracer, &chart(&tracer, 1, 4, 4));
        assert!(
            own.irradiance.iter().all(|e| *e == [0.0; 3]),
            "a flat lamp does not light itself"
        );
    }
}

/// Of many triangles, so that it is looked for by samples alone: its dark side sends nothing all the same.
#[test]
fn a_large_sheet_glows_on_its_front_alone() {
    // It faces up.
    let sheet = grid(6, 6, |s, t| DVec3::new(t - 0.5, 0.7, s - 0.5));
    let ceiling = quad(DVec3::new(-1.0, 1.4, -1.0), DVec3::Z * 2.0, DVec3::X * 2.0);
    let parts = vec![
        (floor(1.0, 0.0), diffuse(0.5)),
        (sheet, sided(false)),
        (ceiling, diffuse(0.5)),
    ];
    let tracer = tracer(parts, vec![glowing(1, 2.0)]);
    assert!(tracer.scene().objects[1].mesh.face_normal(0).y > 0.0);
    for (object, is_lit) in [(0, false), (2, true)] {
        let chart = chart(&tracer, object, 8, 8);
        let e_w = flux_w(&chart, &direct(&tracer, &chart));
        assert_eq!(e_w > 0.0, is_lit, "object {object} gets {e_w} W");
    }
}

/// Across its beam a sun gives its normal irradiance, however wide its disc is.
#[test]
fn a_wide_sun_gives_its_normal_irradiance() {
    for degrees in [1.0_f64, 30.0, 90.0] {
        let diameter_rad = degrees.to_radians();
        let wide = Light {
            size: LightSize::Angle { diameter_rad },
            ..sun(DVec3::NEG_Y, 2.0)
        };
        let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![wide]);
        let layer = direct(&tracer, &chart(&tracer, 0, 16, 16));
        let (largest, mean) = errors(&layer.irradiance, |_| 2.0);
        assert!(
            largest < 0.02 && mean < 2e-3,
            "{degrees}°: {largest} at most, {mean} in the mean"
        );
    }
}

/// Far from the world's origin too, what glows is not its own shadow: a box and a ball of many triangles.
#[test]
fn lamps_do_not_shadow_themselves() {
    for offset in [DVec3::ZERO, DVec3::new(1234.5, -777.7, 4321.0)] {
        let place = |mut mesh: Mesh| {
            mesh.positions.iter_mut().for_each(|corner| *corner += offset);
            mesh
        };
        let ball = sphere(DVec3::Y, 0.1, 48, 24);
        let tracer = tracer(
            vec![
                (place(floor(0.5, 0.0)), diffuse(0.5)),
                (place(ball), sided(false)),
            ],
            vec![glowing(1, 5.0)],
        );
        let layer = direct(&tracer, &chart(&tracer, 0, 16, 16));
        let (largest, mean) = errors(&layer.irradiance, |texel| {
            let [x, z] = middle(texel, 16, 0.5);
            PI * 0.01 * 5.0 / (x * x + z * z + 1.0).powf(1.5)
        });
        // The mesh lies within the ball.
        assert!(
            largest < 0.04 && mean < 0.02,
            "at {offset}: {largest} at most, {mean} in the mean"
        );
        let lamp = cuboid(DVec3::new(-0.2, 0.5, -0.2), DVec3::new(0.2, 0.6, 0.2));
        let tracer = crate::scenes::tracer(
            vec![
                (place(floor(0.1, 0.0)), diffuse(0.5)),
                (place(lamp), sided(false)),
            ],
            vec![glowing(1, 5.0)],
        );
        let layer = direct(&tracer, &chart(&tracer, 0, 8, 8));
        let (largest, _) = errors(&layer.irradiance, |texel| {
            5.0 * rectangle_sr(middle(texel, 8, 0.1), [-0.2, 0.2], [-0.2, 0.2], 0.5)
        });
        assert!(largest < 2e-3, "at {offset}: {largest}");
    }
}

/// On, at and just above its receiver a lamp sends no more than πL, and no number that is none.
#[test]
fn a_lamp_on_its_receiver_stays_finite() {
    for (height, double_sided) in [(0.0, false), (0.0, true), (1e-12, true), (1e-6, true)] {
        let lamp = quad(DVec3::new(-0.5, height, -0.5), DVec3::X, DVec3::Z);
        for many in [false, true] {
            let lamp = if many {
                sphere(DVec3::Y * height, 0.5, 24, 12)
            } else {
                lamp.clone()
            };
            let parts = vec![(floor(1.0, 0.0), diffuse(0.5)), (lamp, sided(double_sided))];
            let tracer = tracer(parts, vec![glowing(1, 1e30)]);
            let layer = direct(&tracer, &chart(&tracer, 0, 20, 20));
            let most = if many { 2.0 * PI } else { PI };
            for e in layer.irradiance {
                let share = f64::from(e[0]) / 1e30;
                assert!((0.0..1.01 * most).contains(&share), "{height}, {many}: {share}");
            }
        }
    }
}

#[test]
fn nothing_comes_from_a_lamp_without_area_or_a_black_sky() {
    let flat = |corner: DVec3| Mesh {
        positions: vec![DVec3::Y, DVec3::Y + corner, DVec3::Y + 2.0 * corner],
        normals: vec![DVec3::NEG_Y; 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let parts = vec![(floor(1.0, 0.0), diffuse(0.5)), (flat(DVec3::X), diffuse(0.5))];
    let lamps = vec![
        glowing(1, 1.0),
        panel(0.0, 1.0, 1.0, PanelShape::Disc),
        light(LightKind::Environment { scale: 1.0 }),
    ];
    let black = Environment::new(2, 1, vec![[0.0; 3]; 2]).expect("sound");
    for sky in [None, Some(Arc::new(black))] {
        let mut scene = scene(parts.clone(), lamps.clone());
        scene.environment = sky;
        let tracer = Tracer::new(Arc::new(scene));
        let layer = direct(&tracer, &chart(&tracer, 0, 4, 4));
        assert!(layer.irradiance.iter().all(|e| *e == [0.0; 3]));
    }
}

#[test]
fn soft_light_has_the_same_bytes_for_any_number_of_threads() {
    let ball = sphere(DVec3::new(0.0, 0.4, 0.0), 0.3, 24, 12);
    let sky = Environment::new(2, 2, vec![[1.0, 0.5, 0.2], [0.3; 3], [0.0; 3], [0.1; 3]]).expect("sound");
    let parts = vec![(floor(1.0, 0.0), diffuse(0.5)), (ball, diffuse(0.5))];
    let mut scene = scene(
        parts,
        vec![
            panel(0.2, 1.5, 1.0, PanelShape::Disc),
            light(LightKind::Environment { scale: 1.0 }),
        ],
    );
    scene.environment = Some(Arc::new(sky));
    scene.lights[0].colour = LinearSrgb::new(1.0, 0.5, 0.25);
    let tracer = Tracer::new(Arc::new(scene));
    let charts = [chart(&tracer, 0, 24, 24), chart(&tracer, 1, 32, 32)];
    let bake = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads");
        let lights = &tracer.scene().lights;
        let layers = pool.install(|| {
            bake_direct(
                &tracer,
                lights,
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
    assert_eq!(one, bake(3));
}
