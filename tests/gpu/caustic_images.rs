//! The ball's caustic seen by way of a second glass ball and of a mirror: where the laws of optics put it.

use std::io::Write as _;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use nephroid::eye_pass::reference::first_hits;
use nephroid::eye_pass::renderer::{EyeQuality, Renderer};
use nephroid::eye_pass::{Picture, ToneMap, View};
use nephroid::geometry::Ray;
use nephroid::gpu::Gpu;
use nephroid::illumination::IlluminationMap;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::{Camera, Scene};
use nephroid::session::BakeSession;
use nephroid::settings::{BakeSettings, MapResolution};
use nephroid::transport::{MediumStack, Tracer};
use nephroid::units::Flux;

use crate::chain_laws::direction;
use crate::device::gpu;

/// Largest distance between the brightest pixel and where it should be [pixels].
const LARGEST_SLIP: f64 = 2.0;
/// Of the mirror's plane [m].
const MIRROR_Z: f64 = -0.8;
const PIXELS: u32 = 240;

const FLOOR: usize = 0;
const SECOND_BALL: usize = 2;
const MIRROR: usize = 3;

/// The glass ball of the reference set under its lamp, a second ball of the given index before it and a mirror behind.
fn scene(second_ior: f64) -> Arc<Scene> {
    let mut scene = parts::reference_scene(0.6);
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 5);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let second = shapes::sphere(DVec3::new(0.19, 0.4, 0.63), 0.15, 5);
    parts::add(
        &mut scene,
        "second ball",
        second,
        parts::dielectric("other glass", second_ior),
    );
    let centre = DVec3::new(0.1, 0.41, MIRROR_Z);
    let mirror = shapes::rectangle(centre, DVec3::X * 0.5, DVec3::Y * 0.4);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    let lamp = DVec3::new(0.0, 3.0, 0.0);
    scene.lights.push(parts::point_light("light", lamp, Flux(100.0)));
    Arc::new(scene)
}

fn view(eye: DVec3, target: DVec3, fov_degrees: f64) -> View {
    View {
        camera: Camera::look_at("eye", eye, target, fov_degrees.to_radians()),
        width: PIXELS,
        height: PIXELS,
        exposure_stops: 0.0,
        tone_map: ToneMap::None,
        background: LinearSrgb::BLACK,
    }
}

/// A lit scene, and the middle of its brightest texel.
struct Lit {
    scene: Arc<Scene>,
    tracer: Arc<Tracer>,
    maps: Vec<IlluminationMap>,
    brightest: DVec3,
}

impl Lit {
    fn new() -> Self {
        let scene = scene(1.5);
        // An odd number of texels: one of them is in the middle.
        let settings = BakeSettings {
            density_per_sr: 20_000.0,
            map_resolution: MapResolution::Fixed {
                width: 65,
                height: 65,
            },
            ..Default::default()
        };
        let mut session = BakeSession::new(scene.clone()).expect("the scene is sound");
        let baked = session.bake(&settings, &(), &Default::default());
        let maps = baked.expect("it bakes").maps;
        let map = maps
            .iter()
            .find(|map| map.chart.object() == FLOOR)
            .expect("the floor");
        let irradiance = map.total();
        let by_light = |a: &usize, b: &usize| irradiance[*a][1].total_cmp(&irradiance[*b][1]);
        let texel = (0..irradiance.len()).max_by(by_light).expect("texels");
        let uv = DVec2::new((texel % 65) as f64 + 0.5, (texel / 65) as f64 + 0.5) / 65.0;
        let brightest = place_of(&scene, map, uv);
        assert!(
            brightest.length() < 0.02,
            "the caustic's middle is at {brightest}"
        );
        Self {
            tracer: session.tracer(),
            scene,
            maps,
            brightest,
        }
    }

    fn on_gpu(&self, gpu: &Gpu, view: &View) -> Picture {
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let mut renderer = Renderer::new(gpu, &self.scene, format, 1).expect("it is uploaded");
        renderer.set_quality(EyeQuality {
            minifies: false,
            ..EyeQuality::STILL
        });
        renderer
            .set_maps(gpu, &self.scene, &self.maps)
            .expect("the maps fit");
        let picture = renderer.radiance(gpu, view).expect("it renders");
        assert_eq!(gpu.take_error(), None);
        picture
    }

    /// The brightest of the pixels that show an object.
    fn brightest_pixel(&self, picture: &Picture, view: &View, object: usize) -> DVec2 {
        let hits = first_hits(&self.tracer, view);
        let shown = (0..hits.len()).filter(|pixel| hits[*pixel] == Some(object));
        let by_light = |a: &usize, b: &usize| picture.radiance[*a][1].total_cmp(&picture.radiance[*b][1]);
        let brightest = shown.max_by(by_light).expect("it is in view");
        assert!(picture.radiance[brightest][1] > 0.0);
        pixel_place(brightest)
    }
}

