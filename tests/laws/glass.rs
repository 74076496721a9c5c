//! Glass and water: every angle, every index, bodies in bodies, and what they absorb.

use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::optics::refraction::{cos_transmitted, refract};

use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Baked, Table};
use support::prelude::*;
use support::tools::{set, settings, to};

pub fn fill(t: &mut Table) {
    slabs_and_angles(t);
    bodies(t);
    bars_below_a_slab(t);
    absorption(t);
    truncated(t);
}

/// What goes through both surfaces of a slab at last: (1 − R)/(1 + R).
fn through_slab(ior: f64) -> f64 {
    let single = ((ior - 1.0) / (ior + 1.0)).powi(2);
    (1.0 - single) / (1.0 + single)
}

fn slabs_and_angles(t: &mut Table) {
    let mut upright_sun = |name: String, ior: f64, scene: Scene| {
        t.case(name)
            .bake_with(scene.sun(DVec3::NEG_Y), thoroughly(to(0.01, 16)))
            .e("(1 − R)/(1 + R)", 1e-6, move |_| through_slab(ior));
    };
    upright_sun("normal-incidence".into(), 1.5, under_slab(1.5));
    // Whichever way its triangles turn, a body is a body.
    upright_sun(
        "glass-inside-out".into(),
        1.5,
        under_slab(1.5).reshaped(1, turned),
    );
    for ior in [0.7, 1.0 - 1e-3, 1.0 + 1e-3, 3.0, 10.0] {
        upright_sun(format!("index-{ior}"), ior, under_slab(ior));
    }
    for thickness_m in [1e-3, 1e-6, 1e-9] {
        let film = floor(0.5).glass(1.5, slab(0.5, 0.5 + thickness_m));
        upright_sun(format!("slab-of-{thickness_m:e}-m"), 1.5, film);
    }
    for index in 0..12 {
        t.case("axes-and-signed-zeros")
            .bake_with(along_an_axis(index), thoroughly(to(0.01, 8)))
            .e("(1 − R)/(1 + R)", 1e-6, |_| through_slab(1.5));
    }
    let place = dvec3(0.1, 1.5, 0.05);
    for ior in [1.0, 1.0 + 1e-6, 1.0 - 1e-6] {
        t.case("index-1")
            .bake(under_slab(ior).lamp(place), 0.01, 32)
            .e_of_lamp("that of the lamp alone", 1e-3, place);
    }
    t.case("every-angle")
        // Next to the critical angle of a weak interface a rounding of cosines moves R by its root, over the cosine.
        .fact("R is the same from both sides", 1e-4, || over_angles(other_side))
        .fact("directions are unit", 1e-14, || {
            over_angles(|_, _, [_, out]| (out.length() - 1.0).abs())
        })
        .fact("Snell: sines by their indices", 1e-8, || {
            over_angles(|eta, _, [incident, out]| (out.x * eta - incident.x).abs())
        });
    for (elevation_deg, target) in [(10.0_f64, 0.02), (1.0, 0.005)] {
        let (sine, cosine) = elevation_deg.to_radians().sin_cos();
        let water = shapes::floor([-3.0, 3.0], [-3.0, 3.0], 0.5);
        let sun = dvec3(cosine, -sine, 0.0);
        t.case("grazing-sun")
            .bake(floor(0.5).glass(1.333, water).sun(sun), target, 32)
            .e("(1 − R) sin h", 1e-6, move |_| {
                sine * (1.0 - dielectric_reflectance(sine, 1.333))
            });
    }
    // A sun in glass at the angle where nothing gets out any more, less or plus a ten-millionth.
    let critical_rad = (1.0 / 1.5_f64).asin();
    let below = 1.0 - dielectric_reflectance((critical_rad - 1e-7).cos(), 1.0 / 1.5);
    t.case("below-the-critical-angle")
        .bake(out_of_glass(critical_rad - 1e-7), 0.1, 32)
        .measure_within("1 − R gets out", (1e-6, flux_noise), move |bake| {
            off(deposited_w(bake), below * emitted_w(bake))
        });
    t.case("above-the-critical-angle")
        .bake(out_of_glass(critical_rad + 1e-7), 0.1, 32)
        .arrives(0.0);
}

