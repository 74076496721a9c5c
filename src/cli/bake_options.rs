//! Bake options: from flags to validated settings.

use clap::Args;
use nephroid::effect::{Effect, EffectSwitch, EffectSwitches};
use nephroid::error::{Error, Result};
use nephroid::settings::{
    BakeSettings, ErrorMetric, Estimator, Footprint, ItemBufferKind, Kernel, KernelSampling, LEAST_MAX_ERROR,
    LayerKind, MapResolution, Preset, RayPlacement, Sigma, SpectralSampling, Wavelengths,
};

use super::values;

/// Flags of a bake; those not given keep the defaults of [`BakeSettings`].
#[derive(Clone, Debug, Default, PartialEq, Args)]
#[command(next_help_heading = "Bake options")]
pub struct BakeOptions {
    /// Target error by name [default: preview, unless density, error or time is given]
    #[arg(long, value_parser = values::one_of::<Preset>())]
    preset: Option<Preset>,
    /// How light rays become irradiance [default: auto]
    #[arg(long, value_parser = values::one_of::<Estimator>())]
    estimator: Option<Estimator>,
    /// Light rays per steradian, and no refinement; with --max-error, to begin with. For suns density/D² rays per m², D
    /// from the casters' centre to their farthest receiver
    #[arg(long, value_name = "RAYS_PER_SR", allow_negative_numbers = true)]
    density: Option<f64>,
    /// Goes on until the estimated error of the maps is below this, such as 2% (not splat)
    #[arg(long, value_name = "SHARE", value_parser = values::share, allow_hyphen_values = true)]
    max_error: Option<f64>,
    /// What that error is: as an eye sees it, or the relative RMSE over all maps (not splat) [default: visible]
    #[arg(long, value_parser = values::one_of::<ErrorMetric>(), value_name = "METRIC")]
    error_metric: Option<ErrorMetric>,
    /// Ends the bake after so long, such as 10s, with the finest maps that are complete by then; without
    /// --max-error, refines as far as that goes (not splat)
    #[arg(long, value_name = "TIME", value_parser = values::seconds, allow_hyphen_values = true)]
    max_time: Option<f64>,
    /// Where in its lattice cell a light ray starts (splat) [default: lattice]
    #[arg(long, value_parser = values::one_of::<RayPlacement>(), value_name = "PLACEMENT")]
    rays: Option<RayPlacement>,
    /// Spread of the gaussian kernel in squared footprint radii, or `adaptive` (splat) [default: 1]; for the others,
    /// smoothing of the map in squared radii of a ray's footprint at the density [default: 0, none]
    #[arg(long, value_name = "S|adaptive", value_parser = values::sigma, allow_negative_numbers = true)]
    sigma: Option<Sigma>,
    /// Shape of a splat (splat) [default: gaussian]
    #[arg(long, value_parser = values::one_of::<Kernel>())]
    kernel: Option<Kernel>,
    /// How a kernel is taken into texels (splat) [default: integrated]
    #[arg(long, value_parser = values::one_of::<KernelSampling>(), value_name = "SAMPLING")]
    kernel_sampling: Option<KernelSampling>,
    /// What sets the size and shape of a splat (splat) [default: ellipse]
    #[arg(long, value_parser = values::one_of::<Footprint>())]
    footprint: Option<Footprint>,
    /// Whether the noise of photons is filtered where that lowers the error (auto, photon) [default: on
    /// with a target, off at a density]
    #[arg(long, value_parser = values::on_off, value_name = "on|off")]
    filter: Option<bool>,
    /// How the sphere of directions around a light is divided [default: equal]
    #[arg(long, value_parser = values::one_of::<ItemBufferKind>(), value_name = "DIVISION")]
    item_buffer: Option<ItemBufferKind>,
    /// Texels of every map: as needed, N by N, or W by H [default: auto]
    #[arg(long, value_name = "auto|N|WxH", value_parser = values::map_resolution, allow_hyphen_values = true)]
    map_resolution: Option<MapResolution>,
    /// Largest number of specular surfaces on a light path [default: 16, by photons 256]
    #[arg(long, value_name = "N")]
    max_depth: Option<u32>,
    /// Branches that carry less than this share of their light ray's flux are not followed, and booked as truncated
    /// [default: 0.003 of the target error, 0.0001 without a target]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    branch_threshold: Option<f64>,
    /// Layers to bake [default: caustic for bake, caustic,direct for pictures]
    #[arg(long, value_parser = values::one_of::<LayerKind>(), value_delimiter = ',', value_name = "LAYER,...")]
    layers: Option<Vec<LayerKind>>,
    /// Adds each light's part of each layer to the files, so that lamps can be dimmed afterwards
    #[arg(long)]
    per_light: bool,
    /// Wavelengths of light that meets dispersive glass: the whole spectrum, one for each colour of the rainbow, or so
    /// many [default: continuous]
    #[arg(long, value_name = "continuous|rainbow|N", value_parser = values::wavelengths, allow_negative_numbers = true)]
    wavelengths: Option<Wavelengths>,
    /// Every ray at every wavelength, or each ray at one of them [default: split; stochastic for splats over the whole
    /// spectrum]
    #[arg(long, value_parser = values::one_of::<SpectralSampling>(), value_name = "SAMPLING")]
    spectral_sampling: Option<SpectralSampling>,
    /// Adds the light of each wavelength to the files [W/(m² nm)], with --wavelengths N
    #[arg(long)]
    keep_spectrum: bool,
    /// Forces effects on or off, such as refraction=off [default: auto, on where the scene calls for it]
    #[arg(long, value_delimiter = ',', value_name = "NAME=auto|on|off", value_parser = values::effect_switch)]
    effects: Option<Vec<(Effect, EffectSwitch)>>,
    /// Seed of everything random [default: 0]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Largest memory for maps, such as 512M or 2G; where it is short, maps are made coarser, with a warning
    /// [default: 4G]
    #[arg(long, value_name = "SIZE", value_parser = values::memory, allow_hyphen_values = true)]
    memory: Option<u64>,
}

