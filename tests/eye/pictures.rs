//! The CPU eye pass on scenes of known radiance.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use nephroid::eye_pass::reference::{ChainLimits, ReferenceSettings, first_hits, render};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::geometry::Ray;
use nephroid::illumination::{IlluminationMap, Layer};
use nephroid::optics::LinearSrgb;
use nephroid::optics::fresnel::{dielectric_reflectance, thin_wall_reflectance};
use nephroid::progress::Control;
use nephroid::scene::texture::Wrap;
use nephroid::scene::{Camera, Material, SurfaceKind, Texture, TextureRef, Volume};
use nephroid::settings::LayerKind;
use nephroid::transport::Tracer;

use crate::meshes::{cuboid, floor, quad, sphere};
use crate::scenes::{chart, diffuse, scene, surface, tracer};

const WATER: f64 = 1.333;
const ALBEDO: f64 = 0.6;
/// Irradiance on the floors of these tests [W/m²].
const E: f64 = 50.0;
/// What those floors send [W/(m² sr)].
const FLOOR: f64 = ALBEDO * E / PI;
/// Radiance of the background [W/(m² sr)].
const SKY: f64 = 3.0;

/// A map of an object with the same irradiance all over.
fn uniform_map(tracer: &Tracer, object: usize, irradiance: f64) -> IlluminationMap {
    map_of(tracer, object, 2, vec![[irradiance as f32; 3]; 4])
}

fn map_of(tracer: &Tracer, object: usize, width: usize, irradiance: Vec<[f32; 3]>) -> IlluminationMap {
    IlluminationMap {
        chart: Arc::new(chart(tracer, object, width, irradiance.len() / width)),
        layers: vec![Layer {
            kind: LayerKind::Direct,
            irradiance,
        }],
        error: None,
        estimated_relative_rmse: None,
    }
}

fn view(position: DVec3, target: DVec3, fov_degrees: f64, width: u32, height: u32) -> View {
    View {
        camera: Camera::look_at("eye", position, target, fov_degrees.to_radians()),
        width,
        height,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::grey(SKY),
    }
}

/// Every chain to the end: what is left out is below a billionth.
fn exact() -> ReferenceSettings {
    ReferenceSettings {
        samples_per_side: 1,
        limits: ChainLimits {
            max_depth: 64,
            branch_threshold: 1e-10,
            ..ChainLimits::default()
        },
        ..ReferenceSettings::default()
    }
}

fn picture(tracer: &Tracer, maps: &[IlluminationMap], view: &View) -> Picture {
    render(tracer, maps, view, &exact(), &(), &Control::default()).expect("nobody cancels")
}

/// The direction through a pixel's centre.
fn direction(view: &View, pixel: usize) -> DVec3 {
    let (column, row) = (pixel as u32 % view.width, pixel as u32 / view.width);
    let x = (f64::from(column) + 0.5) / f64::from(view.width) * 2.0 - 1.0;
    let y = 1.0 - (f64::from(row) + 0.5) / f64::from(view.height) * 2.0;
    view.camera
        .direction(x, y, f64::from(view.width) / f64::from(view.height))
}

/// Fails unless every pixel has the expected grey, which may depend on its direction.
#[track_caller]
fn assert_radiance(picture: &Picture, view: &View, expected: impl Fn(DVec3) -> f64) {
    assert_eq!(picture.radiance.len(), (view.width * view.height) as usize);
    for (pixel, radiance) in picture.radiance.iter().enumerate() {
        let expected = expected(direction(view, pixel));
        for channel in radiance {
            assert!(
                (f64::from(*channel) - expected).abs() <= 1e-6 * expected,
                "pixel {pixel}: {channel} for {expected}"
            );
        }
    }
}

/// A large floor of albedo 0.6 and one more object; the floor's map is uniform.
fn over_a_lit_floor(other: nephroid::scene::Mesh, material: Material) -> (Tracer, Vec<IlluminationMap>) {
    let tracer = tracer(
        vec![(floor(100.0, 0.0), diffuse(ALBEDO)), (other, material)],
        vec![],
    );
    let maps = vec![uniform_map(&tracer, 0, E)];
    (tracer, maps)
}