fn bodies(t: &mut Table) {
    let inner = shapes::sphere(dvec3(0.05, 0.52, 0.0), 0.15, 3);
    t.case("glass-in-the-same-glass")
        .bake(glass_ball(4), 0.01, 32)
        .bake(glass_ball(4).glass(1.5, inner), 0.01, 32)
        .watts_as_first("watts as without it", 2e-3)
        .as_first_within_errors();
    let bright_branches = || set(to(0.01, 16), |s| s.branch_threshold = Some(1e-4));
    t.case("overlapping-glass")
        .bake_with(slabs(&[[0.3, 0.7]], 1.5), bright_branches())
        .bake_with(slabs(&[[0.3, 0.55], [0.45, 0.7]], 1.5), bright_branches())
        .as_first("map as of one slab", 1e-6, 1.0)
        .bake_with(slabs(&[[0.3, 0.5 + 1e-9], [0.5, 0.7]], 1.5), bright_branches())
        .as_first("map as of one slab", 1e-6, 1.0);
    for missing in 0..12 {
        let mut block = shapes::cuboid(dvec3(-0.3, 0.2, -0.3), dvec3(0.3, 0.6, 0.3));
        block.triangles.remove(missing);
        t.case("open-glass")
            .bake(floor(0.5).glass(1.5, block).lamp(dvec3(0.1, 1.5, 0.05)), 0.05, 16)
            .arrives_of_sent(1.0);
    }
    let around = |material: Material, radii_m: &[f64]| {
        let ball = |radius_m: &f64| shapes::sphere(DVec3::Y, *radius_m, 5);
        radii_m.iter().fold(floor(0.5).lamp(DVec3::Y), |scene, radius_m| {
            scene.with("ball", ball(radius_m), material.clone())
        })
    };
    let clear = parts::dielectric("glass", 1.5);
    t.case("lamp-in-clear-glass")
        .bake_with(around(clear, &[0.3]), thoroughly(to(0.01, 32)))
        .e_of_lamp("that of the lamp alone", 0.01, DVec3::Y);
    // By orders of reflection: (1 − R)·a·Σ(R a²)ⁿ, a over one radius. Glass in the same glass changes nothing.
    let across = 0.01_f64.powf(0.3);
    let out = 0.96 * across / (1.0 - 0.04 * across * across);
    for (name, radii_m) in [
        ("lamp-in-tinted-glass", &[0.3][..]),
        ("lamp-in-nested-glass", &[0.15, 0.3]),
    ] {
        let dim = tinted(parts::dielectric("dim", 1.5), 1.0, LinearSrgb::grey(0.01));
        t.case(name)
            .bake_with(around(dim, radii_m), thoroughly(to(0.01, 32)))
            .e("that of the lamp, by Beer and Lambert", 0.01, move |point| {
                out * from_lamp(point, DVec3::Y)
            });
    }
}

/// Share of red, green and blue light that 0.7 m of this water leave.
const WATER_COLOUR: LinearSrgb = rgb(0.3, 0.5, 0.8);

/// What absorbs takes its share by the way within, before the first surface too; by both estimators.
fn absorption(t: &mut Table) {
    let flat = shapes::floor([-0.5, 0.5], [-0.5, 0.5], 0.0);
    // Its second half is a step 0.3 m high: no plane.
    let mut stepped = shapes::floor([-0.5, 0.0], [-0.5, 0.5], 0.0);
    shapes::append(&mut stepped, &shapes::floor([0.0, 0.5], [-0.5, 0.5], 0.3));
    for (name, mesh, depths_m) in [("flat", flat, [1.0, 1.0]), ("stepped", stepped, [1.0, 0.7])] {
        let body = shapes::cuboid(dvec3(-1.0, -0.4, -1.0), dvec3(1.0, 1.0, 1.0));
        let scene = Scene::default().diffuse("floor", mesh).sun(DVec3::NEG_Y);
        let water = tinted(parts::dielectric("water", 1.333), 0.7, WATER_COLOUR);
        let scene = scene.with("water", body, water);
        let says = "E of red, green, blue is what the water leaves";
        t.case(format!("{name}-floor-in-coloured-water"))
            .bake(scene.clone(), 0.01, 16)
            .measure(says, 3e-3, move |bake| by_depth(bake, depths_m))
            .splat(scene, 4e4, 16)
            .measure(says, 3e-3, move |bake| by_depth(bake, depths_m));
    }
    // From the middle every ray meets the glass head on, and what is sent back crosses all of it.
    let r = dielectric_reflectance(1.0, 1.5);
    let out = WATER_COLOUR
        .map(|c| (1.0 - r) * c / (1.0 - r * c * c))
        .luminance();
    let ball = shapes::sphere(DVec3::Y, 0.5, 4);
    let glass = tinted(parts::dielectric("glass", 1.5), 0.5, WATER_COLOUR);
    let scene = floor(2.0).with("ball", ball, glass);
    let scene = scene.lit(parts::point_light("lamp", DVec3::Y, Flux(1.0)));
    for settings in [to(0.01, 16), settings(4e3, 16)] {
        t.case("coloured-glass-around-a-lamp")
            .bake_with(scene.clone(), settings)
            .sent(1.0, 1e-6)
            .ledger("absorbed by the way within", 5e-3, move |energy| {
                off(energy.absorbed, 1.0 - out)
            });
    }
}

