//! What must not change a map or its ledgers, or must change them just so.

use nephroid::scene::PanelShape;
use nephroid::settings::{Footprint, Kernel, KernelSampling, RayPlacement, Sigma};

use support::hard_scenes::roughened;
use support::laws::law::*;
use support::laws::scenes::*;
use support::laws::{Baked, Table, energy_residual, is_long};
use support::prelude::*;
use support::tools::{bake, builtin_scene, photons, set, settings, to, transformed};

pub fn fill(t: &mut Table) {
    for (name, scene) in [
        ("mirror", before(upright())),
        ("glass-ball", glass_ball(3)),
        ("slab", builtin_scene("slab")),
        ("ring", builtin_scene("ring")),
    ] {
        symmetries(t, name, &scene);
    }
    uniform_scale(t);
    let names: &[&str] = if is_long() {
        &["ring", "ball", "pool", "slab", "nephroid"]
    } else {
        &["ring", "ball"]
    };
    for name in names {
        t.case(format!("a-tenth-of-the-target-{name}"))
            .bake(builtin_scene(name), 0.0025, 32)
            .bake(builtin_scene(name), 0.1, 32)
            .bake(builtin_scene(name), 0.01, 32)
            .law(
                "error for a tenth of the target over that for the target",
                0.5,
                |bakes| {
                    let error = |bake: &Baked| maps_apart(&bake.result.maps, &bakes[0].result.maps, 1.0);
                    error(&bakes[2]) / error(&bakes[1])
                },
            );
    }
    threads(t);
    seeds(t);
    ledgers(t);
}

fn symmetries(t: &mut Table, name: &str, scene: &Scene) {
    let turn = DMat3::from_axis_angle(dvec3(0.6, 0.0, 0.8), 0.7);
    let moved = |rotation, offset| transformed(scene.clone(), rotation, 1.0, offset);
    t.case(format!("rigid-motion-{name}"))
        .bake(scene.clone(), 0.01, 32)
        .bake(moved(turn, dvec3(3.1, -7.3, 0.9)), 0.01, 32)
        .watts_as_first("watts", 0.01)
        .as_first_within_errors()
        // Lamps start their rays in the same directions wherever they stand.
        .bake(moved(DMat3::IDENTITY, DVec3::splat(64.0)), 0.01, 32)
        .as_first("maps, moved by 64 m along the axes", 1e-5, 1.0);
    let mut triangles = scene.clone();
    for object in &mut triangles.objects {
        object.mesh_in_scene_mut().triangles.reverse();
    }
    t.case(format!("order-of-triangles-{name}"))
        .bake(scene.clone(), 0.01, 32)
        .bake(triangles, 0.01, 32)
        .watts_as_first("triangles in reverse: watts", 1e-3);
}

/// E of lamps is divided by the square of the size; of suns and panels it stays. Where light divides, a few of its
/// borders are found elsewhere at another size.
fn uniform_scale(t: &mut Table) {
    let [mut coloured, mut sunny] = [0; 2].map(|_| glass_ball(3));
    let glass = &mut coloured.materials[1];
    *glass = tinted(glass.clone(), 0.3, rgb(0.5, 0.8, 0.9));
    sunny.lights.clear();
    let (centre, sides) = (dvec3(0.1, 0.5, 0.0), [DVec3::Z * 0.1, DVec3::X * 0.1]);
    let panel = panel(centre, sides, PanelShape::Rectangle, 1.0);
    let ceiling = shapes::rectangle(DVec3::Y, DVec3::X * 0.5, DVec3::Z * 0.5);
    for (name, scene, power, settings) in [
        ("tinted-ball", coloured, -2, to(0.01, 32)),
        (
            "ball-under-a-sun",
            sunny.sun(dvec3(0.2, -1.0, 0.1)),
            0,
            to(0.01, 32),
        ),
        (
            "panel-below-a-mirror",
            floor(0.5).mirror(ceiling).lit(panel),
            0,
            photons(1e4, 32),
        ),
    ] {
        for scale in [0.25_f64, 8.0] {
            t.case(format!("uniform-scale-{name}"))
                .bake_with(scene.clone(), settings.clone())
                .bake_with(
                    transformed(scene.clone(), DMat3::IDENTITY, scale, DVec3::ZERO),
                    settings.clone(),
                )
                .as_first(
                    "E as 1/s² of lamps, as it is of suns and panels",
                    1e-3,
                    scale.powi(power),
                );
        }
    }
}