/// Reflectance and transmittance of a slab, all orders, each crossing keeping the share `kept`.
fn slab(cos_incident: f64, eta: f64, kept: f64) -> (f64, f64) {
    let r = dielectric_reflectance(cos_incident, eta);
    let orders = 1.0 / (1.0 - r * r * kept * kept);
    let through = (1.0 - r) * (1.0 - r) * kept * orders;
    (r + (1.0 - r) * (1.0 - r) * r * kept * kept * orders, through)
}

#[test]
fn a_lit_floor_sends_albedo_times_irradiance_over_pi() {
    let tracer = tracer(vec![(floor(100.0, 0.0), diffuse(ALBEDO))], vec![]);
    let maps = [uniform_map(&tracer, 0, E)];
    let view = view(DVec3::new(0.0, 2.0, 3.0), DVec3::ZERO, 40.0, 9, 7);
    assert_radiance(&picture(&tracer, &maps, &view), &view, |_| FLOOR);
    // Without its map it is black.
    assert_radiance(&picture(&tracer, &[], &view), &view, |_| 0.0);
}

#[test]
fn a_floor_under_water_is_dimmed_by_n_squared_from_above() {
    for water in [
        floor(90.0, 1.0),
        cuboid(DVec3::new(-90.0, -0.5, -90.0), DVec3::new(90.0, 1.0, 90.0)),
    ] {
        let (tracer, maps) = over_a_lit_floor(water, surface(SurfaceKind::Dielectric, WATER));
        for target in [DVec3::new(0.0, 0.0, 1e-3), DVec3::new(3.0, 0.0, 2.0)] {
            let view = view(DVec3::new(0.0, 3.0, 0.0), target, 30.0, 7, 5);
            assert_radiance(&picture(&tracer, &maps, &view), &view, |direction| {
                let r = dielectric_reflectance(-direction.y, WATER);
                (1.0 - r) * FLOOR / (WATER * WATER) + r * SKY
            });
        }
    }
}

#[test]
fn from_within_the_water_the_floor_is_as_bright_as_it_is() {
    for water in [
        floor(90.0, 1.0),
        cuboid(DVec3::new(-90.0, -0.5, -90.0), DVec3::new(90.0, 1.0, 90.0)),
    ] {
        let (tracer, maps) = over_a_lit_floor(water, surface(SurfaceKind::Dielectric, WATER));
        let eye = DVec3::new(0.2, 0.5, 0.1);
        let down = view(eye, eye - DVec3::new(0.3, 1.0, 0.0), 40.0, 5, 5);
        assert_radiance(&picture(&tracer, &maps, &down), &down, |_| FLOOR);
        // Upwards: the sky n² brighter within Snell's window, the mirrored floor outside of it.
        let up = view(eye, eye + DVec3::new(0.9, 1.0, 0.0), 80.0, 31, 21);
        let picture = picture(&tracer, &maps, &up);
        assert_radiance(&picture, &up, |direction| {
            let r = dielectric_reflectance(direction.y, 1.0 / WATER);
            r * FLOOR + (1.0 - r) * SKY * WATER * WATER
        });
        let total = (0..picture.radiance.len())
            .filter(|&pixel| direction(&up, pixel).y < (1.0 - 1.0 / (WATER * WATER)).sqrt())
            .count();
        assert!(
            total > 100 && total < 551,
            "{total} pixels are outside of Snell's window, of 651"
        );
    }
}

#[test]
fn through_a_slab_the_floor_loses_its_reflectance_only() {
    let glass = cuboid(DVec3::new(-90.0, 1.0, -90.0), DVec3::new(90.0, 1.1, 90.0));
    let (tracer, maps) = over_a_lit_floor(glass, surface(SurfaceKind::Dielectric, 1.5));
    for target in [DVec3::new(0.0, 0.0, 1e-3), DVec3::new(4.0, 0.0, 2.0)] {
        let view = view(DVec3::new(0.0, 3.0, 0.0), target, 30.0, 5, 5);
        assert_radiance(&picture(&tracer, &maps, &view), &view, |direction| {
            let (r, t) = slab(-direction.y, 1.5, 1.0);
            assert!((r + t - 1.0).abs() < 1e-12);
            t * FLOOR + r * SKY
        });
    }
}

