//! Studies that come as pages: what accuracy costs, and the paper's table and figures beside ours (Collins 1994,
//! *Adaptive Splatting for Specular to Diffuse Light Transport*).

mod accuracy;
mod complex;
mod connectivity;
mod item_buffer;
mod kernels;
mod pictures;
mod pool;
mod rays;
mod resolution;
mod scaling;
mod sigma;
mod table1;

use std::sync::Arc;

use super::agreement::{Agreement, caustic_luminance};
use super::page::{Cell, Page};
use super::references::{DEFAULT_SURFACE, Reference};
use super::repeats::{bake, light_pass_cpu_s};
use crate::error::{Error, Result};
use crate::illumination::IlluminationMap;
use crate::illumination::compare::Grid;
use crate::progress::{Control, Progress};
use crate::scene::{Scene, builtin};
use crate::session::BakeResult;
use crate::settings::{
    BakeSettings, Footprint, ItemBufferKind, KernelSampling, LayerKind, MapResolution, RayPlacement,
};

/// A study whose result is a page.
#[derive(Clone, Copy, Debug)]
pub struct PageStudy {
    /// On the command line.
    pub name: &'static str,
    /// What it finds out, in one line.
    pub what: &'static str,
    run: fn(&Bench) -> Result<Page>,
}

/// All of them, in the order of the paper, what it has not first.
pub const STUDIES: [PageStudy; 11] = [
    PageStudy {
        name: "accuracy",
        what: "error against CPU time and rays for every built-in scene, with what was predicted",
        run: accuracy::page,
    },
    PageStudy {
        name: "table1",
        what: "Table 1: error, rays and times at the paper's three densities, beside its own figures",
        run: table1::page,
    },
    PageStudy {
        name: "rays",
        what: "Figure 6a: error against the number of light rays",
        run: rays::page,
    },
    PageStudy {
        name: "sigma",
        what: "Figure 6b: error against sigma, and where it is least",
        run: sigma::page,
    },
    PageStudy {
        name: "resolution",
        what: "Plate 6: maps of 30, 100 and 300 texels across",
        run: resolution::page,
    },
    PageStudy {
        name: "kernels",
        what: "Figure 5, Plates 1 and 2: shapes and sizes of kernels",
        run: kernels::page,
    },
    PageStudy {
        name: "connectivity",
        what: "Figure 3: density of nearest hits against areas between neighbouring rays",
        run: connectivity::page,
    },
    PageStudy {
        name: "item-buffer",
        what: "section 3.1.2: the cube's bias against cells of equal solid angle",
        run: item_buffer::page,
    },
    PageStudy {
        name: "pool",
        what: "Plates 7 and 8: a pool from above and from below, its waves as a mesh and as bumps",
        run: pool::page,
    },
    PageStudy {
        name: "complex",
        what: "Plate 9: how a mesh of some 4,000 polygons shows in its caustic",
        run: complex::page,
    },
    PageStudy {
        name: "scaling",
        what: "how cost grows with rays, triangles, texels and threads",
        run: scaling::page,
    },
];

impl PageStudy {
    /// The study of that name.
    pub fn named(name: &str) -> Option<Self> {
        STUDIES.into_iter().find(|study| study.name == name)
    }

    /// Measures.
    ///
    /// # Errors
    /// A bake that failed; stopped before the end.
    pub fn page(&self, bench: &Bench) -> Result<Page> {
        (self.run)(bench)
    }
}

/// Where and how thoroughly a study is done.
#[derive(Clone, Copy)]
pub struct Bench<'a> {
    /// Small maps and few of everything: shows that it works, not what it says.
    pub quick: bool,
    /// Worker threads; 0 = one per core.
    pub threads: usize,
    /// Hears how far each bake is.
    pub progress: &'a dyn Progress,
    /// Asks it to stop.
    pub control: &'a Control,
}

/// A bake beside its reference.
struct Measured {
    result: BakeResult,
    agreement: Agreement,
}

