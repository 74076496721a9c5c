//! References for maps: a file, the analytic maps of the built-in scenes, or a finer bake.

use super::agreement::{caustic_luminance, pair_maps};
use crate::error::{Error, Result};
use crate::export::pfm;
use crate::illumination::IlluminationMap;
use crate::illumination::compare::{Grid, TexelPair, at_common_size};
use crate::scene::Scene;
use crate::settings::LayerKind;

macro_rules! shipped {
    ($scene:literal, $name:literal) => {
        (
            concat!("builtin:", $scene),
            $name,
            include_bytes!(concat!("../../assets/reference/", $name, ".pfm")),
        )
    };
}

/// Built-in scenes with an analytic map of their floor, computed by an independent solver (`assets/SOURCES.md`).
const ANALYTIC: [(&str, &str, &[u8]); 7] = [
    shipped!("ring", "S1"),
    shipped!("ball", "S2"),
    shipped!("pool", "S3"),
    shipped!("mirror", "S5"),
    shipped!("slab", "S6"),
    shipped!("paraboloid", "S7"),
    shipped!("nephroid", "S8"),
];

/// Surface of the analytic maps, and the default for other references.
const DEFAULT_SURFACE: &str = "floor";

/// The maps that a bake should produce.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Description for users: `analytic S1`, `file a.pfm`, `a bake of …`.
    pub kind: String,
    /// Irradiance of one surface or of all.
    pub truth: Truth,
}

/// Irradiance that serves as ground truth.
#[derive(Clone, Debug)]
pub enum Truth {
    /// Irradiance of one object's surface [W/m²].
    Surface {
        /// Index in `Scene::objects`.
        object: usize,
        /// Luminance.
        grid: Grid,
    },
    /// All maps of another bake.
    Maps(Vec<IlluminationMap>),
}

impl Reference {
    /// The analytic map of a built-in scene; `None` if it has none.
    ///
    /// # Errors
    /// None for the maps as shipped.
    pub fn analytic(scene: &Scene) -> Result<Option<Self>> {
        let Some((_, name, bytes)) = ANALYTIC.iter().find(|(source, ..)| *source == scene.source) else {
            return Ok(None);
        };
        let grid = pfm::decode(bytes, name)?.luminance("");
        let object = object_named(scene, DEFAULT_SURFACE);
        Ok(grid.zip(object).map(|(grid, object)| Self {
            kind: format!("analytic {name}"),
            truth: Truth::Surface { object, grid },
        }))
    }

    /// A map of the surface of that name [W/m²]; without a name, of `floor` or else of the only receiver.
    ///
    /// # Errors
    /// No such surface; without a name, several receivers, none of which is called `floor`.
    pub fn of_surface(scene: &Scene, surface: Option<&str>, grid: Grid, kind: String) -> Result<Self> {
        let object = match surface {
            Some(name) => object_named(scene, name),
            None => object_named(scene, DEFAULT_SURFACE).or_else(|| only_receiver(scene)),
        };
        let object = object.ok_or_else(|| {
            Error::failure(
                &scene.source,
                match surface {
                    Some(name) => format!("it has no surface {name}"),
                    None => "several surfaces take light and none is called `floor`".into(),
                },
                "name the reference's surface with --surface",
            )
        })?;
        Ok(Self {
            kind,
            truth: Truth::Surface { object, grid },
        })
    }

    /// Pairs the texels of a bake's maps with those of the reference; `None` if their sizes do not match.
    pub fn pairs(&self, maps: &[IlluminationMap]) -> Option<Vec<TexelPair>> {
        match &self.truth {
            Truth::Maps(references) => pair_maps(maps, references),
            Truth::Surface { object, grid } => pair_with_grid(maps, *object, grid),
        }
    }
}

/// The map of the side of an object that receives most of the light: a floor may have either winding in a file.
pub fn lit_side(maps: &[IlluminationMap], object: usize) -> Option<&IlluminationMap> {
    let flux_w = |map: &IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
    let sides = maps.iter().filter(|map| map.chart.object() == object);
    sides.max_by(|a, b| flux_w(a).total_cmp(&flux_w(b)))
}

fn object_named(scene: &Scene, name: &str) -> Option<usize> {
    scene.objects.iter().position(|object| object.name == name)
}

fn only_receiver(scene: &Scene) -> Option<usize> {
    let mut receivers =
        (0..scene.objects.len()).filter(|&object| scene.material_of(object).surface.is_receiver());
    receivers.next().filter(|_| receivers.next().is_none())
}

/// A surface without a map is dark.
fn pair_with_grid(maps: &[IlluminationMap], object: usize, grid: &Grid) -> Option<Vec<TexelPair>> {
    let image = match lit_side(maps, object) {
        None => Grid {
            values: vec![0.0; grid.values.len()],
            ..*grid
        },
        Some(map) => Grid {
            width: map.width(),
            height: map.height(),
            values: caustic_luminance(map),
        },
    };
    let (image, reference) = at_common_size(&image, grid)?;
    let pair = |(&image, &reference)| TexelPair {
        image,
        reference,
        area_m2: 1.0,
    };
    Some(image.values.iter().zip(&reference.values).map(pair).collect())
}
