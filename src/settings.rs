//! The settings of a bake.

pub mod options;

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::effect::EffectSwitches;
use crate::error::{Error, Result};

/// Enumerations whose variants name their values in files and on the command line. Users read the documentation of the
/// variants.
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
    /// Kind of light in a layer. The order is that of the channels in files.
    #[derive(PartialOrd, Ord, Hash)]
    pub enum LayerKind {
        /// LS+D: light that met at least one specular surface.
        Caustic,
        /// LD: light straight from the lamps; every surface casts a shadow.
        Direct,
        /// LD+D: light reflected by other diffuse surfaces.
        Indirect,
    }
}

impl LayerKind {
    /// All kinds, in order.
    pub const ALL: [Self; 3] = [Self::Caustic, Self::Direct, Self::Indirect];

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

choices! {
    /// How the light pass turns rays into irradiance.
    pub enum Estimator {
        /// Bundles, with photons for what these cannot carry. Photons alone without a target, on rough surfaces, and
        /// for lamps that shine in all directions from a sphere or an environment.
        Auto,
        /// Photons: random paths that follow one branch at every surface; each is counted in the texel it hits.
        Photon,
        /// A kernel of flux per ray, scaled to the wavefront (Collins 1994).
        Splat,
    }

    /// How the error is measured.
    #[derive(Default)]
    pub enum ErrorMetric {
        /// Relative to the local brightness as the eye sees it; in the dark, relative to what the exposure reveals.
        #[default]
        Visible,
        /// Root mean square over all maps, relative to their mean; the brightest light dominates it.
        Rmse,
    }

    /// Shape of a splat. All shapes have the same area for the same footprint: disc r = 1, box side √π, cone base √3
    /// (footprint radii), Gaussian exp(−r²/2σ).
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

    /// How texels sample a kernel.
    pub enum KernelSampling {
        /// The kernel's integral over each texel.
        Integrated,
        /// The kernel's value at each texel's centre, as in the paper; for studies.
        Point,
    }

    /// What determines the size and shape of a splat.
    pub enum Footprint {
        /// The ellipse spanned by the neighbouring rays.
        Ellipse,
        /// A disc with the area spanned by the neighbouring rays (section 3.2.1 of the paper).
        Disc,
        /// A disc that grows with the path length.
        Distance,
        /// The same disc for every ray of a light.
        Fixed,
    }

    /// Where in its lattice cell a light ray starts.
    pub enum RayPlacement {
        /// At the centre of the cell.
        Lattice,
        /// At a random place in the cell (section 3.1.2 of the paper).
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

/// Width σ of the Gaussian exp(−r²/2σ), in squared footprint radii (eq. 4.4). The other estimators smooth finished
/// maps, by the footprint of a ray at the density of the settings; 0 disables this.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sigma {
    /// The same for every splat, > 0.
    Constant(f64),
    /// Scaled by the size of the footprint relative to the map's mean footprint.
    Adaptive,
}

/// Size of the maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MapResolution {
    /// Starts coarse and doubles while footprints are finer than texels.
    Auto,
    /// The same for every map.
    Fixed {
        /// Texels across, 1 to 16384.
        width: usize,
        /// Texels down, 1 to 16384.
        height: usize,
    },
}

/// Wavelengths that are traced when light meets dispersive glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wavelengths {
    /// The whole spectrum without bands. Bundles interpolate between three wavelengths; splats use
    /// [`CONTINUOUS_BANDS`] bands.
    #[default]
    Continuous,
    /// Seven, one for each colour of the rainbow (section 4.1 of the paper).
    Rainbow,
    /// This many, 1 to [`MAX_WAVELENGTHS`], each for a band of equal importance to the eye.
    Fixed(u32),
}

choices! {
    /// How rays and wavelengths combine (section 4.1 of the paper).
    pub enum SpectralSampling {
        /// Every ray is traced at every wavelength.
        Split,
        /// Every ray has one wavelength; the wavelengths share the rays evenly.
        Stochastic,
    }

    /// Named targets for the error.
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
    /// All presets, from the coarsest on.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Preview, Self::Final];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Target error [1].
    pub fn max_error(self) -> f64 {
        match self {
            Self::Draft => 0.10,
            Self::Preview => 0.03,
            Self::Final => 0.01,
        }
    }

    /// Equivalent density of splats [rays/sr].
    pub fn splat_density_per_sr(self) -> f64 {
        let times = match self {
            Self::Draft => 0.125,
            Self::Preview => 1.0,
            Self::Final => 8.0,
        };
        Estimator::Splat.preview_density_per_sr() * times
    }
}