impl Measured {
    fn rays(&self) -> Cell {
        self.result.counts.rays.into()
    }

    /// Of the light pass.
    fn cpu_s(&self) -> f64 {
        light_pass_cpu_s(&self.result)
    }

    fn rmse(&self) -> Cell {
        Cell::Share(self.agreement.relative_rmse)
    }

    fn ard(&self) -> Cell {
        Cell::Share(self.agreement.average_relative_difference)
    }
}

impl Bench<'_> {
    /// Texels across and down: those of the shipped references, or fewer.
    fn side(&self) -> usize {
        if self.quick { 64 } else { 256 }
    }

    /// Of a choice, the first few where there is no time.
    fn some<'v, T>(&self, values: &'v [T], few: usize) -> &'v [T] {
        &values[..if self.quick {
            few.min(values.len())
        } else {
            values.len()
        }]
    }

    /// Settings with maps of that side.
    fn at(&self, settings: BakeSettings, side: usize) -> BakeSettings {
        BakeSettings {
            map_resolution: MapResolution::Fixed {
                width: side,
                height: side,
            },
            threads: self.threads,
            ..settings
        }
    }

    fn bake(&self, scene: &Arc<Scene>, settings: &BakeSettings) -> Result<BakeResult> {
        bake(scene, settings, self.progress, self.control)
    }

    fn measure(
        &self,
        scene: &Arc<Scene>,
        settings: &BakeSettings,
        reference: &Reference,
    ) -> Result<Measured> {
        let result = self.bake(scene, settings)?;
        let agreement = reference.measure(&result.maps)?;
        Ok(Measured { result, agreement })
    }
}

/// A built-in scene with the name that it has on the command line.
fn scene(name: &str) -> Result<Arc<Scene>> {
    builtin::build(name)
        .map(Arc::new)
        .ok_or_else(|| Error::failure(name, "there is no built-in scene of that name", "report this"))
}

/// A built-in scene with its analytic map.
fn scene_and_truth(name: &str) -> Result<(Arc<Scene>, Reference)> {
    let scene = scene(name)?;
    match Reference::analytic(&scene)? {
        Some(reference) => Ok((scene, reference)),
        None => Err(Error::failure(name, "it has no analytic map", "report this")),
    }
}

/// The paper's own choices: jittered rays, a cube around the light, discs of the wavefront's area, point samples of a
/// gaussian with σ = 1.
fn paper(density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        footprint: Footprint::Disc,
        rays: RayPlacement::Jittered,
        item_buffer: ItemBufferKind::Cube,
        kernel_sampling: KernelSampling::Point,
        ..BakeSettings::splat()
    }
}

/// Exactly one lattice of the default estimator.
fn wavefront(density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        ..BakeSettings::default()
    }
}

/// The caustic on the floor, on the side that has most of it [W/m²].
fn floor(scene: &Scene, maps: &[IlluminationMap]) -> Option<Grid> {
    let flux_w = |map: &IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
    let of_floor = maps
        .iter()
        .filter(|map| scene.objects[map.chart.object()].name == DEFAULT_SURFACE);
    let map = of_floor.max_by(|a, b| flux_w(a).total_cmp(&flux_w(b)))?;
    Some(Grid {
        width: map.width(),
        height: map.height(),
        values: caustic_luminance(map),
    })
}

/// The ratio of neighbouring values, from the second on, as people read it: "×4.6, ×7.1".
fn growth(values: &[f64]) -> String {
    let ratios = values.windows(2).map(|pair| format!("×{:.2}", pair[1] / pair[0]));
    ratios.collect::<Vec<_>>().join(", ")
}

/// "agrees" or "disagrees".
fn verdict(agrees: bool) -> &'static str {
    if agrees { "agrees" } else { "disagrees" }
}

/// Per cent with three digits.
fn percent(share: f64) -> String {
    Cell::Share(share).told()
}