fn threads(t: &mut Table) {
    let splats = |rays| BakeSettings {
        rays,
        map_resolution: MapResolution::Auto,
        ..settings(2e4, 0)
    };
    let with_direct = set(to(0.01, 128), |s| {
        s.layers = vec![LayerKind::Caustic, LayerKind::Direct]
    });
    let filtered = set(photons(3e5, 64), |s| s.filter = Some(true));
    let [ring, ball] = ["ring", "ball"].map(builtin_scene);
    let rough = roughened("ball", 0.3);
    for (name, scene, settings, many) in [
        ("ring", &ring, splats(RayPlacement::Lattice), &[2, 4, 7][..]),
        ("ball", &ball, with_direct, &[2, 3, 4, 7, 64]),
        ("ball", &ball, splats(RayPlacement::Jittered), &[2, 4, 7]),
        ("rough-ball", &rough, filtered, &[3]),
    ] {
        let same = t
            .case(format!("threads-{name}"))
            .bake_with(scene.clone(), set(settings.clone(), |s| s.threads = 1));
        for threads in many.iter().copied() {
            same.bake_with(scene.clone(), set(settings.clone(), |s| s.threads = threads))
                .bits_as_first("the same map, bit for bit")
                .compare("the same ledgers, errors and counts", 0.0, |many, one| {
                    let [many, one] = [many, one].map(|bake| &bake.result);
                    let errors = |result: &Bake| {
                        result
                            .maps
                            .iter()
                            .map(|map| map.error.clone())
                            .collect::<Vec<_>>()
                    };
                    no(many.ledgers == one.ledgers
                        && many.counts == one.counts
                        && errors(many) == errors(one))
                });
        }
    }
}

/// Whatever is chosen by chance is chosen by the seed: where rays start, the places of lamps, the ways between surfaces.
fn seeds(t: &mut Table) {
    let mut soft = builtin_scene("ring");
    soft.lights[0].size = LightSize::Radius { radius_m: 0.1 };
    let wall = shapes::rectangle(dvec3(-0.4, 0.4, 0.0), DVec3::Y * 0.4, DVec3::Z * 0.4);
    let jittered = set(settings(2e3, 16), |s| s.rays = RayPlacement::Jittered);
    let indirect = BakeSettings {
        layers: vec![LayerKind::Indirect],
        max_error: Some(0.3),
        ..to(0.02, 16)
    };
    for (name, scene, settings) in [
        ("rays", builtin_scene("ring"), jittered),
        ("places-of-lamps", soft, photons(1e3, 16)),
        (
            "indirect-paths",
            builtin_scene("ring").diffuse("wall", wall),
            indirect,
        ),
    ] {
        let with = |seed: u64| set(settings.clone(), |s| s.seed = seed);
        let case = t.case(format!("seed-of-{name}"));
        if name == "indirect-paths" {
            case.without_books();
        }
        case.bake_with(scene.clone(), with(1))
            .bake_with(scene.clone(), with(2))
            .compare("another seed gives another map", 0.0, |other, first| {
                no(!same_bits(&other.result.maps, &first.result.maps))
            })
            .bake_with(scene, with(1))
            .bits_as_first("the same seed gives the same map");
    }
}

fn ledgers(t: &mut Table) {
    for name in builtin::NAMES {
        let settings = match name {
            // A slit of a millimetre lets one ray of hundreds through.
            "prism" => settings(2e6, 64),
            // Its sun has a size, which splats do not know. Finer maps of its many lights through glass take minutes.
            "gallery" => photons(3e3, 8),
            _ => settings(3e3, 64),
        };
        t.case(format!("ledger-of-{name}"))
            .bake_with(builtin_scene(name), settings)
            .must("something arrives", |bake| deposited_w(bake) > 0.0);
    }
    t.case("ledger-with-a-fault").check(
        "a lost watt and a value that is no number are noticed",
        faults_are_noticed,
    );
    // The same rays: not a bit of the accounts may depend on how they are drawn.
    let base = || settings(3e3, 48);
    let kernels = [Kernel::Gaussian, Kernel::Cone, Kernel::Disc, Kernel::Box];
    let footprints = [
        Footprint::Ellipse,
        Footprint::Disc,
        Footprint::Distance,
        Footprint::Fixed,
    ];
    for kernel in kernels {
        let drawn = t
            .case("kernels-and-footprints")
            .bake_with(builtin_scene("ring"), base());
        for footprint in footprints {
            for kernel_sampling in [KernelSampling::Integrated, KernelSampling::Point] {
                for sigma in [Sigma::Constant(0.5), Sigma::Adaptive] {
                    let settings = BakeSettings {
                        kernel,
                        footprint,
                        kernel_sampling,
                        sigma,
                        ..base()
                    };
                    drawn.bake_with(builtin_scene("ring"), settings).compare(
                        "the same accounts, to the bit",
                        0.0,
                        |bake, first| no(bake.result.ledgers[0].energy_w == first.result.ledgers[0].energy_w),
                    );
                }
            }
        }
    }
}

fn faults_are_noticed() {
    let sound = bake(builtin_scene("ring"), &to(0.02, 16));
    assert!(energy_residual(&sound) <= 1e-6);
    let mut lost = sound.clone();
    lost.ledgers[0].energy_w.deposited *= 1.0 + 1e-5;
    assert!(energy_residual(&lost) > 1e-6);
    for bad in [f32::NAN, f32::INFINITY, -1e-3] {
        let mut broken = sound.clone();
        broken.maps[0].layers[0].irradiance[7][2] = bad;
        assert!(energy_residual(&broken).is_infinite(), "{bad}");
    }
}