#[test]
fn a_slab_under_water_counts_by_its_contrast_with_the_water() {
    let parts = vec![
        (floor(100.0, 0.0), diffuse(ALBEDO)),
        (floor(90.0, 3.0), surface(SurfaceKind::Dielectric, WATER)),
        (
            cuboid(DVec3::new(-80.0, 1.0, -80.0), DVec3::new(80.0, 1.1, 80.0)),
            surface(SurfaceKind::Dielectric, 1.5),
        ),
    ];
    let tracer = tracer(parts, vec![]);
    let maps = [uniform_map(&tracer, 0, E)];
    let eye = DVec3::new(0.0, 2.0, 0.0);
    let view = view(eye, eye - DVec3::Y, 30.0, 5, 5);
    assert_radiance(&picture(&tracer, &maps, &view), &view, |direction| {
        let (r, t) = slab(-direction.y, 1.5 / WATER, 1.0);
        // What the slab sends back reaches the surface from below, there the sky or again the slab …
        let (surface_r, surface_t) = {
            let r = dielectric_reflectance(-direction.y, 1.0 / WATER);
            (r, (1.0 - r) * WATER * WATER)
        };
        // … and so on, between slab and surface.
        let orders = 1.0 / (1.0 - r * surface_r);
        t * FLOOR * orders + r * surface_t * SKY * orders
    });
}

#[test]
fn coloured_glass_keeps_a_share_per_length() {
    let (depth, distance, colour) = (0.1, 0.07, LinearSrgb::new(0.9, 0.5, 0.2));
    let glass = cuboid(DVec3::new(-90.0, 1.0, -90.0), DVec3::new(90.0, 1.0 + depth, 90.0));
    let material = Material {
        volume: Some(Volume {
            attenuation_distance_m: distance,
            attenuation_colour: colour,
        }),
        ..surface(SurfaceKind::Dielectric, 1.5)
    };
    let (tracer, maps) = over_a_lit_floor(glass, material);
    let view = view(DVec3::new(0.0, 3.0, 0.0), DVec3::new(1.0, 0.0, 0.5), 20.0, 3, 3);
    let picture = picture(&tracer, &maps, &view);
    for (pixel, radiance) in picture.radiance.iter().enumerate() {
        let cos_i = -direction(&view, pixel).y;
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / 2.25).sqrt();
        for (channel, share) in radiance.iter().zip(colour.to_array()) {
            let (r, t) = slab(cos_i, 1.5, share.powf(depth / cos_t / distance));
            let expected = t * FLOOR + r * SKY;
            assert!(
                (f64::from(*channel) / expected - 1.0).abs() < 1e-6,
                "pixel {pixel}"
            );
        }
    }
}

/// A sheet whose back is not drawn may lie anywhere on the way: what it lies in absorbs as without it.
#[test]
fn backs_that_are_not_drawn_shorten_no_way_through_coloured_water() {
    let colour = LinearSrgb::new(0.9, 0.5, 0.2);
    let water = Material {
        volume: Some(Volume {
            attenuation_distance_m: 0.7,
            attenuation_colour: colour,
        }),
        ..surface(SurfaceKind::Dielectric, WATER)
    };
    let sheet = Material {
        double_sided: false,
        ..diffuse(0.5)
    };
    // It faces down, away from the eye.
    let below = quad(DVec3::new(-5.0, 0.6, -5.0), DVec3::Z * 10.0, DVec3::X * 10.0);
    let tracer = tracer(
        vec![
            (floor(100.0, 0.0), diffuse(ALBEDO)),
            (
                cuboid(DVec3::new(-90.0, -0.5, -90.0), DVec3::new(90.0, 1.0, 90.0)),
                water,
            ),
            (below, sheet),
        ],
        vec![],
    );
    let maps = [uniform_map(&tracer, 0, E)];
    let view = view(DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.4, 0.0, 0.2), 20.0, 3, 3);
    for (pixel, radiance) in picture(&tracer, &maps, &view).radiance.iter().enumerate() {
        let cos_i = -direction(&view, pixel).y;
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (WATER * WATER)).sqrt();
        let r = dielectric_reflectance(cos_i, WATER);
        for (channel, share) in radiance.iter().zip(colour.to_array()) {
            let left = share.powf(1.0 / cos_t / 0.7);
            let expected = (1.0 - r) * left * FLOOR / (WATER * WATER) + r * SKY;
            assert!(
                (f64::from(*channel) / expected - 1.0).abs() < 1e-6,
                "pixel {pixel}: {channel} for {expected}"
            );
        }
    }
}

