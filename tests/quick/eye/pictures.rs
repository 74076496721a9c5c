//! The CPU eye pass on scenes of known radiance.

use nephroid::effect::EffectSwitch;
use nephroid::eye_pass::reference::{ReferenceSettings, first_hits, render};
use nephroid::optics::fresnel::{dielectric_reflectance, thin_wall_reflectance};
use nephroid::scene::Environment;

use crate::prelude::*;
use support::chain_laws::direction;
use support::floors::{diffuse, image, texture_reference};
use support::meshes::{cuboid, floor, inside_out, joined, quad, sphere};
use support::scenes::{chart, map_of, scene, seen, surface, tinted, to_the_end, tracer, under_sky, view};

const WATER: f64 = 1.333;
/// Of the floors of these tests; all channels differ, so that none can stand in for another.
const ALBEDO: [f64; 3] = [0.6, 0.5, 0.3];
/// Irradiance on them [W/m²].
const E: [f32; 3] = [50.0, 40.0, 20.0];
/// Radiance of the background [W/(m² sr)].
const SKY: DVec3 = dvec3(3.0, 2.0, 1.0);

fn floor_sends() -> DVec3 {
    DVec3::from(ALBEDO) * DVec3::from(E.map(f64::from)) / PI
}

fn floor_material() -> Material {
    diffuse(ALBEDO.into())
}

struct Lit(Tracer, Vec<IlluminationMap>);

impl Lit {
    /// A large floor, evenly lit, and what else there is.
    fn floor_and(mut others: Vec<(Mesh, Material)>) -> Self {
        others.insert(0, (floor(100.0, 0.0), floor_material()));
        Self::with_map(scene(others, vec![]), 2, vec![E; 4])
    }

    /// The first object of a scene with a map of rows of `width` texels.
    fn with_map(scene: Scene, width: usize, irradiance: Vec<[f32; 3]>) -> Self {
        let tracer = Tracer::new(Arc::new(scene));
        let chart = chart(&tracer, 0, width, irradiance.len() / width);
        Self(tracer, vec![map_of(chart, irradiance)])
    }

    fn picture(&self, view: &View, samples_per_side: u32) -> Picture {
        seen(&self.0, &self.1, view, &to_the_end(samples_per_side)).0
    }

    #[track_caller]
    fn assert_sends(&self, view: &View, expected: impl Fn(DVec3) -> DVec3) {
        let picture = self.picture(view, 1);
        assert_eq!(picture.radiance.len(), (view.width * view.height) as usize);
        for (pixel, radiance) in picture.radiance.iter().enumerate() {
            let expected = expected(direction(view, pixel));
            let off = (radiance_of(*radiance) - expected).abs();
            assert!(
                off.cmple(1e-6 * expected).all(),
                "{pixel}: {radiance:?} for {expected}"
            );
        }
    }

    /// The same from 3 m above the middle of the floor towards a point of it.
    #[track_caller]
    fn assert_sends_up(&self, [x, z]: [f64; 2], expected: impl Fn(DVec3) -> DVec3) {
        self.assert_sends(&looking([0.0, 3.0, 0.0], [x, 0.0, z], 30.0, [5, 5]), expected);
    }

    /// Fails unless a floor's point, seen from above, sends this.
    #[track_caller]
    fn assert_point_sends(&self, [x, z]: [f64; 2], expected: DVec3) {
        let point = dvec3(x, 0.0, z);
        let above = point + dvec3(0.1, 1.0, 0.2);
        self.assert_sends(&view(above, point, 0.02, [1, 1]), |_| expected);
    }
}

fn radiance_of(pixel: [f32; 3]) -> DVec3 {
    DVec3::from(pixel.map(f64::from))
}

fn looking(eye: [f64; 3], target: [f64; 3], fov_degrees: f64, size: [u32; 2]) -> View {
    View {
        background: LinearSrgb::from(SKY.to_array()),
        ..view(eye.into(), target.into(), fov_degrees.to_radians(), size)
    }
}