impl BakeOptions {
    /// Validated settings; `default_layers` where no layer is named, `threads` 0 = one per core.
    ///
    /// # Errors
    /// A value outside its range; an option that does not apply to the others given.
    pub fn settings(&self, default_layers: &[LayerKind], threads: usize) -> Result<BakeSettings> {
        let estimator = self.estimator.unwrap_or(BakeSettings::default().estimator);
        self.refuse_what_does_not_apply(estimator)?;
        let defaults = BakeSettings::of(estimator);
        let mut layers = self.layers.clone().unwrap_or_else(|| default_layers.to_vec());
        layers.sort_unstable();
        layers.dedup();
        let preset = self.preset.unwrap_or_default();
        let max_error = self.target(estimator, preset);
        let settings = BakeSettings {
            estimator,
            max_error,
            error_metric: self.error_metric.unwrap_or(defaults.error_metric),
            max_time_s: self.max_time,
            density_per_sr: self.density.unwrap_or_else(|| match (estimator, max_error) {
                (Estimator::Splat, _) => preset.splat_density_per_sr(),
                (_, Some(target)) => BakeSettings::starting_density_per_sr(target),
                (_, None) => estimator.preview_density_per_sr(),
            }),
            rays: self.rays.unwrap_or(defaults.rays),
            sigma: self.sigma.unwrap_or(defaults.sigma),
            kernel: self.kernel.unwrap_or(defaults.kernel),
            kernel_sampling: self.kernel_sampling.unwrap_or(defaults.kernel_sampling),
            footprint: self.footprint.unwrap_or(defaults.footprint),
            filter: self.filter,
            item_buffer: self.item_buffer.unwrap_or(defaults.item_buffer),
            map_resolution: self.map_resolution.unwrap_or(defaults.map_resolution),
            max_depth: self.max_depth,
            branch_threshold: self.branch_threshold,
            layers,
            per_light: self.per_light,
            wavelengths: self.wavelengths.unwrap_or(defaults.wavelengths),
            spectral_sampling: self.spectral_sampling,
            keep_spectrum: self.keep_spectrum,
            effects: self.switches(),
            seed: self.seed.unwrap_or(defaults.seed),
            threads,
            memory_bytes: self.memory.unwrap_or(defaults.memory_bytes),
        };
        settings.validate()?;
        Ok(settings)
    }

