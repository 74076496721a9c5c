//! Light between diffuse surfaces against closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use nephroid::illumination::{Chart, IlluminationMap, Receiver};
use nephroid::light_pass::indirect::{LEAST_PASSES, Network};
use nephroid::optics::LinearSrgb;
use nephroid::plan::Effect;
use nephroid::progress::Control;
use nephroid::scene::{Light, LightKind, Material, Mesh, Scene, SurfaceKind, Volume};
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, LayerKind, MapResolution};
use nephroid::transport::Tracer;
use nephroid::units::Radiance;

use crate::meshes::{cuboid, floor, quad, sphere};
use crate::scenes::{diffuse, light, point_light, scene, sun, surface};
use crate::tools::{bake, bits};

fn settings(layers: &[LayerKind], side: usize, max_error: f64) -> BakeSettings {
    BakeSettings {
        layers: layers.to_vec(),
        max_error: Some(max_error),
        density_per_sr: BakeSettings::starting_density_per_sr(max_error),
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..BakeSettings::default()
    }
}

const LIT: [LayerKind; 2] = [LayerKind::Direct, LayerKind::Indirect];

fn one_sided(albedo: f64) -> Material {
    Material {
        double_sided: false,
        ..diffuse(albedo)
    }
}

/// Polished: mirrors and glass of the shared scenes have the roughness of a default material.
fn smooth(kind: SurfaceKind) -> Material {
    Material {
        roughness: 0.0,
        ..surface(kind, 1.5)
    }
}

/// A box whose walls face inwards.
fn room(low: DVec3, high: DVec3) -> Mesh {
    let mut walls = cuboid(low, high);
    walls
        .triangles
        .iter_mut()
        .for_each(|triangle| triangle.swap(1, 2));
    walls.normals.iter_mut().for_each(|normal| *normal = -*normal);
    walls
}

fn map(result: &BakeResult, object: usize) -> &IlluminationMap {
    let mut maps = result.maps.iter();
    maps.find(|map| map.chart.receiver == Receiver::front(object))
        .expect("a map")
}

/// Each covered texel: all E [W/m²], by the first channel, and its area [m²].
fn texels(map: &IlluminationMap) -> Vec<(f64, f64)> {
    let of = |(texel, e): (usize, [f32; 3])| (f64::from(e[0]), map.chart.texel_area_m2(texel));
    let all = map.total().into_iter().enumerate().map(of);
    all.filter(|(_, area_m2)| *area_m2 > 0.0).collect()
}

/// Texels of one layer.
fn layer(map: &IlluminationMap, kind: LayerKind) -> Vec<f64> {
    let layer = map.layer(kind).expect("the layer");
    layer.irradiance.iter().map(|e| f64::from(e[0])).collect()
}

fn flux_w(result: &BakeResult) -> f64 {
    let all = result.maps.iter().flat_map(texels);
    all.map(|(e, area_m2)| e * area_m2).sum()
}

/// Walls that all glow with the exitance M and send on ρ of what comes: E = M/(1 − ρ) everywhere.
#[test]
fn a_furnace_is_even() {
    for albedo in [0.5, 0.8] {
        let glow = light(LightKind::Surface {
            object: 0,
            radiance: Radiance(2.0 / PI),
        });
        let mesh = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
        let result = bake(
            scene(vec![(mesh, one_sided(albedo))], vec![glow]),
            &settings(&LIT, 64, 0.03),
        );
        let expected = 2.0 / (1.0 - albedo);
        let (mut worst, mut squares, mut area) = (0.0_f64, 0.0, 0.0);
        for (e, area_m2) in texels(map(&result, 0)) {
            let off = e / expected - 1.0;
            worst = worst.max(off.abs());
            squares += off * off * area_m2;
            area += area_m2;
        }
        let rms = (squares / area).sqrt();
        println!("albedo {albedo}: {worst} at most, {rms} rms, {:?}", result.counts);
        assert!(
            worst < 0.01 && rms < 0.002,
            "albedo {albedo}: {worst} at most, {rms}"
        );
        assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    }
}