fn glass() -> Material {
    surface(SurfaceKind::Dielectric, 1.5)
}

fn water() -> Material {
    surface(SurfaceKind::Dielectric, WATER)
}

fn layer(low: f64, high: f64) -> Mesh {
    cuboid(dvec3(-90.0, low, -90.0), dvec3(90.0, high, 90.0))
}

/// Faces back to back are seen from the side that faces the eye.
#[test]
fn a_floor_back_to_back_has_no_holes() {
    let front = floor(100.0, 0.0);
    let both = joined(front.clone(), inside_out(front));
    let doubled = scene(vec![(both, floor_material())], vec![]);
    let lit = Lit::with_map(doubled, 2, vec![E; 4]);
    let slanting = view(dvec3(0.3, 2.0, 0.1), dvec3(0.0, 0.0, 1.7), 0.9, [32, 32]);
    for radiance in lit.picture(&slanting, 1).radiance {
        near(
            DVec3::from(radiance.map(f64::from)),
            floor_sends(),
            1e-5,
            "radiance",
        );
    }
}

/// Water as an open sheet and as a closed body.
fn waters() -> [Lit; 2] {
    [floor(90.0, 1.0), layer(-0.5, 1.0)].map(|mesh| Lit::floor_and(vec![(mesh, water())]))
}

/// Reflectance and transmittance of a slab, all orders, each crossing keeping the share `kept`.
fn slab(cos_incident: f64, eta: f64, kept: DVec3) -> (DVec3, DVec3) {
    let r = dielectric_reflectance(cos_incident, eta);
    let through = (1.0 - r) * (1.0 - r) * kept / (1.0 - r * r * kept * kept);
    (r + through * r * kept, through)
}

/// Shares left after so many times the way that leaves a colour.
fn left_after(colour: LinearSrgb, ways: f64) -> DVec3 {
    DVec3::from(colour.to_array()).powf(ways)
}