/// The place of coordinates on the floor.
fn place_of(scene: &Scene, map: &IlluminationMap, uv: DVec2) -> DVec3 {
    let mesh = &scene.objects[FLOOR].mesh;
    for (triangle, [a, b, c]) in map.chart.corner_uvs.iter().enumerate() {
        let area = (*b - *a).perp_dot(*c - *a);
        let weights = [
            (*b - uv).perp_dot(*c - uv),
            (*c - uv).perp_dot(*a - uv),
            (*a - uv).perp_dot(*b - uv),
        ];
        let [wa, wb, wc] = weights.map(|weight| weight / area);
        if wa.min(wb).min(wc) >= -1e-9 {
            let [a, b, c] = mesh.corners(triangle);
            return a * wa + b * wb + c * wc;
        }
    }
    panic!("{uv} lies on no triangle");
}

fn pixel_place(pixel: usize) -> DVec2 {
    let side = PIXELS as usize;
    DVec2::new((pixel % side) as f64 + 0.5, (pixel / side) as f64 + 0.5)
}

/// Where a point shows in a picture [pixels].
fn projected(view: &View, point: DVec3) -> DVec2 {
    let camera = &view.camera;
    let off = point - camera.position;
    let half = (0.5 * camera.vertical_fov_rad).tan() * off.dot(camera.forward);
    let place = DVec2::new(off.dot(camera.right()), -off.dot(camera.up)) / half;
    (place + 1.0) * (0.5 * f64::from(PIXELS))
}

/// Where a ray through the second ball, bent twice, comes down on the floor.
fn landing(tracer: &Tracer, origin: DVec3, direction: DVec3) -> Option<DVec3> {
    let (mut ray, mut media) = (Ray { origin, direction }, MediumStack::default());
    for _ in 0..2 {
        let hit = tracer.closest_hit(&ray).filter(|hit| hit.object == SECOND_BALL)?;
        let through = tracer.interact(&hit, ray.direction, &media).transmission?;
        (ray, media) = (through.ray, through.media);
    }
    let hit = tracer.closest_hit(&ray).filter(|hit| hit.object == FLOOR)?;
    Some(hit.point)
}

/// The pixel whose ray lands nearest to a place.
fn traced_pixel(tracer: &Tracer, view: &View, place: DVec3) -> DVec2 {
    let distance = |pixel: usize| {
        let landing = landing(tracer, view.camera.position, direction(view, pixel));
        landing.map_or(f64::INFINITY, |point| point.distance(place))
    };
    let pixels = 0..(PIXELS * PIXELS) as usize;
    let nearest = pixels.min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    pixel_place(nearest.expect("pixels"))
}

fn check(what: &str, found: DVec2, expected: DVec2, elsewhere: DVec2) {
    let slip = found.distance(expected);
    let _ = writeln!(
        std::io::stdout(),
        "{what}: brightest at {found}, expected at {expected}, {slip:.2} pixels off; {elsewhere} if it were otherwise"
    );
    assert!(slip <= LARGEST_SLIP, "{what}: {found} for {expected}");
    // It could be told from what the mirror or the ball would show elsewhere.
    assert!(
        found.distance(elsewhere) > 2.0 * LARGEST_SLIP,
        "{what}: {elsewhere}"
    );
}

#[test]
fn the_caustic_is_seen_in_a_second_ball_where_the_traced_chain_ends_on_it() {
    let Some(gpu) = gpu() else { return };
    let lit = Lit::new();
    let view = view(DVec3::new(0.32, 0.8, 1.34), DVec3::new(0.19, 0.4, 0.63), 24.0);
    let picture = lit.on_gpu(&gpu, &view);
    let found = lit.brightest_pixel(&picture, &view, SECOND_BALL);
    let expected = traced_pixel(&lit.tracer, &view, lit.brightest);
    let of_less_index = traced_pixel(&Tracer::new(scene(1.4)), &view, lit.brightest);
    check("second ball", found, expected, of_less_index);
}

#[test]
fn the_caustic_is_seen_in_a_mirror_where_its_virtual_image_lies() {
    let Some(gpu) = gpu() else { return };
    let lit = Lit::new();
    let image = |plane: f64| DVec3::new(lit.brightest.x, lit.brightest.y, 2.0 * plane - lit.brightest.z);
    // Aside of the image, so that it is not in the picture's middle.
    let target = image(MIRROR_Z) + DVec3::new(0.06, 0.04, 0.0);
    let view = view(DVec3::new(1.0, 0.7, 1.0), target, 8.0);
    let picture = lit.on_gpu(&gpu, &view);
    let found = lit.brightest_pixel(&picture, &view, MIRROR);
    let expected = projected(&view, image(MIRROR_Z));
    check(
        "mirror",
        found,
        expected,
        projected(&view, image(MIRROR_Z - 0.05)),
    );
}