/// What a lamp sends is what walls take: Σ (1 − ρ) E A = Φ.
#[test]
fn walls_take_all_that_a_lamp_sends() {
    for albedo in [0.5, 0.8] {
        let mesh = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
        let lamp = point_light(DVec3::new(0.3, 1.1, 0.7), 5.0);
        let result = bake(
            scene(vec![(mesh, one_sided(albedo))], vec![lamp]),
            &settings(&LIT, 128, 0.03),
        );
        let taken = (1.0 - albedo) * flux_w(&result) / (4.0 * PI * 5.0);
        println!(
            "albedo {albedo}: {taken} of the flux, estimate {:?}, {:?}",
            result.estimated_relative_rmse, result.counts
        );
        assert!((taken - 1.0).abs() < 0.005, "albedo {albedo}: {taken}");
    }
}

/// The same with a ball of glass before the lamp: its caustic is gathered from, and rays go through it.
#[test]
fn walls_take_all_that_comes_through_glass() {
    let albedo = 0.8;
    let mesh = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
    let ball = sphere(DVec3::new(0.5, 0.5, 1.0), 0.3, 96, 48);
    let lamp = point_light(DVec3::new(0.3, 1.2, 0.7), 5.0);
    let glass = smooth(SurfaceKind::Dielectric);
    let all = [LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
    let result = bake(
        scene(vec![(mesh, one_sided(albedo)), (ball, glass)], vec![lamp]),
        &settings(&all, 64, 0.05),
    );
    let taken = (1.0 - albedo) * flux_w(&result) / (4.0 * PI * 5.0);
    let kinds = [LayerKind::Caustic, LayerKind::Direct];
    let first: f64 = kinds.iter().map(|&kind| map(&result, 0).flux_w(kind).r).sum();
    let first = first / (4.0 * PI * 5.0);
    let gathered = result.counts.gather_segments as f64 / result.counts.gather_rays as f64;
    println!(
        "{taken} of the flux, {first} at first, {gathered} segments per ray, {:?}",
        result.counts
    );
    assert!((taken - 1.0).abs() < 0.01, "{taken}");
    assert!(gathered > 1.1, "rays go through the glass");
}

/// What comes from other surfaces where each element gets E = 1 W/m² from elsewhere; maps by object and side [texels],
/// so many rays an element and pass.
fn under_even_light(scene: &Arc<Scene>, maps: &[(usize, usize)], rays: u32) -> Vec<LinearSrgb> {
    let tracer = Tracer::new(Arc::clone(scene));
    let charts: Vec<Arc<Chart>> = maps
        .iter()
        .map(|&(object, side)| Arc::new(crate::scenes::chart(&tracer, object, side, side)))
        .collect();
    let mut network = Network::new(scene, &charts);
    let progress: (&dyn nephroid::progress::Progress, &Control) = (&(), &Control::default());
    let count = network.element_count();
    let passes = vec![LEAST_PASSES; count];
    assert!(network.trace(&tracer, &passes, (rays, 0), progress));
    network.solve(&vec![LinearSrgb::WHITE; count], &passes).irradiance
}

/// In light that is the same everywhere, what stands in it (glass, a mirror, polish) changes nothing.
#[test]
fn rays_weigh_all_the_same_through_anything_clear() {
    let albedo = 0.7;
    let mesh = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
    let at = DVec3::new(0.5, 0.6, 1.0);
    for kind in [
        SurfaceKind::Dielectric,
        SurfaceKind::ThinWall,
        SurfaceKind::Mirror,
    ] {
        let ball = (sphere(at, 0.3, 48, 24), smooth(kind));
        let scene = Arc::new(scene(vec![(mesh.clone(), one_sided(albedo)), ball], vec![]));
        let expected = albedo / (1.0 - albedo);
        for e in under_even_light(&scene, &[(0, 16)], 16) {
            assert!(
                (e.g / expected - 1.0).abs() < 1e-3,
                "{kind:?}: {} for {expected}",
                e.g
            );
        }
    }
}

/// In a sphere full of coloured water light goes 2R cos θ from wall to wall, so that T̄ = ∫ 2c e^(−2Rσc) dc of it arrives:
/// where all walls get E = 1 from elsewhere, ρT̄/(1 − ρT̄) comes from other walls.
#[test]
fn water_takes_its_share_of_light_between_walls() {
    let (albedo, radius_m) = (0.6, 0.8);
    let colour = LinearSrgb::new(0.3, 0.6, 0.95);
    let mut water = smooth(SurfaceKind::Dielectric);
    water.volume = Some(Volume {
        attenuation_distance_m: 1.0,
        attenuation_colour: colour,
    });
    let mut wall = sphere(DVec3::ZERO, radius_m, 96, 48);
    wall.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    wall.normals.iter_mut().for_each(|normal| *normal = -*normal);
    let around = cuboid(-DVec3::ONE, DVec3::ONE);
    let scene = Arc::new(scene(vec![(wall, one_sided(albedo)), (around, water)], vec![]));
    let irradiance = under_even_light(&scene, &[(0, 24)], 16);
    let count = irradiance.len() as f64;
    let share = |colour: f64| {
        let x = -2.0 * radius_m * colour.ln();
        2.0 * (1.0 - (1.0 + x) * (-x).exp()) / (x * x)
    };
    let of = |channel: usize| irradiance.iter().map(move |e| e.to_array()[channel]).sum::<f64>() / count;
    for (channel, colour) in colour.to_array().into_iter().enumerate() {
        let arriving = albedo * share(colour);
        let expected = arriving / (1.0 - arriving);
        let found = of(channel);
        println!("{found} for {expected}");
        assert!((found / expected - 1.0).abs() < 0.005, "{found} for {expected}");
    }
}

/// Within glass radiance is n² times what it is outside: a black plate in the middle of a ball gets n²(1 − R₀) times what
/// it would get without, as what the ball's surface sends back comes to the plate again.
#[test]
fn radiance_within_glass_is_larger_by_the_square_of_its_index() {
    let (albedo, ior) = (0.7, 1.5);
    let walls = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
    let (middle, half) = (DVec3::new(0.5, 0.6, 1.0), 0.01);
    let ball = (sphere(middle, 0.3, 192, 96), smooth(SurfaceKind::Dielectric));
    let corner = middle - DVec3::new(half, 0.0, half);
    let plate = quad(corner, DVec3::Z * 2.0 * half, DVec3::X * 2.0 * half);
    let scene = Arc::new(scene(
        vec![(walls, one_sided(albedo)), ball, (plate, diffuse(0.0))],
        vec![],
    ));
    let irradiance = under_even_light(&scene, &[(0, 16), (2, 8)], 64);
    let on_plate = &irradiance[irradiance.len() - 64..];
    let mean = on_plate.iter().map(|e| e.g).sum::<f64>() / on_plate.len() as f64;
    let reflected = ((ior - 1.0_f64) / (ior + 1.0)).powi(2);
    let expected = ior * ior * (1.0 - reflected) * albedo / (1.0 - albedo);
    println!("{mean} for {expected}");
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} for {expected}");
}