#[test]
fn a_thin_wall_reflects_by_all_its_orders_and_tints() {
    let tint = LinearSrgb::new(1.0, 0.5, 0.25);
    let pane = Material {
        base_colour: tint,
        ..surface(SurfaceKind::ThinWall, 1.5)
    };
    let (tracer, maps) = over_a_lit_floor(floor(90.0, 1.0), pane);
    let view = view(DVec3::new(0.0, 3.0, 0.0), DVec3::new(2.0, 0.0, 0.5), 20.0, 3, 3);
    for (pixel, radiance) in picture(&tracer, &maps, &view).radiance.iter().enumerate() {
        let r = thin_wall_reflectance(-direction(&view, pixel).y, 1.5);
        for (channel, tint) in radiance.iter().zip(tint.to_array()) {
            let expected = (1.0 - r) * tint * FLOOR + r * SKY;
            assert!(
                (f64::from(*channel) / expected - 1.0).abs() < 1e-6,
                "pixel {pixel}"
            );
        }
    }
}

#[test]
fn a_polished_floor_sends_what_its_polish_lets_out() {
    let material = Material {
        base_colour: LinearSrgb::grey(ALBEDO),
        ..surface(SurfaceKind::Mixed, 1.5)
    };
    let tracer = tracer(vec![(floor(100.0, 0.0), material)], vec![]);
    let maps = [uniform_map(&tracer, 0, E)];
    let view = view(DVec3::new(0.0, 2.0, 3.0), DVec3::ZERO, 40.0, 5, 5);
    assert_radiance(&picture(&tracer, &maps, &view), &view, |direction| {
        let f = dielectric_reflectance(-direction.y, 1.5);
        (1.0 - f) * FLOOR + f * SKY
    });
}

/// A small shining square beside a mirror shows at the pixel where its virtual image lies.
#[test]
fn a_mirror_shows_the_virtual_image_at_the_right_pixel() {
    let centre = DVec3::new(0.6, 0.3, 1.0);
    let shining = Material {
        emitted_radiance: LinearSrgb::new(7.0, 5.0, 2.0),
        ..diffuse(0.0)
    };
    let lamp = quad(centre - DVec3::new(0.1, 0.1, 0.0), DVec3::X * 0.2, DVec3::Y * 0.2);
    let metal = Material {
        base_colour: LinearSrgb::new(0.9, 0.8, 0.5),
        ..surface(SurfaceKind::Mirror, 1.5)
    };
    // The mirror is the plane z = −1; the image of a point lies at z → −2 − z.
    let mirror = quad(DVec3::new(-3.0, -3.0, -1.0), DVec3::X * 6.0, DVec3::Y * 6.0);
    let tracer = tracer(vec![(lamp, shining), (mirror, metal)], vec![]);
    let eye = DVec3::new(-0.4, 0.1, 2.5);
    let view = view(eye, DVec3::new(0.0, 0.0, -1.0), 50.0, 240, 160);
    let picture = picture(&tracer, &[], &view);
    let (virtual_half, virtual_centre) = (0.1, DVec3::new(centre.x, centre.y, -2.0 - centre.z));
    let (mut inside, mut outside) = (0, 0);
    for (pixel, radiance) in picture.radiance.iter().enumerate() {
        let ray = direction(&view, pixel);
        let hits_lamp = |depth: f64, centre: DVec3| {
            let at = eye + ray * ((depth - eye.z) / ray.z);
            let off = (at - centre).abs();
            off.x < virtual_half && off.y < virtual_half
        };
        if hits_lamp(centre.z, centre) {
            continue;
        }
        if hits_lamp(virtual_centre.z, virtual_centre) {
            inside += 1;
            // Schlick's metal under the lamp's own radiance.
            let grazing = (1.0 + ray.z).powi(5);
            for (channel, (sent, f0)) in radiance.iter().zip([(7.0, 0.9), (5.0, 0.8), (2.0, 0.5)]) {
                let expected = sent * (f0 + (1.0 - f0) * grazing);
                assert!(
                    (f64::from(*channel) / expected - 1.0).abs() < 1e-6,
                    "pixel {pixel}: {radiance:?}"
                );
            }
        } else {
            outside += 1;
            assert!(
                f64::from(radiance[0]) <= SKY,
                "pixel {pixel}: the lamp's image is where it should not be"
            );
        }
    }
    assert!(inside > 20 && outside > 30_000, "{inside} {outside}");
}

