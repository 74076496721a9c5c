//! The settings of a bake.

pub mod options;

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::effect::EffectSwitches;
use crate::error::{Error, Result};

/// Enumerations whose values have the names of its variants in files and on the command line, and their documentation
/// as texts.
macro_rules! choices {
    ($($(#[$meta:meta])* pub enum $name:ident { $($variants:tt)* })*) => {
        $(
            $(#[$meta])*
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
            #[derive(EnumMessage, IntoStaticStr, VariantArray)]
            #[serde(rename_all = "lowercase")]
            #[strum(serialize_all = "lowercase")]
            pub enum $name { $($variants)* }
        )*
    };
}

choices! {
    /// Which light a layer holds. The order is that of the files' channels.
    #[derive(PartialOrd, Ord, Hash)]
    pub enum LayerKind {
        /// LS+D: light that met at least one specular surface.
        Caustic,
        /// LD: straight from the lights, stopped by every surface.
        Direct,
        /// LD+D: light that other diffuse surfaces send.
        Indirect,
    }
}

impl LayerKind {
    /// All of them, in their order.
    pub const ALL: [Self; 3] = [Self::Caustic, Self::Direct, Self::Indirect];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

choices! {
    /// How the light pass turns rays into irradiance.
    pub enum Estimator {
        /// Photons for lights with a size, for light on rough surfaces, and without a target; else patches or, of a single
        /// light, whichever a pilot of both measures to be cheaper for the target.
        Auto,
        /// Patches of the wavefront between neighbouring rays, spread exactly over the texels they cover.
        Wavefront,
        /// Photons: paths that go one way at every surface, each counted into the texel it hits.
        Photon,
        /// A kernel of flux per ray, scaled to the wavefront (Collins 1994).
        Splat,
    }

    /// What a target for the error means.
    #[derive(Default)]
    pub enum ErrorMetric {
        /// As an eye sees it: relative to how bright a place is, with what exposure makes of the dark.
        #[default]
        Visible,
        /// Root mean square over all maps, over their mean: ruled by the brightest light.
        Rmse,
    }

    /// Shape of a splat. All have the same area at the same footprint: disc r = 1, box side √π, cone base √3 (footprint
    /// radii), gaussian exp(−r²/2σ).
    pub enum Kernel {
        /// exp(−r²/2σ), cut at 4√σ (eq. 4.4).
        Gaussian,
        /// 1 − r/√3 up to r = √3.
        Cone,
        /// Constant up to r = 1.
        Disc,
        /// Constant over the square of the disc's area.
        Box,
    }

    /// How a kernel is taken into texels.
    pub enum KernelSampling {
        /// Its integral over each texel.
        Integrated,
        /// Its value at each texel's centre, as the paper does; for studies.
        Point,
    }

    /// What sets the size and shape of a splat.
    pub enum Footprint {
        /// The ellipse that the neighbouring rays span.
        Ellipse,
        /// The disc of the area that the neighbouring rays span (section 3.2.1 of the paper).
        Disc,
        /// A disc that grows with the length of the path.
        Distance,
        /// The same disc for every ray of a light.
        Fixed,
    }

    /// Where in its lattice cell a light ray starts.
    pub enum RayPlacement {
        /// At the centre.
        Lattice,
        /// Anywhere, by the seed (section 3.1.2 of the paper).
        Jittered,
    }

    /// How the sphere of directions around a light is divided.
    pub enum ItemBufferKind {
        /// Cells of equal solid angle.
        Equal,
        /// The paper's cube: cells of equal area on the cube's faces.
        Cube,
    }
}

/// Spread of the gaussian in squared footprint radii (eq. 4.4). The wavefront estimator deposits exactly and smooths
/// afterwards, each texel as a footprint of its own area; 0 leaves that out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sigma {
    /// The same for every splat, > 0.
    Constant(f64),
    /// Scaled by how the footprint compares with the map's mean footprint.
    Adaptive,
}

/// Size of the maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MapResolution {
    /// Starts coarse and doubles while footprints are finer than texels.
    Auto,
    /// Texels across and down, of every map.
    Fixed {
        /// Texels across, 1 to 16384.
        width: usize,
        /// Texels down, 1 to 16384.
        height: usize,
    },
}

/// Which wavelengths are traced of light that meets dispersive glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wavelengths {
    /// The whole spectrum without bands: the wavefront is interpolated between wavelengths; splats have
    /// [`CONTINUOUS_BANDS`] of them.
    #[default]
    Continuous,
    /// Seven, one for each colour of the rainbow (section 4.1 of the paper).
    Rainbow,
    /// So many, 1 to [`MAX_WAVELENGTHS`], each for a band of equal importance to the eye.
    Fixed(u32),
}

choices! {
    /// How rays and wavelengths go together (section 4.1 of the paper).
    pub enum SpectralSampling {
        /// Every ray is traced at every wavelength.
        Split,
        /// Every ray has one wavelength: rays are dealt out among the wavelengths evenly.
        Stochastic,
    }

    /// How carefully to bake, by name.
    #[derive(Default)]
    pub enum Preset {
        /// An error of 10 % (splat: 12,500 rays per steradian).
        Draft,
        /// 3 % (splat: 100,000 rays per steradian).
        #[default]
        Preview,
        /// 1 % (splat: 800,000 rays per steradian).
        Final,
    }
}

impl Preset {
    /// From the coarsest on.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Preview, Self::Final];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Error that it aims at [1].
    pub fn max_error(self) -> f64 {
        match self {
            Self::Draft => 0.10,
            Self::Preview => 0.03,
            Self::Final => 0.01,
        }
    }

    /// Density of splats that stands for it [rays/sr].
    pub fn splat_density_per_sr(self) -> f64 {
        let times = match self {
            Self::Draft => 0.125,
            Self::Preview => 1.0,
            Self::Final => 8.0,
        };
        Estimator::Splat.preview_density_per_sr() * times
    }
}

/// All bake options. [`validate`](Self::validate) states the ranges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// How rays become irradiance.
    pub estimator: Estimator,
    /// Light rays per steradian [1/sr]; for suns density/D² rays per m². Sigma's radius follows it, refined or not.
    pub density_per_sr: f64,
    /// Target for the estimated error of maps, [`MIN_MAX_ERROR`] to 1: light goes on from `density_per_sr` until it is
    /// met (not splat). `None`: exactly that density.
    pub max_error: Option<f64>,
    /// What that error is.
    #[serde(default)]
    pub error_metric: ErrorMetric,
    /// Ends the bake after so many seconds of wall-clock time, > 0, with the finest maps that were complete.
    pub max_time_s: Option<f64>,
    /// Lattice or jittered.
    pub rays: RayPlacement,
    /// Spread of the gaussian.
    pub sigma: Sigma,
    /// Shape of a splat.
    pub kernel: Kernel,
    /// Integrated over texels, or the paper's point samples.
    pub kernel_sampling: KernelSampling,
    /// What sets a splat's size.
    pub footprint: Footprint,
    /// Whether the noise of photons is filtered where that lowers the error (auto and photon). `None`: with a target; who
    /// asks for a density wants to see its grain.
    #[serde(default)]
    pub filter: Option<bool>,
    /// How the item buffer divides directions.
    pub item_buffer: ItemBufferKind,
    /// Size of the maps.
    pub map_resolution: MapResolution,
    /// Largest number of specular surfaces on a path, ≥ 1. `None`: as suits what carries the light, see [`Self::depth`] and
    /// [`Self::photon_depth`].
    pub max_depth: Option<u32>,
    /// Branches that carry less than this share of their light ray's flux are not followed; booked as truncated. `None`:
    /// as the target allows, see [`Self::path_threshold`].
    pub branch_threshold: Option<f64>,
    /// Layers to bake.
    pub layers: Vec<LayerKind>,
    /// Whether files hold each light's part of each layer beside their sum.
    pub per_light: bool,
    /// Which wavelengths are traced where glass is dispersive.
    pub wavelengths: Wavelengths,
    /// How rays and wavelengths go together; `None`: each ray is split, but by splats over the whole spectrum.
    pub spectral_sampling: Option<SpectralSampling>,
    /// Whether files hold the light of each wavelength beside the colour it makes; for a number of wavelengths.
    pub keep_spectrum: bool,
    /// Effects that are forced on or off.
    pub effects: EffectSwitches,
    /// Of everything random.
    pub seed: u64,
    /// Worker threads; 0 = one per core.
    pub threads: usize,
    /// Largest memory for maps [bytes].
    pub memory_bytes: u64,
}