/// E at a point from a polygon of radiance 1/π, so of exitance 1, that faces it wholly above its horizon (Lambert 1760).
fn polygon_factor(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for (index, corner) in corners.iter().enumerate() {
        let a = (*corner - point).normalize();
        let b = (corners[(index + 1) % corners.len()] - point).normalize();
        let axis = a.cross(b);
        sum += a.dot(b).clamp(-1.0, 1.0).acos() * axis.normalize_or_zero().dot(normal);
    }
    (sum / (2.0 * PI)).abs()
}

/// Mean of the factor over each texel of a map over a rectangle: corner, sides along u and v.
fn expected_factors(
    (width, height): (usize, usize),
    [corner, u, v]: [DVec3; 3],
    normal: DVec3,
    sender: &[DVec3],
) -> Vec<f64> {
    let fine = 4;
    let place = |index: usize, step: usize, count: usize| {
        ((index * fine + step) as f64 + 0.5) / (count * fine) as f64
    };
    (0..width * height)
        .map(|texel| {
            let sum: f64 = (0..fine * fine)
                .map(|step| {
                    let across = place(texel % width, step % fine, width);
                    let down = place(texel / width, step / fine, height);
                    polygon_factor(corner + u * across + v * down, normal, sender)
                })
                .sum();
            sum / (fine * fine) as f64
        })
        .collect()
}

/// Relative error of the mean, and root mean square error over the mean.
fn errors(found: &[f64], expected: &[f64]) -> (f64, f64) {
    let count = expected.len() as f64;
    let mean = expected.iter().sum::<f64>() / count;
    let off: f64 = found.iter().zip(expected).map(|(a, b)| a - b).sum();
    let squares: f64 = found.iter().zip(expected).map(|(a, b)| (a - b) * (a - b)).sum();
    (off / count / mean, (squares / count).sqrt() / mean)
}

