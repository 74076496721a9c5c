//! Built-in scenes with maps of an independent solver (`assets/reference`), and the required agreement of bakes.

use nephroid::illumination::compare::{average_relative_difference, relative_rmse};
use nephroid::scene::Scene;
use nephroid::bake::Bake;

use crate::tools::{caustic, energy_fault, map_of};
use crate::{assert_close, reference_map};

/// Ray density [rays/sr] and the largest relative RMSE at that density, for maps of 256×256.
pub type Agreement = (f64, f64);

pub struct Reference {
    pub builtin: &'static str,
    pub file: &'static str,
    pub by_wavefronts: Agreement,
    /// Limit of the mean relative difference of wavefronts.
    pub mean_difference: f64,
    pub by_splats: Option<Agreement>,
    /// Flux on the floor [W].
    pub floor_w: f64,
    /// Flux that leaves the scene [W], if the solver reports it.
    pub escaped_w: Option<f64>,
}

const fn reference(
    (builtin, file): (&'static str, &'static str),
    by_wavefronts: Agreement,
    by_splats: Option<Agreement>,
    (floor_w, escaped_w): (f64, Option<f64>),
) -> Reference {
    Reference {
        builtin,
        file,
        by_wavefronts,
        mean_difference: 0.01,
        by_splats,
        floor_w,
        escaped_w,
    }
}

pub fn references() -> [Reference; 7] {
    let ball = reference(
        ("ball", "S2"),
        (1.5e5, 0.02),
        Some((1e5, 0.10)),
        (1.090_823, Some(0.092_578 + 0.125_041)),
    );
    [
        reference(
            ("ring", "S1"),
            (1e4, 0.01),
            Some((1e5, 0.10)),
            (6.992_461, Some(0.0)),
        ),
        Reference {
            mean_difference: 0.05,
            ..ball
        },
        reference(("pool", "S3"), (1e4, 0.012), None, (3.770_999, None)),
        reference(
            ("mirror", "S5"),
            (1e5, 0.01),
            Some((1e6, 0.03)),
            (1.286_660, Some(0.016_970)),
        ),
        reference(
            ("slab", "S6"),
            (5e3, 0.01),
            Some((2e5, 0.03)),
            (6.490_964, None),
        ),
        reference(("paraboloid", "S7"), (3e4, 0.01), None, (0.502_656, None)),
        reference(
            ("nephroid", "S8"),
            (1.2e5, 0.01),
            Some((3e5, 0.06)),
            (0.966_650, Some(0.832_455)),
        ),
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

    /// Asserts that wavefronts agree with the solver, also on average over the texels, with few rays.
    pub fn check_wavefronts(&self, result: &Bake, scene: &Scene) {
        let name = self.builtin;
        self.check(result, scene, (self.by_wavefronts.1, 0.001));
        let image = caustic(map_of(result, scene, "floor"));
        let mean = average_relative_difference(&image, &reference_map(self.file));
        let mean = mean.expect("a reference with light");
        assert!(
            mean <= self.mean_difference,
            "{name}: mean relative difference {mean}"
        );
        assert!(
            result.counts.rays < 250_000,
            "{name}: {} rays",
            result.counts.rays
        );
        assert!(result.counts.receiver_queries > 0 && result.counts.cells > 0);
    }
}