/// Straight through the middle of a ball nothing is bent: the floor's radiance less the reflectance of a slab.
#[test]
fn the_centre_ray_goes_straight_through_a_ball() {
    let ball = sphere(DVec3::new(0.0, 2.0, 0.0), 0.5, 48, 24);
    let tracer = tracer(
        vec![
            (floor(2.0, 0.0), diffuse(ALBEDO)),
            (ball, surface(SurfaceKind::Dielectric, 1.5)),
        ],
        vec![],
    );
    // Bright in the middle only: a bent ray would miss it.
    let n = 81;
    let irradiance = (0..n * n)
        .map(|texel: usize| {
            let off = (texel % n).abs_diff(n / 2).max((texel / n).abs_diff(n / 2));
            if off <= 1 { [E as f32; 3] } else { [0.0; 3] }
        })
        .collect();
    let maps = [map_of(&tracer, 0, n, irradiance)];
    let view = view(DVec3::new(0.0, 5.0, 0.0), DVec3::ZERO, 1.0, 1, 1);
    assert_radiance(&picture(&tracer, &maps, &view), &view, |_| {
        let (r, t) = slab(1.0, 1.5, 1.0);
        t * FLOOR + r * SKY
    });
}

/// Between texel centres the map is a straight line, beyond the outermost ones it goes on.
#[test]
fn maps_are_read_bilinearly() {
    let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(1.0))], vec![]);
    let values = [[1.0f32; 3], [3.0; 3], [5.0; 3], [11.0; 3]];
    let maps = [map_of(&tracer, 0, 2, values.to_vec())];
    for (x, z, expected) in [
        (-0.5, -0.5, 1.0),
        (0.5, -0.5, 3.0),
        (0.0, -0.5, 2.0),
        (0.0, 0.0, 5.0),
        (0.25, 0.5, 9.5),
        (-0.9, -0.9, 1.0),
        (0.5, 0.99, 11.0),
    ] {
        let point = DVec3::new(x, 0.0, z);
        let view = view(point + DVec3::new(0.1, 1.0, 0.2), point, 1.0, 1, 1);
        assert_radiance(&picture(&tracer, &maps, &view), &view, |_| expected / PI);
    }
}

#[test]
fn textures_tint_and_emission_adds() {
    let mut scene = scene(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![]);
    scene.textures.push(Arc::new(Texture {
        name: "two by two".into(),
        width: 2,
        height: 2,
        rgba: vec![
            [255, 0, 0, 255],
            [0, 255, 0, 255],
            [0, 0, 255, 255],
            [188, 188, 188, 255],
        ],
        wrap: [Wrap::ClampToEdge; 2],
    }));
    scene.materials[0].base_colour_texture = Some(TextureRef {
        texture: 0,
        uv_set: 0,
        uv_transform: DMat3::IDENTITY,
    });
    scene.materials[0].emitted_radiance = LinearSrgb::new(0.25, 0.0, 0.0);
    let tracer = Tracer::new(Arc::new(scene));
    let maps = [uniform_map(&tracer, 0, PI)];
    let grey = LinearSrgb::decode_channel(188);
    for (x, z, expected) in [
        (-0.5, -0.5, [0.75, 0.0, 0.0]),
        (0.5, -0.5, [0.25, 0.5, 0.0]),
        (-0.5, 0.5, [0.25, 0.0, 0.5]),
        (0.5, 0.5, [0.25 + 0.5 * grey, 0.5 * grey, 0.5 * grey]),
    ] {
        let point = DVec3::new(x, 0.0, z);
        let view = view(point + DVec3::Y, point, 1.0, 1, 1);
        for (channel, expected) in picture(&tracer, &maps, &view).radiance[0].iter().zip(expected) {
            assert!((f64::from(*channel) - expected).abs() < 1e-6, "at {x}, {z}");
        }
    }
}