/// All bake options. [`validate`](Self::validate) checks their ranges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakeSettings {
    /// How rays become irradiance.
    pub estimator: Estimator,
    /// Light rays per steradian [1/sr]; for suns density/D² rays per m², with D the distance from the casters' centre
    /// to their farthest receiver. The footprint radius that sigma refers to is that of this density, refined or not.
    pub density_per_sr: f64,
    /// Target for the estimated error of maps, [`MIN_MAX_ERROR`] to 1: the bake refines until it is met (not splat).
    /// `None`: exactly `density_per_sr`.
    pub max_error: Option<f64>,
    /// How that error is measured.
    #[serde(default)]
    pub error_metric: ErrorMetric,
    /// Time limit [s of wall-clock time], > 0. The bake then ends with the finest maps that are complete.
    pub max_time_s: Option<f64>,
    /// Placement of light rays in their lattice cells.
    pub rays: RayPlacement,
    /// Width of the Gaussian.
    pub sigma: Sigma,
    /// Shape of a splat.
    pub kernel: Kernel,
    /// How texels sample a kernel.
    pub kernel_sampling: KernelSampling,
    /// What determines a splat's size and shape.
    pub footprint: Footprint,
    /// Whether photon noise is filtered where that lowers the error (auto and photon). `None`: if there is a target,
    /// since a fixed density is chosen to see its noise.
    #[serde(default)]
    pub filter: Option<bool>,
    /// How the item buffer divides directions.
    pub item_buffer: ItemBufferKind,
    /// Size of the maps.
    pub map_resolution: MapResolution,
    /// Maximum number of specular surfaces on a path, ≥ 1. `None`: depends on what carries the light, see
    /// [`Self::depth`] and [`Self::photon_depth`].
    pub max_depth: Option<u32>,
    /// Branches that carry less than this share of their light ray's flux are not followed, but booked as truncated.
    /// `None`: depends on the target, see [`Self::path_threshold`].
    pub branch_threshold: Option<f64>,
    /// Layers to bake.
    pub layers: Vec<LayerKind>,
    /// Whether files also hold each light's share of each layer.
    pub per_light: bool,
    /// Wavelengths that are traced at dispersive glass.
    pub wavelengths: Wavelengths,
    /// How rays and wavelengths combine. `None`: every ray is split, except by splats over the whole spectrum.
    pub spectral_sampling: Option<SpectralSampling>,
    /// Whether files also hold the light of each wavelength; needs a number of wavelengths.
    pub keep_spectrum: bool,
    /// Effects that are forced on or off.
    pub effects: EffectSwitches,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Worker threads; 0 = one per core.
    pub threads: usize,
    /// Memory limit for maps [bytes].
    pub memory_bytes: u64,
}

/// Minimum density that goes with a target error [rays/sr].
const COARSEST_START_PER_SR: f64 = 1_600.0;

/// Branch threshold without a target: share of a light ray's flux [1].
const USUAL_THRESHOLD: f64 = 1e-4;

/// Default limits of the specular surfaces on a path: if every branch is followed, and if only one is.
const USUAL_DEPTH: u32 = 16;
const USUAL_PHOTON_DEPTH: u32 = 256;

/// Branch threshold relative to the target error. A larger one would save segments, but cost more rays than that: where
/// branches end only because they are weak, borders appear that squares are divided at.
const THRESHOLD_PER_ERROR: f64 = 0.003;

/// Minimum target for the error [1].
pub const MIN_MAX_ERROR: f64 = 1e-4;

/// Maximum number of wavelengths of a bake.
pub const MAX_WAVELENGTHS: u32 = 1000;

/// Bands that splats divide the whole spectrum into.
pub const CONTINUOUS_BANDS: u32 = 64;

/// Maximum map side [texels].
pub const MAX_MAP_SIDE: usize = 16384;

impl Default for BakeSettings {
    /// Preview density, without a target and without smoothing.
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
    /// Light rays per steradian of a preview [1/sr].
    pub fn preview_density_per_sr(self) -> f64 {
        match self {
            Self::Auto => 25_000.0,
            Self::Photon => 1e6,
            Self::Splat => 100_000.0,
        }
    }

    /// Whether it refines until a target is reached.
    pub fn refines(self) -> bool {
        self != Self::Splat
    }

    /// Splats are one footprint wide; the others are sharp without smoothing.
    pub fn default_sigma(self) -> Sigma {
        match self {
            Self::Auto | Self::Photon => Sigma::Constant(0.0),
            Self::Splat => Sigma::Constant(1.0),
        }
    }
}

