//! Light that was traced once is deposited again without a ray, to the same bits.

use std::sync::Arc;

use nephroid::optics::LinearSrgb;
use nephroid::progress::Control;
use nephroid::scene::Scene;
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{
    BakeSettings, Footprint, ItemBufferKind, Kernel, KernelSampling, LayerKind, MapResolution, RayPlacement,
    Sigma,
};

use crate::tools::{bake, builtin_scene, energy_fault, settings};

fn again(session: &mut BakeSession, settings: &BakeSettings) -> BakeResult {
    session.bake(settings, &(), &Control::default()).expect("a bake")
}

fn session(scene: &Scene) -> BakeSession {
    BakeSession::new(Arc::new(scene.clone())).expect("a session")
}

fn assert_same(a: &BakeResult, b: &BakeResult, what: &str) {
    assert_eq!(a.ledgers, b.ledgers, "{what}");
    assert_eq!(a.maps.len(), b.maps.len(), "{what}");
    for (a, b) in a.maps.iter().zip(&b.maps) {
        assert_eq!(
            (a.chart.receiver, a.chart.width, a.chart.height),
            (b.chart.receiver, b.chart.width, b.chart.height),
            "{what}"
        );
        for (a, b) in a.layers.iter().zip(&b.layers) {
            let bits = |e: &[[f32; 3]]| e.iter().flatten().map(|e| e.to_bits()).collect::<Vec<_>>();
            assert!(bits(&a.irradiance) == bits(&b.irradiance), "{what}: another map");
        }
    }
}

/// Settings that differ from `base` in what follows tracing alone.
fn other_deposits(base: &BakeSettings) -> Vec<BakeSettings> {
    let size = |width, height| MapResolution::Fixed { width, height };
    let base = || base.clone();
    vec![
        BakeSettings {
            map_resolution: size(96, 40),
            ..base()
        },
        BakeSettings {
            map_resolution: MapResolution::Auto,
            ..base()
        },
        BakeSettings {
            kernel: Kernel::Cone,
            ..base()
        },
        BakeSettings {
            kernel_sampling: KernelSampling::Point,
            ..base()
        },
        BakeSettings {
            sigma: Sigma::Constant(0.3),
            ..base()
        },
        BakeSettings {
            sigma: Sigma::Adaptive,
            ..base()
        },
        BakeSettings {
            footprint: Footprint::Fixed,
            ..base()
        },
        BakeSettings {
            footprint: Footprint::Distance,
            ..base()
        },
        BakeSettings {
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            ..base()
        },
        BakeSettings { threads: 1, ..base() },
        base(),
    ]
}

#[test]
fn another_deposit_takes_no_ray_and_gives_a_fresh_bakes_bits() {
    for (name, rays) in [
        ("ring", RayPlacement::Lattice),
        ("ball", RayPlacement::Jittered),
        ("pool", RayPlacement::Lattice),
    ] {
        let mut scene = builtin_scene(name);
        if name == "ring" {
            scene.lights[0].colour = LinearSrgb::new(1.0, 0.7, 0.2);
        }
        let base = BakeSettings {
            rays,
            ..settings(2e4, 64)
        };
        let mut session = session(&scene);
        assert!(again(&mut session, &base).counts.rays > 0);
        for other in other_deposits(&base) {
            let what = format!("{name}, {other:?}");
            let kept = again(&mut session, &other);
            assert_eq!((kept.counts.rays, kept.counts.segments), (0, 0), "{what}");
            assert_eq!(energy_fault(&kept), None, "{what}");
            assert_same(&kept, &bake(scene.clone(), &other), &what);
        }
    }
}

#[test]
fn what_changes_the_rays_traces_them_again() {
    let base = settings(5e3, 32);
    let scene = builtin_scene("ball");
    let changed = [
        BakeSettings {
            density_per_sr: 6e3,
            ..base.clone()
        },
        BakeSettings {
            rays: RayPlacement::Jittered,
            ..base.clone()
        },
        BakeSettings {
            seed: 1,
            ..base.clone()
        },
        BakeSettings {
            max_depth: 2,
            ..base.clone()
        },
        BakeSettings {
            branch_threshold: Some(0.01),
            ..base.clone()
        },
        BakeSettings {
            item_buffer: ItemBufferKind::Cube,
            ..base.clone()
        },
    ];
    let mut session = session(&scene);
    for other in changed {
        again(&mut session, &base);
        let result = again(&mut session, &other);
        assert!(result.counts.rays > 0, "{other:?}");
        assert_same(&result, &bake(scene.clone(), &other), &format!("{other:?}"));
    }
}

#[test]
fn light_beyond_a_share_of_the_memory_is_not_kept() {
    let scene = builtin_scene("ring");
    let much = BakeSettings {
        memory_bytes: 64 << 20,
        ..settings(2e4, 32)
    };
    // Some ten thousand arrivals of 56 bytes against a quarter of this.
    let little = BakeSettings {
        memory_bytes: 1 << 20,
        ..much.clone()
    };
    // Other kernels than the bake before: its maps are of no use.
    let mut sigma = 1.0;
    let mut rays = |session: &mut BakeSession, settings: &BakeSettings| {
        sigma *= 1.1;
        let settings = BakeSettings {
            sigma: Sigma::Constant(sigma),
            ..settings.clone()
        };
        again(session, &settings).counts.rays
    };
    let mut session = session(&scene);
    assert!(rays(&mut session, &little) > 0);
    assert!(rays(&mut session, &little) > 0, "it was kept all the same");
    assert!(rays(&mut session, &much) > 0);
    assert_eq!(rays(&mut session, &much), 0);
    // A smaller limit gives back what is kept.
    assert!(rays(&mut session, &little) > 0);
    assert!(rays(&mut session, &much) > 0);
}

#[test]
fn a_cancelled_bake_leaves_nothing_behind() {
    let scene = builtin_scene("ring");
    let settings = settings(2e4, 32);
    let mut session = session(&scene);
    let control = Control::default();
    control.cancel();
    assert!(session.bake(&settings, &(), &control).expect("a part").partial);
    let whole = again(&mut session, &settings);
    assert_same(&whole, &bake(scene, &settings), "after a cancelled one");
    assert!(whole.counts.rays > 0);
}
