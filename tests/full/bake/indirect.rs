//! Light between diffuse surfaces against closed forms.

use nephroid::bake::Baker;
use nephroid::illumination::{Chart, Receiver};
use nephroid::light_pass::indirect::{MIN_PASSES, Network, NoiseSmoothing, TraceCounts};
use nephroid::settings::ErrorMetric;

use crate::bake::common::{self, all_bits, run, with_layers};
use support::meshes::{cuboid, floor, inside_out, quad, sphere};
use support::prelude::*;
use support::scenes::{diffuse, light, point_light, scene, sun, surface, tinted};
use support::tools::{bake, set, to};

fn settings(layers: &[LayerKind], side: usize, max_error: f64) -> BakeSettings {
    with_layers(layers, to(max_error, side))
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
fn room() -> Mesh {
    inside_out(cuboid(DVec3::ZERO, dvec3(1.0, 1.5, 2.0)))
}

fn map(result: &Bake, object: usize) -> &IlluminationMap {
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

/// Walls that all glow with the exitance M and send on ρ of what comes: E = M/(1 − ρ) everywhere.
#[test]
fn a_furnace_is_even() {
    for albedo in [0.5, 0.8] {
        let glow = light(LightKind::Surface {
            object: 0,
            radiance: Radiance(2.0 / PI),
        });
        let walls = scene(vec![(room(), one_sided(albedo))], vec![glow]);
        let result = bake(walls, &settings(&LIT, 64, 0.03));
        let expected = 2.0 / (1.0 - albedo);
        let (mut worst, mut squares, mut area) = (0.0_f64, 0.0, 0.0);
        for (e, area_m2) in texels(map(&result, 0)) {
            let off = e / expected - 1.0;
            worst = worst.max(off.abs());
            squares += off * off * area_m2;
            area += area_m2;
        }
        let rms = (squares / area).sqrt();
        assert!(
            worst < 0.01 && rms < 0.002,
            "albedo {albedo}: {worst} at most, {rms}"
        );
        assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    }
}

/// What a lamp sends is what walls take: Σ (1 − ρ) E A = Φ. A ball of glass before the lamp changes nothing: its caustic is
/// gathered from, and rays go through it.
#[test]
fn walls_take_all_that_a_lamp_sends() {
    let all = [LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
    let ball = sphere(dvec3(0.5, 0.5, 1.0), 0.3, 96, 48);
    for (albedo, ball, settings, tolerance) in [
        (0.5, None, settings(&LIT, 128, 0.03), 0.005),
        (0.8, None, settings(&LIT, 128, 0.03), 0.005),
        (0.8, Some(ball), settings(&all, 64, 0.05), 0.01),
    ] {
        let has_ball = ball.is_some();
        let mut parts = vec![(room(), one_sided(albedo))];
        parts.extend(ball.map(|ball| (ball, smooth(SurfaceKind::Dielectric))));
        let lamp = point_light(dvec3(0.3, 1.2, 0.7), 5.0);
        let result = bake(scene(parts, vec![lamp]), &settings);
        let all = result.maps.iter().flat_map(texels);
        let flux_w: f64 = all.map(|(e, area_m2)| e * area_m2).sum();
        let taken = (1.0 - albedo) * flux_w / (4.0 * PI * 5.0);
        assert!((taken - 1.0).abs() < tolerance, "albedo {albedo}: {taken}");
        let gathered = result.counts.gather_segments as f64 / result.counts.gather_rays as f64;
        assert!(!has_ball || gathered > 1.1, "rays go through the glass");
    }
}

/// A floor under a lamp gets a hundredth of its light by way of a ball of glass: beside the lamp's, the noise of so little
/// is not seen, and takes fewer rays than for a layer of its own.
#[test]
fn noise_beside_bright_light_costs_no_rays() {
    let parts = || {
        let ball = sphere(dvec3(0.0, 0.5, 0.0), 0.3, 48, 24);
        vec![
            (floor(1.0, 0.0), diffuse(0.5)),
            (ball, smooth(SurfaceKind::Dielectric)),
        ]
    };
    let lamp = || point_light(dvec3(0.0, 2.0, 0.0), 5.0);
    let all = [LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
    let [alone, beside] = [ErrorMetric::Rmse, ErrorMetric::Visible].map(|metric| {
        let settings = set(settings(&all, 64, 0.1), |settings| settings.error_metric = metric);
        let result = bake(scene(parts(), vec![lamp()]), &settings);
        assert!(
            metric == ErrorMetric::Rmse || result.warnings.is_empty(),
            "{:?}",
            result.warnings
        );
        result.counts.gather_rays
    });
    assert!(4 * beside < alone, "{beside} and {alone} rays");
}

/// What comes from other surfaces where each element gets E = 1 W/m² from elsewhere, by paths over at most `max_depth`
/// clear surfaces, and what became of the rays; maps by object and side [texels].
fn under_even_light(
    parts: Vec<(Mesh, Material)>,
    maps: &[(usize, usize)],
    max_depth: u32,
) -> (Vec<LinearSrgb>, TraceCounts) {
    let (network, passes) = traced(parts, maps, max_depth);
    let solved = network.solve(&vec![LinearSrgb::WHITE; passes.len()], &passes);
    (solved.irradiance, network.counts())
}

/// The same rays, and the passes of each element.
fn traced(parts: Vec<(Mesh, Material)>, maps: &[(usize, usize)], max_depth: u32) -> (Network, Vec<u8>) {
    let scene = Arc::new(scene(parts, vec![]));
    let tracer = Tracer::new(Arc::clone(&scene));
    let chart =
        |&(object, side): &(usize, usize)| Arc::new(support::scenes::chart(&tracer, object, side, side));
    let charts: Vec<Arc<Chart>> = maps.iter().map(chart).collect();
    let mut network = Network::new(&scene, &charts);
    let passes = vec![MIN_PASSES; network.element_count()];
    assert!(network.trace(&tracer, &passes, (max_depth, 0), &(), &Control::default()));
    (network, passes)
}

/// Single rays that meet a bright focus by way of glass are no dots on the floor, but their flux is there. What is exact
/// enough stays as it is.
#[test]
fn noise_beyond_the_target_is_spread() {
    let side = 64;
    let ball = sphere(dvec3(0.0, 0.5, 0.0), 0.3, 48, 24);
    let parts = vec![
        (floor(1.0, 0.0), diffuse(0.5)),
        (ball, smooth(SurfaceKind::Dielectric)),
    ];
    let (network, passes) = traced(parts, &[(0, side)], 64);
    let mut sources = vec![LinearSrgb::BLACK; passes.len()];
    sources[side / 2 * (side + 1)] = LinearSrgb::grey(1000.0);
    let solution = network.solve(&sources, &passes);
    let tolerance = network.tolerance(&solution, &sources, ErrorMetric::Rmse);
    let areas_m2 = || network.grids().iter().flat_map(|grid| grid.elements.all());
    let smoothed = |target: f64| {
        let smoothing = NoiseSmoothing::new(&network, &solution, &tolerance, target);
        let all = smoothing.of(&network, &solution.irradiance);
        all.into_iter().map(|e| e.g).collect::<Vec<f64>>()
    };
    let flux_w = |values: &[f64]| {
        let all = values.iter().zip(areas_m2());
        all.map(|(e, element)| e * element.area_m2).sum::<f64>()
    };
    let roughness = |values: &[f64]| {
        let rows = values.chunks(side);
        let steps = rows.flat_map(|row| row.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)));
        steps.sum::<f64>()
    };
    let plain: Vec<f64> = solution.irradiance.iter().map(|e| e.g).collect();
    let spread = smoothed(0.03);
    assert_close(flux_w(&spread), flux_w(&plain), 1e-9, "flux");
    let [before, after] = [&plain, &spread].map(|values| roughness(values));
    assert!(20.0 * after < before, "{after} for {before}");
    assert!(spread.iter().all(|e| *e >= 0.0));
    assert!(smoothed(1e6) == plain);
}

/// In light that is the same everywhere, what stands in it (glass, a mirror, coat) changes nothing.
#[test]
fn anything_clear_changes_no_even_light() {
    let albedo = 0.7;
    for kind in [
        SurfaceKind::Dielectric,
        SurfaceKind::ThinWall,
        SurfaceKind::Mirror,
    ] {
        let ball = sphere(dvec3(0.5, 0.6, 1.0), 0.3, 48, 24);
        let parts = vec![(room(), one_sided(albedo)), (ball, smooth(kind))];
        let expected = albedo / (1.0 - albedo);
        let (irradiance, counts) = under_even_light(parts, &[(0, 16)], 64);
        let is_off = |e: &&LinearSrgb| (e.g / expected - 1.0).abs() >= 1e-3;
        let off: Vec<&LinearSrgb> = irradiance.iter().filter(is_off).collect();
        // In a ball of facets with smooth normals a ray may go round for ever, but then it is booked as cut off.
        let excused = counts.truncated.round();
        assert!(
            off.len() as f64 <= excused && excused <= 1.0,
            "{kind:?}: {off:?} for {expected}"
        );
    }
}

/// Where a share t of all light is cut off within glass, ρ(1 − t)/(1 − ρ(1 − t)) is left of it: what is missing is booked.
#[test]
fn light_that_is_cut_off_in_glass_is_booked() {
    let albedo = 0.7;
    let ball = sphere(dvec3(0.5, 0.6, 1.0), 0.3, 48, 24);
    let parts = vec![
        (room(), one_sided(albedo)),
        (ball, smooth(SurfaceKind::Dielectric)),
    ];
    let (irradiance, counts) = under_even_light(parts, &[(0, 16)], 1);
    let cut_off = counts.truncated / counts.rays as f64;
    let mean = irradiance.iter().map(|e| e.g).sum::<f64>() / irradiance.len() as f64;
    let left = |cut_off: f64| albedo * (1.0 - cut_off) / (1.0 - albedo * (1.0 - cut_off));
    let missing = left(0.0) - mean;
    assert_close(missing, left(0.0) - left(cut_off), 0.05, "light that is missing");
}

/// In a sphere full of coloured water light goes 2R cos θ from wall to wall, so that T̄ = ∫ 2c e^(−2Rσc) dc of it arrives:
/// where all walls get E = 1 from elsewhere, ρT̄/(1 − ρT̄) comes from other walls.
#[test]
fn water_takes_its_share_between_walls() {
    let (albedo, radius_m) = (0.6, 0.8);
    let colour = rgb(0.3, 0.6, 0.95);
    let water = tinted(smooth(SurfaceKind::Dielectric), 1.0, colour);
    let wall = inside_out(sphere(DVec3::ZERO, radius_m, 96, 48));
    let parts = vec![
        (wall, one_sided(albedo)),
        (cuboid(-DVec3::ONE, DVec3::ONE), water),
    ];
    let (irradiance, _) = under_even_light(parts, &[(0, 24)], 16);
    let sum = irradiance.iter().fold(LinearSrgb::BLACK, |sum, e| sum + *e);
    let mean = sum / irradiance.len() as f64;
    for (found, colour) in mean.to_array().into_iter().zip(colour.to_array()) {
        let x = -2.0 * radius_m * colour.ln();
        let arriving = albedo * 2.0 * (1.0 - (1.0 + x) * (-x).exp()) / (x * x);
        assert_close(found, arriving / (1.0 - arriving), 0.005, "indirect light");
    }
}

/// Within glass radiance is n² times what it is outside: a black plate in the middle of a ball gets n²(1 − R₀) times what
/// it would get without, as what the ball's surface sends back comes to the plate again.
#[test]
fn radiance_in_glass_grows_by_index_squared() {
    let (albedo, ior) = (0.7, 1.5);
    let (middle, half) = (dvec3(0.5, 0.6, 1.0), 0.01);
    let ball = (sphere(middle, 0.3, 192, 96), smooth(SurfaceKind::Dielectric));
    let corner = middle - dvec3(half, 0.0, half);
    let plate = quad(corner, DVec3::Z * 2.0 * half, DVec3::X * 2.0 * half);
    let parts = vec![(room(), one_sided(albedo)), ball, (plate, diffuse(0.0))];
    let (irradiance, _) = under_even_light(parts, &[(0, 16), (2, 8)], 64);
    let on_plate = &irradiance[irradiance.len() - 64..];
    let mean = on_plate.iter().map(|e| e.g).sum::<f64>() / on_plate.len() as f64;
    let reflected = ((ior - 1.0_f64) / (ior + 1.0)).powi(2);
    let expected = ior * ior * (1.0 - reflected) * albedo / (1.0 - albedo);
    assert_close(mean, expected, 0.02, "on the plate");
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

/// Mean of the factor over each texel of a square map over a rectangle: corner, sides along u and v.
fn expected_factors(side: usize, [corner, u, v]: [DVec3; 3], sender: &[DVec3]) -> Vec<f64> {
    let fine = 4;
    let normal = v.cross(u).normalize();
    let place = |index: usize, step: usize| ((index * fine + step) as f64 + 0.5) / (side * fine) as f64;
    let of_texel = |texel: usize| {
        let of_step = |step: usize| {
            let (across, down) = (place(texel % side, step % fine), place(texel / side, step / fine));
            polygon_factor(corner + u * across + v * down, normal, sender)
        };
        (0..fine * fine).map(of_step).sum::<f64>() / (fine * fine) as f64
    };
    (0..side * side).map(of_texel).collect()
}

/// Relative error of the mean, and root mean square error over the mean.
fn errors(found: &[f64], expected: &[f64]) -> (f64, f64) {
    let mean = found.iter().sum::<f64>() / expected.iter().sum::<f64>() - 1.0;
    (mean, common::rmse(found, expected))
}

/// One plate lit by the sun lights another: over it, and beside it at a right angle.
#[test]
fn plates_light_each_other_by_form_factors() {
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| dvec3(x, 0.0, z));
    // Corner, then sides along u and v; a quad faces v × u.
    let over = [dvec3(-0.5, 1.0, 0.5), DVec3::X, DVec3::NEG_Z];
    let beside = [dvec3(-0.5, 0.0, 0.5), DVec3::Y, DVec3::NEG_Z];
    for (name, plate, slope) in [("parallel", over, 1.6), ("perpendicular", beside, 0.0)] {
        let sunlight = sun(dvec3(slope, -1.0, 0.0), 3.0);
        let mesh = quad(plate[0], plate[1], plate[2]);
        let parts = vec![(floor(0.5, 0.0), one_sided(0.7)), (mesh, one_sided(0.0))];
        let result = bake(scene(parts, vec![sunlight]), &settings(&LIT, 32, 0.015));
        let lit = layer(map(&result, 0), LayerKind::Direct)[0];
        let found = layer(map(&result, 1), LayerKind::Indirect);
        let factors = expected_factors(32, plate, &corners);
        let expected: Vec<f64> = factors.iter().map(|factor| 0.7 * lit * factor).collect();
        let (mean, rms) = errors(&found, &expected);
        let estimate = map(&result, 1).estimated_relative_rmse.expect("an estimate");
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
    let patch = |x: f64| quad(dvec3(x, 0.0, -0.5), DVec3::X, DVec3::Z);
    let mirror = quad(dvec3(-4.0, 1.0, 4.0), DVec3::X * 8.0, DVec3::NEG_Z * 8.0);
    let silver = Material {
        double_sided: false,
        base_colour: LinearSrgb::grey(0.9),
        ..smooth(SurfaceKind::Mirror)
    };
    let sunlight = sun(dvec3(6.0, -1.0, 0.0), 30.0);
    let parts = vec![
        (patch(-1.0), one_sided(0.6)),
        (patch(0.0), one_sided(0.0)),
        (mirror, silver),
    ];
    let all = [LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
    let result = bake(scene(parts, vec![sunlight]), &settings(&all, 64, 0.01));
    let sender = texels(map(&result, 0));
    let lit = sender.iter().map(|(e, _)| e).sum::<f64>() / sender.len() as f64;
    let image = [(-1.0, -0.5), (0.0, -0.5), (0.0, 0.5), (-1.0, 0.5)].map(|(x, z)| dvec3(x, 2.0, z));
    let plate = [dvec3(0.0, 0.0, -0.5), DVec3::X, DVec3::Z];
    let factors = expected_factors(64, plate, &image);
    // Metal reflects a little more at a slant (Schlick): up to a percent of what it reflects, within 45°.
    let expected: Vec<f64> = factors.iter().map(|factor| 0.6 * 0.9 * lit * factor).collect();
    let found = layer(map(&result, 1), LayerKind::Indirect);
    let (mean, rms) = errors(&found, &expected);
    assert!(mean.abs() < 0.01 && rms < 0.02, "mean {mean}, rms {rms}");
}

fn small_room() -> Scene {
    let ball = sphere(dvec3(0.5, 0.3, 1.0), 0.3, 24, 12);
    let lamp = point_light(dvec3(0.3, 1.1, 0.7), 5.0);
    scene(vec![(room(), one_sided(0.5)), (ball, diffuse(0.8))], vec![lamp])
}

#[test]
fn same_bits_for_any_threads_and_any_past() {
    let [one, two] = [1, 2].map(|threads| {
        let settings = set(settings(&LIT, 32, 0.1), |s| s.threads = threads);
        bake(small_room(), &settings)
    });
    assert!(all_bits(&one) == all_bits(&two), "two threads");
    // A session that knows more rays already gives the same, and traces none.
    let mut session = Baker::new(Arc::new(small_room())).expect("a session");
    let finer = run(&mut session, &settings(&LIT, 32, 0.02));
    assert!(finer.counts.gather_rays > 0);
    let mut dimmed = Scene::clone(session.scene());
    dimmed.lights[0].colour = rgb(1.0, 0.5, 0.25);
    session.set_scene(Arc::new(dimmed.clone())).expect("an edit");
    let coarser = run(&mut session, &settings(&LIT, 32, 0.06));
    assert_eq!(coarser.counts.gather_rays, 0, "dimming a lamp needs no ray");
    let fresh = bake(dimmed, &settings(&LIT, 32, 0.06));
    assert!(fresh.counts.gather_rays < finer.counts.gather_rays);
    assert!(all_bits(&coarser) == all_bits(&fresh), "another past");
}

#[test]
fn lights_add_up_to_the_layer() {
    let mut scene = small_room();
    scene.lights.push(Light {
        colour: rgb(0.2, 0.5, 1.0),
        ..point_light(dvec3(0.8, 0.4, 1.7), 2.0)
    });
    let settings = set(settings(&LIT, 32, 0.1), |s| s.per_light = true);
    let result = bake(scene, &settings);
    for map in &result.maps {
        let whole = map.layer(LayerKind::Indirect).expect("the layer");
        let parts = result.light_layers.iter();
        let parts: Vec<_> = parts
            .filter(|part| part.receiver == map.chart.receiver && part.kind == LayerKind::Indirect)
            .collect();
        assert_eq!(parts.len(), 2);
        for (texel, e) in whole.irradiance.iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part.irradiance[texel][2]).sum();
            let off = (sum - e[2]).abs();
            assert!(off <= 1e-4 * e[2].max(1e-3), "texel {texel}: {sum} for {}", e[2]);
        }
    }
}