/// Least density that refinement begins from [rays/sr].
const COARSEST_START_PER_SR: f64 = 1_600.0;

/// Least share of a light ray's flux that is followed without a target [1].
const USUAL_THRESHOLD: f64 = 1e-4;

/// Surfaces on a path without a limit of its own: of all branches, and of one.
const USUAL_DEPTH: u32 = 16;
const USUAL_PHOTON_DEPTH: u32 = 256;

/// Least share that is followed, over the error that is aimed at. More would save segments and cost more rays
/// than that: where branches end for their weakness alone, borders appear that the wavefront looks for.
const THRESHOLD_PER_ERROR: f64 = 0.003;

/// Least target for the error [1].
pub const MIN_MAX_ERROR: f64 = 1e-4;

/// Most wavelengths of a bake.
pub const MAX_WAVELENGTHS: u32 = 1000;

/// Wavelengths that splats take for the whole spectrum.
pub const CONTINUOUS_BANDS: u32 = 64;

/// Largest map side [texels].
pub const MAX_MAP_SIDE: usize = 16384;

impl Default for BakeSettings {
    /// Both carriers at their preview density, without smoothing.
    fn default() -> Self {
        Self {
            estimator: Estimator::Auto,
            density_per_sr: Estimator::Auto.preview_density_per_sr(),
            max_error: None,
            error_metric: ErrorMetric::Visible,
            max_time_s: None,
            rays: RayPlacement::Lattice,
            sigma: Estimator::Auto.default_sigma(),
            kernel: Kernel::Gaussian,
            kernel_sampling: KernelSampling::Integrated,
            footprint: Footprint::Ellipse,
            filter: None,
            item_buffer: ItemBufferKind::Equal,
            map_resolution: MapResolution::Auto,
            max_depth: None,
            branch_threshold: None,
            layers: vec![LayerKind::Caustic],
            per_light: false,
            wavelengths: Wavelengths::Continuous,
            spectral_sampling: None,
            keep_spectrum: false,
            effects: EffectSwitches::default(),
            seed: 0,
            threads: 0,
            memory_bytes: 4 << 30,
        }
    }
}

