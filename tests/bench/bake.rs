//! CPU seconds of tracing and depositing, first and again from what was kept: `cargo bench --bench bake`.
#![allow(clippy::print_stdout)]

use std::sync::Arc;

use nephroid::progress::Control;
use nephroid::scene::builtin;
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, MapResolution};

/// Of each bake.
const REPEATS: usize = 5;

fn sized(settings: &BakeSettings, side: usize) -> BakeSettings {
    BakeSettings {
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..settings.clone()
    }
}

/// Median over fresh sessions of (light pass, deposit) of a bake at `first` texels a side, then again at `second`.
fn measure(name: &str, settings: &BakeSettings, first: usize, second: usize) {
    let scene = Arc::new(builtin::build(name).expect("a built-in scene"));
    let mut rows: Vec<[f64; 4]> = Vec::new();
    let mut rays = (0, 0);
    for _ in 0..REPEATS {
        let mut session = BakeSession::new(scene.clone()).expect("a session");
        let mut bake = |side| -> BakeResult {
            session
                .bake(&sized(settings, side), &(), &Control::default())
                .expect("a bake")
        };
        let (fresh, again) = (bake(first), bake(second));
        rays = (fresh.counts.rays, again.counts.rays);
        let light_pass = |result: &BakeResult| result.cpu_s.plan + result.cpu_s.trace + result.cpu_s.deposit;
        rows.push([
            light_pass(&fresh),
            fresh.cpu_s.deposit,
            light_pass(&again),
            again.cpu_s.deposit,
        ]);
    }
    let median = |column: usize| {
        let mut values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        values.sort_by(f64::total_cmp);
        values[REPEATS / 2]
    };
    println!(
        "{name:8} {:?} {:>9} rays at {first:4}: {:.3} s, {:.3} s of it deposit; again at {second:4}: {} rays, {:.3} s, {:.3} s of it deposit",
        settings.estimator,
        rays.0,
        median(0),
        median(1),
        rays.1,
        median(2),
        median(3),
    );
}

fn main() {
    for (first, second) in [(256, 256), (256, 512), (512, 512)] {
        // A changed sigma or the same size alike: nothing is traced.
        measure(
            "ring",
            &BakeSettings {
                density_per_sr: 1e4,
                ..BakeSettings::default()
            },
            first,
            second,
        );
        measure(
            "pool",
            &BakeSettings {
                density_per_sr: 1e3,
                ..BakeSettings::default()
            },
            first,
            second,
        );
        measure(
            "ring",
            &BakeSettings {
                density_per_sr: 1e6,
                ..BakeSettings::splat()
            },
            first,
            second,
        );
    }
}