/// Cosine within a body of what comes in at a cosine.
fn within(cosine: f64, eta: f64) -> f64 {
    (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt()
}

#[test]
fn lit_floor_sends_albedo_times_e_over_pi() {
    let lit = Lit::floor_and(vec![]);
    let view = looking([0.0, 2.0, 3.0], [0.0; 3], 40.0, [9, 7]);
    lit.assert_sends(&view, |_| floor_sends());
    let control = Control::default();
    control.cancel();
    assert!(
        render(&lit.0, &[], &view, &Default::default(), &(), &control).is_err(),
        "cancelled"
    );
    let unlit = Lit(lit.0, vec![]);
    unlit.assert_sends(&view, |_| DVec3::ZERO);
}

#[test]
fn water_from_above_dims_by_n_squared() {
    for lit in waters() {
        for target in [[0.0, 1e-3], [3.0, 2.0]] {
            lit.assert_sends_up(target, |direction| {
                let r = dielectric_reflectance(-direction.y, WATER);
                (1.0 - r) * floor_sends() / (WATER * WATER) + r * SKY
            });
        }
    }
}

#[test]
fn slab_of_coloured_glass_keeps_its_shares() {
    for colour in [LinearSrgb::WHITE, rgb(0.9, 0.5, 0.2)] {
        let lit = Lit::floor_and(vec![(layer(1.0, 1.1), tinted(glass(), 0.07, colour))]);
        for target in [[0.0, 1e-3], [4.0, 2.0]] {
            lit.assert_sends_up(target, |direction| {
                let way_m = 0.1 / within(-direction.y, 1.5);
                let (r, t) = slab(-direction.y, 1.5, left_after(colour, way_m / 0.07));
                t * floor_sends() + r * SKY
            });
        }
    }
}

#[test]
fn slab_under_water_counts_by_contrast() {
    let slab_mesh = cuboid(dvec3(-80.0, 1.0, -80.0), dvec3(80.0, 1.1, 80.0));
    let lit = Lit::floor_and(vec![(floor(90.0, 3.0), water()), (slab_mesh, glass())]);
    let down = looking([0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 30.0, [5, 5]);
    lit.assert_sends(&down, |direction| {
        let (r, t) = slab(-direction.y, 1.5 / WATER, DVec3::ONE);
        // What the slab sends back reaches the surface from below, there the sky or again the slab, and so on.
        let back = dielectric_reflectance(-direction.y, 1.0 / WATER);
        let from_sky = r * (1.0 - back) * WATER * WATER * SKY;
        (t * floor_sends() + from_sky) / (1.0 - r * back)
    });
}

/// A sheet whose back is not drawn may lie anywhere on the way: what it lies in absorbs as without it.
#[test]
fn undrawn_backs_shorten_no_way_through_water() {
    let colour = rgb(0.9, 0.5, 0.2);
    let sheet = with(floor_material(), |it| it.double_sided = false);
    // It faces down, away from the eye.
    let below = quad(dvec3(-5.0, 0.6, -5.0), DVec3::Z * 10.0, DVec3::X * 10.0);
    let lit = Lit::floor_and(vec![
        (layer(-0.5, 1.0), tinted(water(), 0.7, colour)),
        (below, sheet),
    ]);
    lit.assert_sends_up([0.4, 0.2], |direction| {
        let r = dielectric_reflectance(-direction.y, WATER);
        let left = left_after(colour, 1.0 / within(-direction.y, WATER) / 0.7);
        (1.0 - r) * left * floor_sends() / (WATER * WATER) + r * SKY
    });
}

#[test]
fn thin_wall_reflects_all_orders_and_tints() {
    let tint = dvec3(1.0, 0.5, 0.25);
    let pane = Material {
        base_colour: tint.to_array().into(),
        ..surface(SurfaceKind::ThinWall, 1.5)
    };
    let lit = Lit::floor_and(vec![(floor(90.0, 1.0), pane)]);
    lit.assert_sends_up([2.0, 0.5], |direction| {
        let r = thin_wall_reflectance(-direction.y, 1.5);
        (1.0 - r) * tint * floor_sends() + r * SKY
    });
}

#[test]
fn coated_floor_sends_what_coat_lets_out() {
    let coated = Material {
        base_colour: ALBEDO.into(),
        ..surface(SurfaceKind::Coated, 1.5)
    };
    let lit = Lit::with_map(scene(vec![(floor(100.0, 0.0), coated)], vec![]), 2, vec![E; 4]);
    lit.assert_sends(&looking([0.0, 2.0, 3.0], [0.0; 3], 40.0, [5, 5]), |direction| {
        let f = dielectric_reflectance(-direction.y, 1.5);
        (1.0 - f) * floor_sends() + f * SKY
    });
}

/// A small shining square beside a mirror shows at the pixel where its virtual image lies.
#[test]
fn mirror_shows_the_virtual_image_in_place() {
    let centre = dvec3(0.6, 0.3, 1.0);
    let (sent, f0) = (dvec3(7.0, 5.0, 2.0), dvec3(0.9, 0.8, 0.5));
    let shining = Material {
        emitted_radiance: sent.to_array().into(),
        ..diffuse(LinearSrgb::BLACK)
    };
    let lamp = quad(centre - dvec3(0.1, 0.1, 0.0), DVec3::X * 0.2, DVec3::Y * 0.2);
    let metal = Material {
        base_colour: f0.to_array().into(),
        ..surface(SurfaceKind::Mirror, 1.5)
    };
    // The mirror is the plane z = −1; the image of a point lies at z → −2 − z.
    let mirror = quad(dvec3(-3.0, -3.0, -1.0), DVec3::X * 6.0, DVec3::Y * 6.0);
    let lit = Lit(tracer(vec![(lamp, shining), (mirror, metal)], vec![]), vec![]);
    let view = looking([-0.4, 0.1, 2.5], [0.0, 0.0, -1.0], 50.0, [240, 160]);
    let (mut inside, mut outside) = (0, 0);
    for (pixel, radiance) in lit.picture(&view, 1).radiance.into_iter().enumerate() {
        let (eye, ray) = (view.camera.position, direction(&view, pixel));
        let hits_square = |z: f64| {
            let off = (eye + ray * ((z - eye.z) / ray.z) - centre).abs();
            off.x < 0.1 && off.y < 0.1
        };
        if hits_square(centre.z) {
            continue;
        }
        let radiance = radiance_of(radiance);
        if hits_square(-2.0 - centre.z) {
            inside += 1;
            // Schlick's metal under the lamp's own radiance.
            let expected = sent * (f0 + (1.0 - f0) * (1.0 + ray.z).powi(5));
            assert!((radiance / expected).abs_diff_eq(DVec3::ONE, 1e-6), "{radiance}");
        } else {
            outside += 1;
            assert!(radiance.cmple(SKY).all(), "{pixel}: no image lies here");
        }
    }
    assert!(inside > 20 && outside > 30_000, "{inside} {outside}");
}

/// Between texel centres the map is a straight line, beyond the outermost ones it goes on; it follows the chart's
/// coordinates.
#[test]
fn maps_are_read_bilinearly_by_their_chart() {
    let white = || scene(vec![(floor(1.0, 0.0), diffuse(LinearSrgb::WHITE))], vec![]);
    let colour = [1.0, 2.0, 0.5];
    let texels = |values: &[f32]| values.iter().map(|value| colour.map(|c| c * value)).collect();
    let sent = |value: f64| radiance_of(colour) * value / PI;
    let lit = Lit::with_map(white(), 2, texels(&[1.0, 3.0, 5.0, 11.0]));
    for (x, z, expected) in [
        (-0.5, -0.5, 1.0),
        (0.5, -0.5, 3.0),
        (0.0, -0.5, 2.0),
        (0.0, 0.0, 5.0),
        (0.25, 0.5, 9.5),
        (-0.9, -0.9, 1.0),
        (0.5, 0.99, 11.0),
    ] {
        lit.assert_point_sends([x, z], sent(expected));
    }
    // u runs against x.
    let mut turned = white();
    let mesh = turned.objects[0].mesh_in_scene_mut();
    mesh.uv0.iter_mut().flatten().for_each(|uv| uv.x = 1.0 - uv.x);
    let lit = Lit::with_map(turned, 2, texels(&[1.0, 2.0]));
    lit.assert_point_sends([-0.5, 0.0], sent(2.0));
    lit.assert_point_sends([0.5, 0.0], sent(1.0));
}

fn textured(mesh: Mesh, material: Material, uv_set: usize, texture: Texture) -> Scene {
    let mut image = texture_reference();
    image.uv_set = uv_set;
    let mut scene = scene(vec![(mesh, material)], vec![]);
    scene.materials[0].base_colour_texture = Some(image);
    scene.textures.push(Arc::new(texture));
    scene
}

#[test]
fn textures_tint_and_emission_adds() {
    let codes = [
        [255, 0, 0, 255],
        [0, 255, 0, 255],
        [0, 0, 255, 255],
        [188, 188, 188, 255],
    ];
    let emission = dvec3(0.25, 0.0, 0.0);
    let mut material = diffuse(LinearSrgb::grey(0.5));
    material.emitted_radiance = emission.to_array().into();
    let four = image(2, codes.to_vec(), Wrap::ClampToEdge);
    let lit = Lit::with_map(textured(floor(1.0, 0.0), material, 0, four), 1, vec![E]);
    let grey = DVec3::splat(LinearSrgb::decode_channel(188));
    for (x, z, tint) in [
        (-0.5, -0.5, DVec3::X),
        (0.5, -0.5, DVec3::Y),
        (-0.5, 0.5, DVec3::Z),
        (0.5, 0.5, grey),
    ] {
        lit.assert_point_sends([x, z], emission + 0.5 * tint * radiance_of(E) / PI);
    }
}

/// Three texels, red by their number.
fn strip(wrap: Wrap) -> Texture {
    image(3, (0..3).map(|column| [column, 0, 0, 255]).collect(), wrap)
}

#[test]
fn images_go_on_beyond_their_borders() {
    for (wrap, expected) in [
        (Wrap::Repeat, [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]),
        (Wrap::MirroredRepeat, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]),
        (Wrap::ClampToEdge, [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]),
    ] {
        let strip = strip(wrap);
        let found = (-4..8).map(|column| strip.code(f64::from(column), 0.0)[0]);
        assert!(found.eq(expected), "{wrap:?}");
    }
    // Between its middles the nearest texel, or one between two.
    for (is_nearest, expected) in [(true, 2), (false, 1)] {
        let red = [0, 2].map(LinearSrgb::decode_channel);
        let pair = Texture {
            is_nearest,
            ..image(2, vec![[0, 0, 0, 255], [2, 0, 0, 0]], Wrap::ClampToEdge)
        };
        let place = dvec2(0.5, 0.5);
        near(
            pair.sample(place).r,
            red[1] * 0.5 * f64::from(expected),
            1e-12,
            is_nearest,
        );
        near(
            pair.alpha(place),
            1.0 - 0.5 * f64::from(expected),
            1e-12,
            is_nearest,
        );
    }
    // Textures follow the set that they name.
    let mut mesh = floor(1.0, 0.0);
    let middles = |column: f64| Some(vec![dvec2((column + 0.5) / 3.0, 0.5); 4]);
    (mesh.uv0, mesh.uv1) = (middles(1.0), middles(2.0));
    for uv_set in [0, 1] {
        let white = diffuse(LinearSrgb::WHITE);
        let scene = textured(mesh.clone(), white, uv_set, strip(Wrap::Repeat));
        let tracer = Tracer::new(Arc::new(scene));
        let (origin, direction) = (dvec3(0.1, 1.0, 0.2), DVec3::NEG_Y);
        let hit = tracer.closest_hit(&Ray { origin, direction }).expect("the floor");
        let expected = LinearSrgb::decode_channel(uv_set as u8 + 1);
        near(tracer.base_colour(&hit).r, expected, 1e-12, uv_set);
    }
}

/// Four quarters around, from −z over +x, +z and −x, of other colours; between their middles colours pass over.
#[test]
fn skies_lie_and_shine_as_their_light_says() {
    let pixels = [1.0, 2.0, 3.0, 4.0].map(|value| [value, 0.5 * value, 3.0]);
    let mut scene = under_sky(Scene::default(), Environment::new(4, 1, pixels.to_vec()), 2.0);
    scene.lights[0].colour = rgb(1.0, 0.5, 0.25);
    let lit = Lit(Tracer::new(Arc::new(scene)), vec![]);
    for (quarters, expected) in [
        (0.5, 1.0),
        (1.5, 2.0),
        (2.5, 3.0),
        (3.5, 4.0),
        (1.0, 1.5),
        (4.0, 2.5),
    ] {
        let azimuth = quarters * PI / 2.0;
        let ahead = [azimuth.sin(), 0.0, -azimuth.cos()];
        let view = looking([0.0; 3], ahead, 1e-6, [1, 1]);
        lit.assert_sends(&view, |_| dvec3(2.0 * expected, 0.5 * expected, 1.5));
    }
}

#[test]
fn backs_of_single_sided_walls_are_not_drawn() {
    for double_sided in [true, false] {
        let wall = with(floor_material(), |it| it.double_sided = double_sided);
        let ceiling = quad(dvec3(-5.0, 1.0, -5.0), DVec3::Z * 10.0, DVec3::X * 10.0);
        let lit = Lit::floor_and(vec![(ceiling, wall)]);
        let view = looking([0.0, 3.0, 0.0], [0.0, 0.0, 0.1], 30.0, [4, 3]);
        assert_eq!(first_hits(&lit.0, &view), [Some(usize::from(double_sided)); 12]);
        let seen = if double_sided { DVec3::ZERO } else { floor_sends() };
        lit.assert_sends(&view, |_| seen);
    }
    // First hits start with the top row.
    let square = |x: f64, y: f64| (quad(dvec3(x, y, -5.0), DVec3::X, DVec3::Y), floor_material());
    let tracer = tracer(vec![square(-1.0, 0.0), square(0.0, -1.0)], vec![]);
    let view = view(DVec3::ZERO, DVec3::NEG_Z, 2.0 * 0.2f64.atan(), [2, 2]);
    assert_eq!(first_hits(&tracer, &view), [Some(0), None, None, Some(1)]);
}

/// A straight edge across a picture: supersampled, its pixels hold the share that is covered.
#[test]
fn more_samples_soften_edges() {
    let lit = Lit::floor_and(vec![]);
    // The horizon of a floor that ends 100 m away runs through the middle row.
    let eye = DVec3::Y;
    let view = view(eye, dvec3(0.0, 0.99, -1.0), 1f64.to_radians(), [1, 3]);
    let share = |pixel: &[f32; 3]| f64::from(pixel[0]) / floor_sends().x;
    let at = |side: u32| {
        lit.picture(&view, side)
            .radiance
            .iter()
            .map(share)
            .collect::<Vec<f64>>()
    };
    let fine = at(32);
    assert!(fine[0] == 0.0 && (fine[2] - 1.0).abs() < 1e-6);
    assert!((fine[1] - 0.5).abs() < 0.05, "{} of the middle", fine[1]);
    assert!((at(4)[1] - fine[1]).abs() <= 0.25);
    assert!(at(1).iter().all(|share| share.min(1.0 - share).abs() < 1e-6));

    // A pixel whose samples differ gets more, the others do not.
    let still = |settings: &ReferenceSettings| seen(&lit.0, &lit.1, &view, settings);
    let few = ReferenceSettings {
        samples_per_side: 2,
        ..ReferenceSettings::default()
    };
    let (picture, rays) = still(&ReferenceSettings::still(EffectSwitch::Auto));
    assert_eq!(rays.camera_rays, 3 * 4 + 16);
    assert!((share(&picture.radiance[1]) - fine[1]).abs() <= 0.125);
    assert_eq!(picture.radiance[2], still(&few).0.radiance[2]);
}

#[test]
fn same_picture_for_any_number_of_threads() {
    let ball = sphere(DVec3::Y, 0.5, 24, 12);
    let lit = Lit::floor_and(vec![(ball, glass())]);
    let view = looking([0.0, 2.0, 3.0], [0.0, 1.0, 0.0], 40.0, [40, 30]);
    let [one, three] = [1, 3].map(|threads| super::on_threads(threads, || lit.picture(&view, 1)));
    assert_eq!(one, three);
    // In a closed world nothing is brighter than n² times the brightest source.
    let brightest = 2.25 * floor_sends().max(SKY);
    let is_possible = |pixel: &[f32; 3]| radiance_of(*pixel).cmple(brightest).all();
    assert!(one.radiance.iter().all(is_possible));
}

/// In a furnace, where all that can be seen has one radiance, clear and white things vanish, whatever their shape.
#[test]
fn clear_things_vanish_in_a_furnace() {
    use SurfaceKind::{Dielectric, Mirror, ThinWall};
    let (white, sky) = (diffuse(LinearSrgb::WHITE), SKY * PI);
    for kind in [Dielectric, ThinWall, Mirror] {
        let ball = (sphere(DVec3::Y, 0.5, 24, 12), surface(kind, 1.5));
        let scene = scene(vec![(floor(100.0, 0.0), white.clone()), ball], vec![]);
        let lit = Lit::with_map(scene, 2, vec![sky.as_vec3().to_array(); 4]);
        let view = looking([0.0, 2.0, 3.0], [0.0, 1.0, 0.0], 30.0, [33, 33]);
        for pixel in lit.picture(&view, 1).radiance {
            let relative = radiance_of(pixel) / SKY;
            assert!(relative.abs_diff_eq(DVec3::ONE, 1e-4), "{kind:?}: {relative}");
        }
    }
}