impl Estimator {
    /// Light rays per steradian of a preview [1/sr]: patches need fewer than splats.
    pub fn preview_density_per_sr(self) -> f64 {
        match self {
            Self::Auto | Self::Wavefront => 25_000.0,
            Self::Photon => 1e6,
            Self::Splat => 100_000.0,
        }
    }

    /// Whether it goes on until a target is reached.
    pub fn refines(self) -> bool {
        self != Self::Splat
    }

    /// Patches are exact without smoothing; splats are one footprint wide.
    pub fn default_sigma(self) -> Sigma {
        match self {
            Self::Auto | Self::Wavefront | Self::Photon => Sigma::Constant(0.0),
            Self::Splat => Sigma::Constant(1.0),
        }
    }
}

impl ErrorMetric {
    /// The one of two errors that is meant.
    pub fn of<T>(self, visible: T, rmse: T) -> T {
        match self {
            Self::Visible => visible,
            Self::Rmse => rmse,
        }
    }
}

impl BakeSettings {
    /// An estimator with its defaults.
    pub fn of(estimator: Estimator) -> Self {
        Self {
            estimator,
            density_per_sr: estimator.preview_density_per_sr(),
            sigma: estimator.default_sigma(),
            ..Self::default()
        }
    }

    /// The paper's estimator with its defaults.
    pub fn splat() -> Self {
        Self::of(Estimator::Splat)
    }

    /// Density that refinement towards an error begins from [rays/sr]: coarse enough that refinement decides, fine
    /// enough that no caster falls through.
    pub fn starting_density_per_sr(target: f64) -> f64 {
        if target <= MIN_MAX_ERROR {
            // Not a target but as much as time allows.
            return COARSEST_START_PER_SR;
        }
        (40.0 / target).clamp(COARSEST_START_PER_SR, 40_000.0)
    }