/// Black bars between a slab and the floor, too narrow for the points of squares: photons take back what bundles lay down
/// behind them.
fn bars_below_a_slab(t: &mut Table) {
    const PITCH_M: f64 = 1.0 / 80.0;
    let mut random = random(3);
    let (mut bars, mut hidden_m) = (Mesh::default(), 0.0);
    for bar in 0..80 {
        let width_m = PITCH_M * (0.1 + 0.3 * random());
        let left_m = -0.5 + PITCH_M * f64::from(bar) + (PITCH_M - width_m) * random();
        let middle = dvec3(left_m + 0.5 * width_m, 0.25, 0.0);
        let bar = shapes::rectangle(middle, 0.6 * DVec3::Z, 0.5 * width_m * DVec3::X);
        shapes::append(&mut bars, &bar);
        hidden_m += width_m;
    }
    let black = Material {
        base_colour: LinearSrgb::BLACK,
        ..parts::mirror()
    };
    let scene = under_slab(1.5).with("bars", bars, black).sun(DVec3::NEG_Y);
    t.case("bars-below-a-slab")
        .bake(scene, 0.02, 16)
        .watts((1.0 - hidden_m) * through_slab(1.5), 0.005);
}

/// What is given up is booked by its cause, and is part of the estimated error. Photons follow every branch, however weak.
fn truncated(t: &mut Table) {
    let slab = shapes::cuboid(dvec3(-1.0, 0.5, -1.0), dvec3(1.0, 0.7, 1.0));
    let scene = floor(0.5).sun(DVec3::NEG_Y).glass(1.5, slab);
    let r = dielectric_reflectance(1.0, 1.5);
    let at_most = |max_depth, branch_threshold, settings: BakeSettings| BakeSettings {
        max_depth: Some(max_depth),
        branch_threshold,
        ..settings
    };
    // At most two surfaces: what the lower one sends back up ends. Or branches below a twentieth do, at either.
    for settings in [to(0.01, 16), settings(1e4, 16)] {
        t.case("given-up-by-depth")
            .bake_with(scene.clone(), at_most(2, None, settings))
            .ledger("(1 − R) R is given up by depth", 1e-3, move |e| {
                off(e.truncated.depth / e.emitted, (1.0 - r) * r)
            })
            .share("given up by the threshold", 0.0, |e| e.truncated.threshold);
    }
    t.case("given-up-by-threshold")
        .bake_with(scene.clone(), at_most(16, Some(0.05), settings(1e4, 16)))
        .ledger("R + (1 − R) R is given up by the threshold", 1e-3, move |e| {
            off(e.truncated.threshold / e.emitted, r + (1.0 - r) * r)
        })
        .share("given up by depth", 0.0, |e| e.truncated.depth);
    let many = settings(4e4, 16);
    t.case("given-up-light-is-in-the-error")
        .bake_with(scene.clone(), many.clone())
        .bake_with(scene, at_most(many.depth(), Some(0.05), many))
        .compare(
            "missing or given up, over the estimated error",
            1.0,
            missing_over_estimate,
        );
}

fn turned(mesh: &mut Mesh) {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
}