/// A strip of texels, red by their number.
fn strip(wrap: Wrap) -> Texture {
    Texture {
        name: "strip".into(),
        width: 3,
        height: 1,
        rgba: (0..3).map(|column| [column, 0, 0, 255]).collect(),
        wrap: [wrap; 2],
    }
}

#[test]
fn images_go_on_beyond_their_borders_as_they_say() {
    for (wrap, expected) in [
        (Wrap::Repeat, [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]),
        (Wrap::MirroredRepeat, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]),
        (Wrap::ClampToEdge, [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]),
    ] {
        let strip = strip(wrap);
        let found: Vec<u8> = (-4..8)
            .map(|column| strip.code(f64::from(column), 0.0)[0])
            .collect();
        assert_eq!(found, expected, "{wrap:?}");
    }
}

#[test]
fn textures_follow_the_coordinates_that_they_name() {
    let mut mesh = floor(1.0, 0.0);
    let middles = |column: f64| Some(vec![DVec2::new((column + 0.5) / 3.0, 0.5); 4]);
    (mesh.uv0, mesh.uv1) = (middles(1.0), middles(2.0));
    for uv_set in [0, 1] {
        let material = Material {
            base_colour_texture: Some(TextureRef {
                texture: 0,
                uv_set,
                uv_transform: DMat3::IDENTITY,
            }),
            ..diffuse(1.0)
        };
        let mut scene = scene(vec![(mesh.clone(), material)], vec![]);
        scene.textures.push(Arc::new(strip(Wrap::Repeat)));
        let tracer = Tracer::new(Arc::new(scene));
        let ray = Ray {
            origin: DVec3::new(0.1, 1.0, 0.2),
            direction: DVec3::NEG_Y,
        };
        let hit = tracer.closest_hit(&ray).expect("the floor");
        let expected = LinearSrgb::decode_channel(uv_set as u8 + 1);
        assert!(
            (tracer.base_colour(&hit).r - expected).abs() < 1e-12,
            "set {uv_set}"
        );
    }
}

/// The back of a single-sided wall is not drawn: one looks into the room.
#[test]
fn backs_of_single_sided_walls_are_not_drawn() {
    for (double_sided, seen) in [(true, 1), (false, 0)] {
        let wall = Material {
            double_sided,
            ..diffuse(0.5)
        };
        let ceiling = quad(DVec3::new(-5.0, 1.0, -5.0), DVec3::Z * 10.0, DVec3::X * 10.0);
        let tracer = tracer(vec![(floor(5.0, 0.0), diffuse(ALBEDO)), (ceiling, wall)], vec![]);
        let view = view(DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.0, 0.0, 0.1), 30.0, 4, 3);
        assert_eq!(first_hits(&tracer, &view), vec![Some(seen); 12]);
        let maps = [uniform_map(&tracer, 0, E), uniform_map(&tracer, 1, 0.0)];
        let expected = if double_sided { 0.0 } else { FLOOR };
        assert_radiance(&picture(&tracer, &maps, &view), &view, |_| expected);
    }
}

#[test]
fn first_hits_name_the_object_at_each_pixel_row_0_on_top() {
    let tracer = tracer(
        vec![
            (
                quad(DVec3::new(-1.0, 0.0, -5.0), DVec3::X, DVec3::Y),
                diffuse(0.5),
            ),
            (
                quad(DVec3::new(0.0, -1.0, -5.0), DVec3::X, DVec3::Y),
                diffuse(0.5),
            ),
        ],
        vec![],
    );
    let view = view(DVec3::ZERO, DVec3::NEG_Z, 2.0 * 0.2f64.atan().to_degrees(), 2, 2);
    assert_eq!(first_hits(&tracer, &view), [Some(0), None, None, Some(1)]);
}