    /// Least share of a light ray's flux (luminance) that a branch must carry to be followed: as it is set, else so small
    /// that what is left out is far below the target.
    pub fn path_threshold(&self) -> f64 {
        self.branch_threshold.unwrap_or_else(|| match self.max_error {
            Some(target) if target > MIN_MAX_ERROR => (target * THRESHOLD_PER_ERROR).clamp(1e-6, 1e-3),
            // No target, or as much as time allows.
            _ => USUAL_THRESHOLD,
        })
    }

    /// Largest number of specular surfaces on a path, where every branch is followed.
    pub fn depth(&self) -> u32 {
        self.max_depth.unwrap_or(USUAL_DEPTH)
    }

    /// The same where one branch is: light that is caught in a body for long is followed until it comes out.
    pub fn photon_depth(&self) -> u32 {
        self.max_depth.unwrap_or(USUAL_PHOTON_DEPTH)
    }

    /// Whether photons are filtered.
    pub fn filters(&self) -> bool {
        self.filter.unwrap_or(self.max_error.is_some())
    }

    /// How rays and wavelengths go together: as it is set, or as suits the estimator.
    pub fn ray_sampling(&self) -> SpectralSampling {
        self.spectral_sampling
            .unwrap_or(match (self.estimator, self.wavelengths) {
                (Estimator::Splat, Wavelengths::Continuous) => SpectralSampling::Stochastic,
                _ => SpectralSampling::Split,
            })
    }

    /// Memory that maps may take but for those of bands [bytes].
    pub fn map_memory_bytes(&self) -> u64 {
        if !self.keep_spectrum {
            return self.memory_bytes;
        }
        let bands = match self.wavelengths {
            Wavelengths::Continuous => 0,
            Wavelengths::Rainbow => 7,
            Wavelengths::Fixed(count) => u64::from(count),
        };
        // A texel takes 24 of 56 bytes while it is summed.
        self.memory_bytes / (1 + bands.div_ceil(2))
    }

    /// How fine what no estimate rules is to be: 0 for the target of a draft, 1 beyond it and without a target, 2 for that of
    /// a final bake.
    pub fn detail(&self) -> u32 {
        match self.max_error {
            Some(target) if target >= 0.1 => 0,
            Some(target) if target <= 0.01 => 2,
            _ => 1,
        }
    }

    /// Memory that traced light may take until the next bake [bytes]: a quarter of all.
    pub fn kept_light_bytes(&self) -> u64 {
        self.memory_bytes / 4
    }

    /// Refuses settings outside their ranges.
    ///
    /// # Errors
    /// A usage error that names the option, its value and its range.
    pub fn validate(&self) -> Result<()> {
        for option in options::OPTIONS {
            option.check_limits(self)?;
        }
        let is_continuous = self.wavelengths == Wavelengths::Continuous;
        let least_sigma = if self.estimator.refines() { 0.0 } else { 1e-6 };
        let (option, what, remedy) = match self.sigma {
            Sigma::Constant(sigma) if !(least_sigma..=1e4).contains(&sigma) => (
                "--sigma",
                &*format!("{sigma} is outside {least_sigma} to 1e4"),
                "give a number in that range",
            ),
            Sigma::Adaptive if self.estimator.refines() => (
                "--sigma",
                "only splats have footprints to adapt a sigma to",
                "give a number from 0, or use --estimator splat",
            ),
            _ if self.spectral_sampling.is_some() && is_continuous && self.estimator.refines() => (
                "--spectral-sampling",
                "only splats divide their rays between wavelengths of the whole spectrum",
                "add --wavelengths N, or --estimator splat",
            ),
            _ if self.keep_spectrum && is_continuous => (
                "--keep-spectrum",
                "the whole spectrum has no bands to keep",
                "add --wavelengths N, such as 7, or --wavelengths rainbow",
            ),
            _ if self.threads > 1024 => (
                "--threads",
                &*format!("{} is outside 0 to 1024", self.threads),
                "give a number in that range",
            ),
            _ if self.layers.is_empty() => (
                "--layers",
                "no layer is named",
                "name at least one of caustic, direct, indirect",
            ),
            _ => return Ok(()),
        };
        Err(Error::usage(option, what, remedy))
    }
}