/// The worst over interfaces and angles, crowded at 0, at 90 degrees and at the critical one, of a function of the
/// relative index, R, and the directions of incidence and refraction.
fn over_angles(of: impl Fn(f64, f64, [DVec3; 2]) -> f64) -> f64 {
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut worst: f64 = 0.0;
    for eta in [1.0, 1.0 + 1e-6, 1.0 - 1e-6, 0.7, 1.0 / 1.5, 1.333, 1.5, 3.0, 10.0] {
        let critical = if eta < 1.0 { f64::asin(eta) } else { 1.0 };
        let near = (0..16).map(|digit| 10.0_f64.powi(-digit));
        let near = near.flat_map(|step| [step, quarter - step, critical - step, critical + step]);
        let angles = near.chain((0..1000).map(|step| quarter * f64::from(step) / 1000.0));
        for angle in angles.filter(|angle| (0.0..quarter).contains(angle)) {
            let incident = dvec3(angle.sin(), -angle.cos(), 0.0);
            let there = dielectric_reflectance(angle.cos(), eta);
            assert!((0.0..=1.0).contains(&there), "R is {there} at {angle} for {eta}");
            if let Some(refracted) = refract(incident, DVec3::Y, eta) {
                worst = worst.max(of(eta, there, [incident, refracted]));
            }
        }
    }
    worst
}

fn other_side(eta: f64, there: f64, [incident, _]: [DVec3; 2]) -> f64 {
    let beyond = cos_transmitted(-incident.y, eta).expect("it is refracted");
    (there - dielectric_reflectance(beyond, 1.0 / eta)).abs()
}

/// Seen from below, an open sheet with its normals up is the surface of the glass that the sun comes through.
fn out_of_glass(angle_rad: f64) -> Scene {
    let ceiling = shapes::floor([-50.0, 50.0], [-0.5, 0.5], 0.01);
    let sheet = shapes::floor([-0.5, 0.5], [-0.5, 0.5], 0.0);
    let sun = dvec3(angle_rad.sin(), angle_rad.cos(), 0.0);
    Scene::default()
        .diffuse("floor", ceiling)
        .glass(1.5, sheet)
        .sun(sun)
}

/// A sun along an axis, one way or the other, with zeros of either sign, on a slab and a wall across it.
fn along_an_axis(index: usize) -> Scene {
    let (axis, (sign, zero)) = (
        index % 3,
        [(1.0, 0.0), (-1.0, 0.0), (1.0, -0.0), (-1.0, -0.0)][index / 3],
    );
    let mut direction = DVec3::splat(zero);
    direction[axis] = sign;
    let (mut across, mut down) = (DVec3::ZERO, DVec3::ZERO);
    (across[(axis + 1) % 3], down[(axis + 2) % 3]) = (1.0, 1.0);
    let wall = shapes::rectangle(direction, across * 0.5, down * 0.5);
    let (low, high) = (
        direction * 0.1 - (across + down),
        direction * 0.3 + (across + down),
    );
    let slab = shapes::cuboid(low.min(high), low.max(high));
    Scene::default()
        .diffuse("floor", wall)
        .glass(1.5, slab)
        .sun(direction)
}

fn missing_over_estimate(short: &Baked, whole: &Baked) -> f64 {
    let energy = &short.result.ledgers[0].energy_w;
    let missing = 1.0 - energy.deposited / deposited_w(whole);
    let share = energy.truncated.total() / energy.emitted;
    assert!(missing > 1e-3 && share > 0.07, "{missing}, {share}");
    missing.max(share) / short.result.estimated_relative_rmse.expect("an estimate")
}

/// How far E is off in the middle of the floor's first and last triangle, channel by channel, below so much water.
fn by_depth(bake: &Baked, depths_m: [f64; 2]) -> f64 {
    let map = floor_map(bake).expect("a lit floor");
    let layer = map.layer(LayerKind::Caustic).expect("a layer");
    let through = 1.0 - dielectric_reflectance(1.0, 1.333);
    let triangles = [0, map.chart.corner_uvs.len() - 1].into_iter().zip(depths_m);
    let offs = triangles.flat_map(|(triangle, depth_m)| {
        let uv = map.chart.uv(triangle, [1.0 / 3.0; 3]);
        let texel = [uv.x * map.width() as f64, uv.y * map.height() as f64].map(|x| x as usize);
        let e = layer.irradiance[map.chart.texel_at(texel[0], texel[1])];
        let channels = e.into_iter().zip(WATER_COLOUR.to_array());
        channels.map(move |(e, colour)| off(f64::from(e), through * colour.powf(depth_m / 0.7)))
    });
    offs.fold(0.0, f64::max)
}