impl ErrorMetric {
    /// Selects the error that is meant from the two.
    pub fn of<T>(self, visible: T, rmse: T) -> T {
        match self {
            Self::Visible => visible,
            Self::Rmse => rmse,
        }
    }
}

impl BakeSettings {
    /// Defaults of an estimator.
    pub fn of(estimator: Estimator) -> Self {
        Self {
            estimator,
            density_per_sr: estimator.preview_density_per_sr(),
            sigma: estimator.default_sigma(),
            ..Self::default()
        }
    }

    /// Defaults of the paper's estimator.
    pub fn splat() -> Self {
        Self::of(Estimator::Splat)
    }

    /// Density that goes with a target error [rays/sr]. Refinement does not start from it: the footprint of sigma and
    /// bounds on the number of rays refer to it.
    pub fn starting_density_per_sr(target: f64) -> f64 {
        if target <= MIN_MAX_ERROR {
            // This target stands for as much as time allows.
            return COARSEST_START_PER_SR;
        }
        (40.0 / target).clamp(COARSEST_START_PER_SR, 40_000.0)
    }

    /// Minimum share of a light ray's flux (luminance) that a branch must carry to be followed: as set, or so small
    /// that the loss is far below the target.
    pub fn path_threshold(&self) -> f64 {
        self.branch_threshold.unwrap_or_else(|| match self.max_error {
            Some(target) if target > MIN_MAX_ERROR => (target * THRESHOLD_PER_ERROR).clamp(1e-6, 1e-3),
            // No target, or as much as time allows.
            _ => USUAL_THRESHOLD,
        })
    }

    /// Maximum number of specular surfaces on a path if every branch is followed.
    pub fn depth(&self) -> u32 {
        self.max_depth.unwrap_or(USUAL_DEPTH)
    }

    /// The same if only one branch is followed: light trapped in a body is then followed until it leaves.
    pub fn photon_depth(&self) -> u32 {
        self.max_depth.unwrap_or(USUAL_PHOTON_DEPTH)
    }

    /// Whether photon noise is filtered.
    pub fn filters(&self) -> bool {
        self.filter.unwrap_or(self.max_error.is_some())
    }

    /// How rays and wavelengths combine: as set, or as suits the estimator.
    pub fn ray_sampling(&self) -> SpectralSampling {
        self.spectral_sampling
            .unwrap_or(match (self.estimator, self.wavelengths) {
                (Estimator::Splat, Wavelengths::Continuous) => SpectralSampling::Stochastic,
                _ => SpectralSampling::Split,
            })
    }

    /// Memory limit for maps, without those of bands [bytes].
    pub fn map_memory_bytes(&self) -> u64 {
        if !self.keep_spectrum {
            return self.memory_bytes;
        }
        let bands = match self.wavelengths {
            Wavelengths::Continuous => 0,
            Wavelengths::Rainbow => 7,
            Wavelengths::Fixed(count) => u64::from(count),
        };
        // A band takes 24 bytes per texel, a map 56 (`BYTES_PER_TEXEL`).
        self.memory_bytes / (1 + bands.div_ceil(2))
    }

    /// Level of detail of what no error estimate controls: 0 for the target of a draft, 2 for that of a final bake, 1
    /// between them and without a target.
    pub fn detail(&self) -> u32 {
        match self.max_error {
            Some(target) if target >= 0.1 => 0,
            Some(target) if target <= 0.01 => 2,
            _ => 1,
        }
    }

    /// Memory limit for direct light that is kept light by light [bytes]: an eighth of the total.
    pub fn direct_bytes(&self) -> u64 {
        self.memory_bytes / 8
    }

    /// Memory limit for the squares of all lights that are refined [bytes]: an eighth of the total.
    pub fn squares_bytes(&self) -> u64 {
        self.memory_bytes / 8
    }

    /// Memory limit for traced light that is kept for the next bake [bytes]: a quarter of the total.
    pub fn kept_light_bytes(&self) -> u64 {
        self.memory_bytes / 4
    }

    /// Checks that all settings are within their ranges.
    ///
    /// # Errors
    /// A usage error that names the option, its value and its range.
    pub fn validate(&self) -> Result<()> {
        // Each option has its own range; what follows relates options to each other.
        for option in options::OPTIONS {
            option.check_limits(self)?;
        }

        // A splat of no width has no area for its flux. Other estimators are sharp without smoothing.
        let is_continuous = self.wavelengths == Wavelengths::Continuous;
        let least_sigma = if self.estimator.refines() { 0.0 } else { 1e-6 };

        // Refused are options beyond their range, and options that the others leave without effect.
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