/// One plate lit by the sun lights another: over it, and beside it at a right angle.
#[test]
fn plates_light_each_other_by_their_form_factors() {
    let corners = [
        DVec3::new(-0.5, 0.0, -0.5),
        DVec3::new(0.5, 0.0, -0.5),
        DVec3::new(0.5, 0.0, 0.5),
        DVec3::new(-0.5, 0.0, 0.5),
    ];
    // Corner, then sides along u and v; a quad faces v × u.
    let over = [DVec3::new(-0.5, 1.0, 0.5), DVec3::X, DVec3::NEG_Z];
    let beside = [DVec3::new(-0.5, 0.0, 0.5), DVec3::Y, DVec3::NEG_Z];
    for (name, plate, slope) in [("parallel", over, 1.6), ("perpendicular", beside, 0.0)] {
        let mesh = quad(plate[0], plate[1], plate[2]);
        let normal = mesh.normals[0];
        let sunlight = sun(DVec3::new(slope, -1.0, 0.0), 3.0);
        let result = bake(
            scene(
                vec![(floor(0.5, 0.0), one_sided(0.7)), (mesh, one_sided(0.0))],
                vec![sunlight],
            ),
            &settings(&LIT, 32, 0.015),
        );
        let lit = layer(map(&result, 0), LayerKind::Direct)[0];
        let found = layer(map(&result, 1), LayerKind::Indirect);
        let factors = expected_factors((32, 32), plate, normal, &corners);
        let expected: Vec<f64> = factors.iter().map(|factor| 0.7 * lit * factor).collect();
        let (mean, rms) = errors(&found, &expected);
        let estimate = map(&result, 1).estimated_relative_rmse.expect("an estimate");
        println!(
            "{name}: mean {mean}, rms {rms}, estimate {estimate}, {:?}",
            result.counts
        );
        assert!(mean.abs() < 0.003, "{name}: the mean is off by {mean}");
        assert!(rms < 0.01, "{name}: {rms}");
        assert!(
            (0.3..6.0).contains(&(estimate / rms)),
            "{name}: {estimate} said, {rms} found"
        );
    }
}