    /// The last one counts where an effect is named twice.
    fn switches(&self) -> EffectSwitches {
        let named = self.effects.iter().flatten();
        named.fold(EffectSwitches::default(), |switches, &(effect, switch)| {
            switches.with(effect, switch)
        })
    }

    /// Of the scene that nobody asked for: all its light, as a draft, where nothing else is asked.
    pub fn for_a_first_look(mut self) -> Self {
        if !self.names_quality() && self.estimator != Some(Estimator::Splat) {
            self.preset = Some(Preset::Draft);
        }
        let all = vec![LayerKind::Caustic, LayerKind::Direct, LayerKind::Indirect];
        self.layers.get_or_insert(all);
        self
    }

    /// Whether any of them is given.
    #[cfg(feature = "viewer")]
    pub fn names_any(&self) -> bool {
        *self != Self::default()
    }

    /// Whether an option says how good maps are to be, or how long they may take.
    pub fn names_quality(&self) -> bool {
        self.preset.is_some() || self.density.is_some() || self.max_error.is_some() || self.max_time.is_some()
    }

    /// The error to refine towards.
    fn target(&self, estimator: Estimator, preset: Preset) -> Option<f64> {
        let is_exact = self.density.is_some() || estimator == Estimator::Splat;
        self.max_error.or(match (is_exact, self.preset, self.max_time) {
            (true, ..) => None,
            // As far as the time goes.
            (false, None, Some(_)) => Some(LEAST_MAX_ERROR),
            (false, ..) => Some(preset.max_error()),
        })
    }

    fn refuse_what_does_not_apply(&self, estimator: Estimator) -> Result<()> {
        let of_splats = [
            ("--rays", self.rays.is_some()),
            ("--kernel", self.kernel.is_some()),
            ("--kernel-sampling", self.kernel_sampling.is_some()),
            ("--footprint", self.footprint.is_some()),
        ];
        let given = of_splats.iter().find(|(_, is_given)| *is_given);
        if let (true, Some((option, _))) = (estimator.refines(), given) {
            return Err(Error::usage(
                *option,
                "only the splat estimator has it",
                format!("leave {option} out or add --estimator splat"),
            ));
        }
        let of_targets = [
            ("--max-error", self.max_error.is_some()),
            ("--error-metric", self.error_metric.is_some()),
        ];
        let given = of_targets.iter().find(|(_, is_given)| *is_given);
        if let (Estimator::Splat, Some((option, _))) = (estimator, given) {
            return Err(Error::usage(
                *option,
                "the splat estimator does not refine towards a target",
                format!("leave {option} out or use --estimator auto"),
            ));
        }
        let kernel = self.kernel.unwrap_or(BakeSettings::default().kernel);
        if self.sigma.is_some() && kernel != Kernel::Gaussian {
            return Err(Error::usage(
                "--sigma",
                "only the gaussian kernel has a sigma",
                "leave --sigma out or use --kernel gaussian",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_overrides_the_preset() {
        let options = BakeOptions {
            preset: Some(Preset::Draft),
            ..Default::default()
        };
        let settings = options.settings(&[LayerKind::Caustic], 0).expect("valid");
        assert_eq!(settings.max_error, Some(0.1));
        let options = BakeOptions {
            density: Some(123.0),
            ..options
        };
        let settings = options.settings(&[LayerKind::Caustic], 0).expect("valid");
        assert!((settings.density_per_sr - 123.0).abs() < 1e-9);
        assert_eq!(settings.max_error, None);
    }

    #[test]
    fn layers_are_named_once_and_in_order() {
        let options = BakeOptions {
            layers: Some(vec![LayerKind::Direct, LayerKind::Caustic, LayerKind::Direct]),
            ..Default::default()
        };
        let settings = options.settings(&[LayerKind::Caustic], 0).expect("valid");
        assert_eq!(settings.layers, [LayerKind::Caustic, LayerKind::Direct]);
    }
}
