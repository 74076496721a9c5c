//! What maps are measured against: a file, the analytic maps of the built-in scenes, or a finer bake.

use super::agreement::{Agreement, TexelPair, caustic_luminance, pair_maps};
use crate::error::{Error, Result};
use crate::export::pfm;
use crate::illumination::IlluminationMap;
use crate::illumination::compare::{Grid, at_common_size};
use crate::scene::Scene;
use crate::settings::LayerKind;

/// Built-in scenes with an analytic map of their floor, by an independent solver (`assets/SOURCES.md`).
const ANALYTIC: [(&str, &str, &[u8]); 7] = [
    (
        "builtin:ring",
        "S1",
        include_bytes!("../../assets/reference/S1.pfm"),
    ),
    (
        "builtin:ball",
        "S2",
        include_bytes!("../../assets/reference/S2.pfm"),
    ),
    (
        "builtin:pool",
        "S3",
        include_bytes!("../../assets/reference/S3.pfm"),
    ),
    (
        "builtin:mirror",
        "S5",
        include_bytes!("../../assets/reference/S5.pfm"),
    ),
    (
        "builtin:slab",
        "S6",
        include_bytes!("../../assets/reference/S6.pfm"),
    ),
    (
        "builtin:paraboloid",
        "S7",
        include_bytes!("../../assets/reference/S7.pfm"),
    ),
    (
        "builtin:nephroid",
        "S8",
        include_bytes!("../../assets/reference/S8.pfm"),
    ),
];

/// Surface of the analytic maps, and of others where none is named.
pub const DEFAULT_SURFACE: &str = "floor";

/// Maps that a bake should give.
#[derive(Clone, Debug)]
pub struct Reference {
    /// What it is, for people: `analytic S1`, `file a.pfm`, `self …`.
    pub kind: String,
    truth: Truth,
}

#[derive(Clone, Debug)]
enum Truth {
    /// Irradiance of one surface.
    Surface { object: usize, grid: Grid },
    /// All maps of another bake of the same scene at the same size.
    Maps(Vec<IlluminationMap>),
}

impl Reference {
    /// The analytic map of a built-in scene; `None` where there is none.
    ///
    /// # Errors
    /// Never for maps as they are shipped.
    pub fn analytic(scene: &Scene) -> Result<Option<Self>> {
        let Some((_, name, bytes)) = ANALYTIC.iter().find(|(source, ..)| *source == scene.source) else {
            return Ok(None);
        };
        let image = pfm::decode(bytes, name)?;
        let grid = image.luminance("");
        let object = object_named(scene, DEFAULT_SURFACE);
        Ok(grid.zip(object).map(|(grid, object)| Self {
            kind: format!("analytic {name}"),
            truth: Truth::Surface { object, grid },
        }))
    }

    /// A map of the surface of that name [W/m²]; without a name, of `floor` or of the only surface that takes light.
    ///
    /// # Errors
    /// No such surface; several, of which none is called `floor`.
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

    /// Irradiance of its surface [W/m²]; `None` where it is of several.
    pub fn grid(&self) -> Option<&Grid> {
        match &self.truth {
            Truth::Surface { grid, .. } => Some(grid),
            Truth::Maps(_) => None,
        }
    }

    /// The maps of a finer bake.
    pub fn of_bake(maps: Vec<IlluminationMap>, kind: String) -> Self {
        Self {
            kind,
            truth: Truth::Maps(maps),
        }
    }

    /// How far maps of the scene are from it.
    ///
    /// # Errors
    /// Sizes that are no whole multiples of one another; a reference without light.
    pub fn measure(&self, maps: &[IlluminationMap]) -> Result<Agreement> {
        Agreement::of(&self.pairs(maps)?).ok_or_else(|| {
            Error::failure(
                &self.kind,
                "the reference is dark, so that nothing can be measured against it",
                "name a reference with light in it",
            )
        })
    }

    /// Texels of maps of the scene, each beside its own.
    ///
    /// # Errors
    /// Sizes that are no whole multiples of one another.
    pub fn pairs(&self, maps: &[IlluminationMap]) -> Result<Vec<TexelPair>> {
        let pairs = match &self.truth {
            Truth::Maps(references) => pair_maps(maps, references),
            Truth::Surface { object, grid } => pair_with_grid(maps, *object, grid),
        };
        pairs.ok_or_else(|| {
            Error::failure(
                &self.kind,
                "its size and that of the maps are no whole multiples of one another",
                "choose another --map-resolution",
            )
        })
    }
}

fn object_named(scene: &Scene, name: &str) -> Option<usize> {
    scene.objects.iter().position(|object| object.name == name)
}

fn only_receiver(scene: &Scene) -> Option<usize> {
    let mut receivers =
        (0..scene.objects.len()).filter(|&object| scene.material_of(object).surface.is_receiver());
    receivers.next().filter(|_| receivers.next().is_none())
}

/// A surface that received nothing is dark.
fn pair_with_grid(maps: &[IlluminationMap], object: usize, grid: &Grid) -> Option<Vec<TexelPair>> {
    // Files may wind a floor either way: the reference is of the side that the light comes to.
    let sides = maps.iter().filter(|map| map.chart.object() == object);
    let flux_w = |map: &IlluminationMap| map.flux_w(LayerKind::Caustic).luminance();
    let lit = sides.max_by(|a, b| flux_w(a).total_cmp(&flux_w(b)));
    let image = lit.map_or_else(
        || Grid {
            values: vec![0.0; grid.values.len()],
            ..*grid
        },
        |map| Grid {
            width: map.width(),
            height: map.height(),
            values: caustic_luminance(map),
        },
    );
    let (image, reference) = at_common_size(&image, grid)?;
    let pair = |(&image, &reference)| TexelPair {
        image,
        reference,
        area_m2: 1.0,
    };
    Some(image.values.iter().zip(&reference.values).map(pair).collect())
}