/// A patch that is seen in a mirror alone lights like its image behind it.
#[test]
fn a_mirror_shows_the_patch_behind_it() {
    let patch = |x: f64| quad(DVec3::new(x, 0.0, -0.5), DVec3::X, DVec3::Z);
    let mirror = quad(DVec3::new(-4.0, 1.0, 4.0), DVec3::X * 8.0, DVec3::NEG_Z * 8.0);
    let silver = Material {
        double_sided: false,
        base_colour: LinearSrgb::grey(0.9),
        ..smooth(SurfaceKind::Mirror)
    };
    let sunlight = sun(DVec3::new(6.0, -1.0, 0.0), 30.0);
    let parts = vec![
        (patch(-1.0), one_sided(0.6)),
        (patch(0.0), one_sided(0.0)),
        (mirror, silver),
    ];
    let all = [LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
    let result = bake(scene(parts, vec![sunlight]), &settings(&all, 64, 0.01));
    let sender = texels(map(&result, 0));
    let lit = sender.iter().map(|(e, _)| e).sum::<f64>() / sender.len() as f64;
    let image = [
        DVec3::new(-1.0, 2.0, -0.5),
        DVec3::new(0.0, 2.0, -0.5),
        DVec3::new(0.0, 2.0, 0.5),
        DVec3::new(-1.0, 2.0, 0.5),
    ];
    let plate = [DVec3::new(0.0, 0.0, -0.5), DVec3::X, DVec3::Z];
    let factors = expected_factors((64, 64), plate, DVec3::Y, &image);
    // Metal reflects a little more at a slant (Schlick): up to a percent of what it reflects, within 45°.
    let expected: Vec<f64> = factors.iter().map(|factor| 0.6 * 0.9 * lit * factor).collect();
    let found = layer(map(&result, 1), LayerKind::Indirect);
    let (mean, rms) = errors(&found, &expected);
    println!("mean {mean}, rms {rms}, {:?}", result.counts);
    assert!(mean.abs() < 0.01 && rms < 0.02, "mean {mean}, rms {rms}");
}

fn small_room() -> Scene {
    let mesh = room(DVec3::ZERO, DVec3::new(1.0, 1.5, 2.0));
    let ball = sphere(DVec3::new(0.5, 0.3, 1.0), 0.3, 24, 12);
    let lamp = point_light(DVec3::new(0.3, 1.1, 0.7), 5.0);
    scene(vec![(mesh, one_sided(0.5)), (ball, diffuse(0.8))], vec![lamp])
}

#[test]
fn the_same_bits_for_any_number_of_threads_and_any_past() {
    let with = |threads: usize| BakeSettings {
        threads,
        ..settings(&LIT, 32, 0.1)
    };
    let all_bits = |result: &BakeResult| -> Vec<u32> { result.maps.iter().flat_map(bits).collect() };
    let one = bake(small_room(), &with(1));
    assert_eq!(all_bits(&one), all_bits(&bake(small_room(), &with(2))));
    // A session that knows more rays already gives the same, and traces none.
    let mut session = BakeSession::new(Arc::new(small_room())).expect("a session");
    let bake_now = |session: &mut BakeSession, max_error: f64| {
        let settings = settings(&LIT, 32, max_error);
        session.bake(&settings, &(), &Control::default()).expect("a bake")
    };
    let finer = bake_now(&mut session, 0.02);
    assert!(finer.counts.gather_rays > 0);
    let mut dimmed = Scene::clone(session.scene());
    dimmed.lights[0].colour = LinearSrgb::new(1.0, 0.5, 0.25);
    session.set_scene(Arc::new(dimmed.clone())).expect("an edit");
    let coarser = bake_now(&mut session, 0.06);
    assert_eq!(coarser.counts.gather_rays, 0, "dimming a lamp needs no ray");
    let fresh = bake(dimmed, &settings(&LIT, 32, 0.06));
    assert!(fresh.counts.gather_rays < finer.counts.gather_rays);
    assert_eq!(all_bits(&coarser), all_bits(&fresh));
}

#[test]
fn layers_that_it_gathers_from_need_not_be_shown() {
    let lone = bake(small_room(), &settings(&[LayerKind::Indirect], 32, 0.1));
    let both = bake(small_room(), &settings(&LIT, 32, 0.1));
    assert_eq!(lone.maps.len(), both.maps.len());
    for (lone, both) in lone.maps.iter().zip(&both.maps) {
        assert_eq!(lone.layers.len(), 1);
        assert_eq!(layer(lone, LayerKind::Indirect), layer(both, LayerKind::Indirect));
        assert_eq!(lone.error, both.error);
    }
    assert!(lone.estimated_relative_rmse.is_some_and(|error| error > 0.0));
}

#[test]
fn where_it_is_not_asked_for_it_takes_nothing() {
    let mut told = Vec::new();
    for layers in [&[LayerKind::Direct][..], &LIT] {
        let result = bake(small_room(), &settings(layers, 32, 0.1));
        let report = result
            .effects
            .iter()
            .find(|report| report.line.effect == Effect::Indirect);
        let counts = report.expect("a line").counts;
        told.push((counts.rays, counts.bytes, result.counts.gather_rays > 0));
        let has_layer = result
            .maps
            .iter()
            .any(|map| map.layer(LayerKind::Indirect).is_some());
        assert_eq!(has_layer, layers.contains(&LayerKind::Indirect));
    }
    assert_eq!(told[0], (0, 0, false));
    assert!(told[1].0 > 0 && told[1].1 > 0 && told[1].2, "{told:?}");
}

#[test]
fn lights_add_up_to_the_layer() {
    let mut scene = small_room();
    let second = Light {
        colour: LinearSrgb::new(0.2, 0.5, 1.0),
        ..point_light(DVec3::new(0.8, 0.4, 1.7), 2.0)
    };
    scene.lights.push(second);
    let settings = BakeSettings {
        per_light: true,
        ..settings(&LIT, 32, 0.1)
    };
    let result = bake(scene, &settings);
    for map in &result.maps {
        let whole = map.layer(LayerKind::Indirect).expect("the layer");
        let parts: Vec<_> = result
            .light_layers
            .iter()
            .filter(|part| part.receiver == map.chart.receiver && part.kind == LayerKind::Indirect)
            .collect();
        assert_eq!(parts.len(), 2);
        for (texel, e) in whole.irradiance.iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part.irradiance[texel][2]).sum();
            assert!(
                (sum - e[2]).abs() <= 1e-4 * e[2].max(1e-3),
                "texel {texel}: {sum} for {}",
                e[2]
            );
        }
    }
}