/// A straight edge across a picture: supersampled, its pixels hold the share that is covered.
#[test]
fn more_samples_soften_edges() {
    let tracer = tracer(vec![(floor(100.0, 0.0), diffuse(ALBEDO))], vec![]);
    let maps = [uniform_map(&tracer, 0, E)];
    // The horizon of a floor that ends 100 m away runs through the middle row.
    let mut view = view(
        DVec3::new(0.0, 1.0, 0.0),
        DVec3::new(0.0, 1.0 - 0.01, -1.0),
        1.0,
        1,
        3,
    );
    view.background = LinearSrgb::BLACK;
    let at = |samples_per_side: u32| {
        let settings = ReferenceSettings {
            samples_per_side,
            ..exact()
        };
        let picture =
            render(&tracer, &maps, &view, &settings, &(), &Control::default()).expect("nobody cancels");
        picture
            .radiance
            .iter()
            .map(|pixel| f64::from(pixel[0]) / FLOOR)
            .collect::<Vec<_>>()
    };
    let fine = at(32);
    assert!(fine[0] == 0.0 && (fine[2] - 1.0).abs() < 1e-6);
    assert!(
        (fine[1] - 0.5).abs() < 0.05,
        "the horizon is in the middle: {}",
        fine[1]
    );
    assert!((at(4)[1] - fine[1]).abs() <= 0.25);
    assert!(
        at(1)
            .iter()
            .all(|share| *share < 1e-6 || (share - 1.0).abs() < 1e-6)
    );
}

#[test]
fn the_same_picture_for_any_number_of_threads() {
    let ball = sphere(DVec3::new(0.0, 1.0, 0.0), 0.5, 24, 12);
    let (tracer, maps) = over_a_lit_floor(ball, surface(SurfaceKind::Dielectric, 1.5));
    let view = view(DVec3::new(0.0, 2.0, 3.0), DVec3::new(0.0, 1.0, 0.0), 40.0, 40, 30);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads");
        pool.install(|| picture(&tracer, &maps, &view))
    };
    let one = with(1);
    assert_eq!(one, with(3));
    // White light in a closed world: nothing is brighter than n² times the brightest source.
    let brightest = 2.25 * FLOOR.max(SKY);
    assert!(
        one.radiance
            .iter()
            .flatten()
            .all(|channel| f64::from(*channel) <= brightest)
    );
}

/// In a furnace, where all that can be seen has one radiance, clear and white things vanish, whatever their shape.
#[test]
fn clear_things_vanish_in_a_furnace() {
    let ball = sphere(DVec3::new(0.0, 1.0, 0.0), 0.5, 24, 12);
    for kind in [
        SurfaceKind::Dielectric,
        SurfaceKind::ThinWall,
        SurfaceKind::Mirror,
    ] {
        let tracer = tracer(
            vec![
                (floor(100.0, 0.0), diffuse(1.0)),
                (ball.clone(), surface(kind, 1.5)),
            ],
            vec![],
        );
        let maps = [uniform_map(&tracer, 0, PI * SKY)];
        let view = view(DVec3::new(0.0, 2.0, 3.0), DVec3::new(0.0, 1.0, 0.0), 30.0, 33, 33);
        for (pixel, radiance) in picture(&tracer, &maps, &view).radiance.iter().enumerate() {
            assert!(
                (f64::from(radiance[0]) / SKY - 1.0).abs() < 1e-4,
                "{kind:?}, pixel {pixel}: {} for {SKY}",
                radiance[0]
            );
        }
    }
}

#[test]
fn a_cancelled_picture_is_an_error() {
    let tracer = tracer(vec![(floor(1.0, 0.0), diffuse(0.5))], vec![]);
    let view = view(DVec3::Y, DVec3::ZERO, 30.0, 4, 4);
    let control = Control::default();
    control.cancel();
    assert!(render(&tracer, &[], &view, &exact(), &(), &control).is_err());
}

/// The look-up of the map follows the chart's coordinates, not the mesh's.
#[test]
fn maps_follow_their_chart() {
    let mut mesh = floor(1.0, 0.0);
    // u runs against x.
    mesh.uv0 = mesh
        .uv0
        .map(|set| set.into_iter().map(|uv| DVec2::new(1.0 - uv.x, uv.y)).collect());
    let tracer = tracer(vec![(mesh, diffuse(1.0))], vec![]);
    let maps = [map_of(&tracer, 0, 2, vec![[1.0; 3], [2.0; 3]])];
    for (x, expected) in [(-0.5, 2.0), (0.5, 1.0)] {
        let view = view(DVec3::new(x, 1.0, 0.0), DVec3::new(x, 0.0, 0.0), 1.0, 1, 1);
        assert_radiance(&picture(&tracer, &maps, &view), &view, |_| expected / PI);
    }
}
