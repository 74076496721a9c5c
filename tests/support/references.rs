//! Built-in scenes with maps of an independent solver (`assets/reference`), and the required agreement of bakes.

use nephroid::illumination::compare::{average_relative_difference, relative_rmse};

use crate::prelude::*;
use crate::tools::{bake, builtin_scene, caustic, energy_fault, map_of, to};
use crate::reference_map;

/// Largest relative RMSE of a bake, over its target.
const MOST: f64 = 1.2;

/// Most rays of a bake to 1 %; it takes as many times more as its target is smaller.
const MOST_RAYS: f64 = 1.5e6;

pub struct Reference {
    pub builtin: &'static str,
    pub file: &'static str,
    /// Relative RMSE that bundles aim at, on maps of 256×256.
    pub target: f64,
    /// Limit of their mean relative difference.
    pub mean_difference: f64,
    /// Ray density of splats [rays/sr] and the largest relative RMSE at that density.
    pub by_splats: Option<(f64, f64)>,
    /// Flux on the floor [W].
    pub floor_w: f64,
    /// Flux that leaves the scene [W], if the solver reports it.
    pub escaped_w: Option<f64>,
}

const fn reference(
    (builtin, file): (&'static str, &'static str),
    by_splats: Option<(f64, f64)>,
    (floor_w, escaped_w): (f64, Option<f64>),
) -> Reference {
    Reference {
        builtin,
        file,
        target: 0.01,
        mean_difference: 0.01,
        by_splats,
        floor_w,
        escaped_w,
    }
}

pub fn references() -> [Reference; 7] {
    let ball = reference(
        ("ball", "S2"),
        Some((1e5, 0.10)),
        (1.090_823, Some(0.092_578 + 0.125_041)),
    );
    [
        reference(("ring", "S1"), Some((1e5, 0.10)), (6.992_461, Some(0.0))),
        // Few photons reach what is dim.
        Reference {
            target: 0.0025,
            mean_difference: 0.05,
            ..ball
        },
        reference(("pool", "S3"), None, (3.770_999, None)),
        reference(("mirror", "S5"), Some((1e6, 0.03)), (1.286_660, Some(0.016_970))),
        reference(("slab", "S6"), Some((2e5, 0.03)), (6.490_964, None)),
        reference(("paraboloid", "S7"), None, (0.502_656, None)),
        reference(("nephroid", "S8"), Some((3e5, 0.06)), (0.966_650, Some(0.832_455))),
    ]
}

impl Reference {
    /// Asserts that a bake agrees with the solver: the map to a relative RMSE, the flux to a relative error.
    pub fn check(&self, result: &Bake, scene: &Scene, (most, share): (f64, f64)) {
        let name = self.builtin;
        let image = caustic(map_of(result, scene, "floor"));
        let off = relative_rmse(&image, &reference_map(self.file)).expect("a reference with light");
        assert!(off <= most, "{name}: relative RMSE {off}");
        assert_eq!(energy_fault(result), None, "{name}");
        let energy = &result.ledgers[0].energy_w;
        let what = format!("{name}: watts on the floor");
        assert_close(energy.deposited, self.floor_w, share, &what);
        if let Some(escaped_w) = self.escaped_w {
            let off_w = (energy.escaped - escaped_w).abs();
            assert!(off_w <= 0.005 * energy.emitted, "{name}: escaped {} W", energy.escaped);
        }
    }

    /// Asserts that bundles agree with the solver, also on average over the texels, with few rays. Returns scene and
    /// bake.
    pub fn check_bundles(&self) -> (Scene, Bake) {
        let (name, scene) = (self.builtin, builtin_scene(self.builtin));
        let result = bake(scene.clone(), &to(self.target, 256));
        self.check(&result, &scene, (MOST * self.target, 0.001));
        let image = caustic(map_of(&result, &scene, "floor"));
        let mean = average_relative_difference(&image, &reference_map(self.file));
        let mean = mean.expect("a reference with light");
        assert!(
            mean <= self.mean_difference,
            "{name}: mean relative difference {mean}"
        );
        assert!(
            (result.counts.rays as f64) < MOST_RAYS * 0.01 / self.target && result.counts.cells > 0,
            "{name}: {:?}",
            result.counts
        );
        (scene, result)
    }
}
