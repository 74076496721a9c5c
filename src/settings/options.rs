//! The table of bake options, one row each: name, unit, limits, description and formatting, for the command line and
//! the panel.

use std::str::FromStr;

use strum::{EnumMessage, VariantArray};

use super::{
    BakeSettings, ErrorMetric, Estimator, Footprint, ItemBufferKind, Kernel, KernelSampling, LayerKind,
    MAX_MAP_SIDE, MAX_WAVELENGTHS, MapResolution, Preset, RayPlacement, Sigma, SpectralSampling, Wavelengths,
};
use crate::effect::{Effect, EffectSwitch};
use crate::error::{Error, Result};

/// An option of a bake.
#[derive(Debug)]
pub struct OptionInfo {
    /// Name on the command line, without dashes.
    pub name: &'static str,
    /// Label in the panel, with its unit; empty if it has no control there.
    pub label: &'static str,
    /// Placeholder of the value, with its unit; empty for flags.
    pub value: &'static str,
    /// Whether it takes several values, separated by commas.
    pub is_list: bool,
    /// Purpose, in one line of help.
    pub brief: &'static str,
    /// Purpose.
    pub what: &'static str,
    /// Range of the values; empty if their names are enough.
    range: &'static str,
    /// What applies if it is not given.
    pub default: &'static str,
    /// Effect on accuracy.
    pub accuracy: &'static str,
    /// Effect on time and memory.
    pub cost: &'static str,
    /// Names and meanings of the values; `None` for numbers and the like.
    pub values: Option<Names>,
    /// Minimum and maximum of numbers, and how to get the present ones.
    limits: Option<Limits>,
    /// Whether it is compatible with the other settings; if not, the reason and a remedy.
    applies: fn(&BakeSettings) -> Applies,
    /// Parses a value and sets it.
    set: fn(&mut BakeSettings, &str) -> Read<()>,
}

/// Result of parsing; the error says what to write instead.
type Read<T> = std::result::Result<T, String>;

/// Names and their meanings.
type Names = fn() -> Vec<(&'static str, &'static str)>;

type Limits = (f64, f64, fn(&BakeSettings) -> Vec<f64>);

type Applies = std::result::Result<(), (&'static str, &'static str)>;

/// Defaults that most rows share: compatible with everything, without limits.
const fn row(name: &'static str, label: &'static str, value: &'static str) -> OptionInfo {
    OptionInfo {
        name,
        label,
        value,
        is_list: false,
        brief: "",
        what: "",
        range: "",
        default: "",
        accuracy: "none",
        cost: "none",
        values: None,
        limits: None,
        applies: |_| Ok(()),
        set: |_, _| Ok(()),
    }
}

/// A row whose values are those of an enumeration.
const fn choice<T>(name: &'static str, label: &'static str, value: &'static str) -> OptionInfo
where
    T: VariantArray + EnumMessage + Into<&'static str> + Copy,
{
    OptionInfo {
        values: Some(names::<T>),
        ..row(name, label, value)
    }
}

/// A row that is on if it is given.
const fn flag(name: &'static str) -> OptionInfo {
    row(name, "", "")
}

/// All options, in the order of the command line's help.
pub const OPTIONS: &[OptionInfo] = &[
    OptionInfo {
        brief: "Target error by name: draft 10 %, preview 3 %, final 1 %",
        what: "Target error by name; for splats their density",
        range: "draft 10 %, preview 3 %, final 1 % of the error; splats 12,500, 100,000 and 800,000 rays/sr",
        default: "preview, unless density, error or time is given",
        accuracy: "as named, by the estimate",
        cost: "preview takes about ten times as long as draft, final ten times as long as preview",
        ..choice::<Preset>("preset", "Preset", "PRESET")
    },
    OptionInfo {
        brief: "auto, photon or splat [default: auto]",
        what: "How light rays become irradiance",
        default: "auto",
        accuracy: "auto needs some hundred times fewer rays than photons or splats for the same error",
        cost: "grows with the number of rays; a ray of auto costs a few times more than a splat",
        set: |s, text| estimator(text).map(|estimator| s.estimator = estimator),
        ..choice::<Estimator>("estimator", "Estimator", "ESTIMATOR")
    },
    OptionInfo {
        brief: "Trace exactly this many rays per steradian, unrefined",
        what: "Light rays per steradian around each light: exactly that many, without refinement; with a target error, the \
                density to start with. Suns: density/D² rays per m², with D from the casters' centre to their \
                farthest receiver",
        range: "1 to 1e12",
        default: "25,000 (photon: 1,000,000, splat: 100,000); with a target error 40 divided by it, from 1,600 to 40,000",
        accuracy: "more rays give finer caustics and less noise; sigma's radius shrinks with their root",
        cost: "time grows in proportion; four times as many rays reuse those of the step before",
        limits: Some((1.0, 1e12, |s| vec![s.density_per_sr])),
        set: |s, text| number(text).map(|density| s.density_per_sr = density),
        ..row("density", "Ray density [rays/sr]", "RAYS_PER_SR")
    },
    OptionInfo {
        brief: "Refine until the estimated error is below this, e.g. 2%",
        what: "Refines until the estimated error of the maps is below this, such as 2% (not splat)",
        range: "0.01% to 100%",
        default: "that of the preset",
        accuracy: "the estimate meets it; no reference is needed",
        cost: "halving it takes about four times the rays",
        limits: Some((super::MIN_MAX_ERROR, 1.0, |s| s.max_error.into_iter().collect())),
        applies: refining,
        set: |s, text| share(text).map(|error| s.max_error = Some(error)),
        ..row("max-error", "Max error [%]", "SHARE")
    },
    OptionInfo {
        brief: "visible or rmse [default: visible]",
        what: "What the error means: relative to the brightness of each place as the eye sees it, or the relative RMSE over \
                all maps (not splat)",
        default: "visible",
        accuracy: "with rmse a bright focus outweighs a room; with visible each place counts as exposure shows it",
        cost: "rmse takes long on a small bright focus, visible on dim light",
        applies: refining,
        set: |s, text| named(text).map(|metric| s.error_metric = metric),
        ..choice::<ErrorMetric>("error-metric", "Error is", "METRIC")
    },
    OptionInfo {
        brief: "Stop after this long, e.g. 10s, with the best so far",
        what: "Ends the bake after this long, such as 10s, with the finest complete maps; without a target error, refines \
                as far as the time allows (not splat)",
        range: "1ms to 1e7s",
        default: "as long as it takes",
        accuracy: "the finest complete maps are kept, with their estimated error; shadows of large lamps may stay \
                    grainy",
        cost: "that time, unless the maps cannot improve",
        limits: Some((1e-3, 1e7, |s| s.max_time_s.into_iter().collect())),
        set: |s, text| seconds(text).map(|time_s| s.max_time_s = Some(time_s)),
        ..row("max-time", "Max time [s]", "TIME")
    },
    OptionInfo {
        brief: "lattice or jittered [default: lattice]",
        what: "Where in its lattice cell a ray starts (splat)",
        default: "lattice",
        accuracy: "a lattice converges faster; jittered rays turn regular patterns into noise",
        cost: "the same",
        applies: splats,
        set: |s, text| named(text).map(|rays| s.rays = rays),
        ..choice::<RayPlacement>("rays", "Rays", "PLACEMENT")
    },
    OptionInfo {
        brief: "Smooth by a Gaussian of this variance [default: 0]",
        what: "Variance σ of a Gaussian, weight exp(−r²/2σ), in squared radii of a ray's footprint: the kernel of each \
                splat, or a blur of the finished map; adaptive (splat) scales it by each footprint's size relative \
                to the mean",
        range: "0 to 1e4, splat above 0",
        default: "0, none; splat 1",
        accuracy: "small values show single rays (photon, splat) or change nothing (auto), large ones blur the caustic",
        cost: "splat: time per ray grows in proportion; others: no ray is traced",
        applies: |s| match s.kernel {
            Kernel::Gaussian => Ok(()),
            _ => Err(("only the gaussian kernel has a sigma", "--kernel gaussian")),
        },
        set: |s, text| text.parse().map(|sigma| s.sigma = sigma),
        ..row("sigma", "Sigma [radii²]", "S|adaptive")
    },
    OptionInfo {
        brief: "gaussian, cone, disc or box [default: gaussian]",
        what: "Shape of a splat (splat)",
        default: "gaussian",
        accuracy: "gaussian is smoothest; disc and box show their edges",
        cost: "gaussian touches the most texels",
        applies: splats,
        set: |s, text| named(text).map(|kernel| s.kernel = kernel),
        ..choice::<Kernel>("kernel", "Kernel", "KERNEL")
    },
    OptionInfo {
        brief: "integrated or point [default: integrated]",
        what: "How a kernel is sampled on texels (splat)",
        default: "integrated",
        accuracy: "points miss kernels smaller than a texel",
        cost: "nearly the same",
        applies: splats,
        set: |s, text| named(text).map(|sampling| s.kernel_sampling = sampling),
        ..choice::<KernelSampling>("kernel-sampling", "", "SAMPLING")
    },
    OptionInfo {
        brief: "ellipse, disc, distance or fixed [default: ellipse]",
        what: "What sets the size and shape of a splat (splat)",
        default: "ellipse",
        accuracy: "ellipse follows the wavefront best, fixed least",
        cost: "nearly the same for all",
        applies: splats,
        set: |s, text| named(text).map(|footprint| s.footprint = footprint),
        ..choice::<Footprint>("footprint", "Footprint", "FOOTPRINT")
    },
    OptionInfo {
        brief: "Denoise photons [default: on with a target error]",
        what: "Filters the noise of photons where that lowers the error (auto, photon)",
        range: "on, off",
        default: "on with a target, off at a density",
        accuracy: "less noise and no grain",
        cost: "little: no ray is traced",
        set: |s, text| on_off(text).map(|filter| s.filter = Some(filter)),
        ..row("filter", "", "on|off")
    },
    OptionInfo {
        brief: "equal or cube [default: equal]",
        what: "How directions around a light are divided to find glass and mirrors",
        default: "equal",
        accuracy: "equal cells give each ray the same flux; the cube's differ by a factor of up to 5.2",
        cost: "nearly the same",
        set: |s, text| named(text).map(|division| s.item_buffer = division),
        ..choice::<ItemBufferKind>("item-buffer", "Item buffer", "DIVISION")
    },
    OptionInfo {
        brief: "Texels of each map, up to 16384 a side [default: auto]",
        what: "Texels of every map: N by N, W by H, or as fine as the light on each surface",
        range: "auto, 1 to 16384 a side",
        default: "auto",
        accuracy: "details finer than a texel are averaged",
        cost: "memory and the direct layer's time grow with its square",
        limits: Some((1.0, MAX_MAP_SIDE as f64, |s| match s.map_resolution {
            MapResolution::Auto => Vec::new(),
            MapResolution::Fixed { width, height } => vec![width as f64, height as f64],
        })),
        set: |s, text| text.parse().map(|size| s.map_resolution = size),
        ..row("map-resolution", "Map size [texels]", "auto|N|WxH")
    },
    OptionInfo {
        brief: "Specular surfaces on a path [default: 16; photons 256]",
        what: "Largest number of glass, mirror and water surfaces on a light path",
        range: "1 to 100,000",
        default: "16 where all branches are followed, 256 for photons",
        accuracy: "light beyond it is missing from the maps and booked as truncated",
        cost: "little where light soon leaves the glass; light trapped between mirrors takes time in proportion",
        limits: Some((1.0, 100_000.0, |s| {
            s.max_depth.map(f64::from).into_iter().collect()
        })),
        set: |s, text| number(text).map(|depth| s.max_depth = Some(depth)),
        ..row("max-depth", "Max depth", "N")
    },
    OptionInfo {
        brief: "Drop branches below this share of their ray's flux",
        what: "Drops branches that carry less than this share of their ray's flux where glass splits light",
        range: "0 to 0.5",
        default: "0.003 of the target error; 0.0001 without one",
        accuracy: "what is dropped is missing from the maps and booked as truncated",
        cost: "a tenth of it follows about one more internal reflection",
        limits: Some((0.0, 0.5, |s| s.branch_threshold.into_iter().collect())),
        set: |s, text| number(text).map(|share| s.branch_threshold = Some(share)),
        ..row("branch-threshold", "Weakest branch", "SHARE")
    },
    OptionInfo {
        brief: "caustic, direct, indirect; commas between several",
        what: "Which light is baked. Caustic: light that met glass, mirrors or water. Direct: straight from the lights. \
                Indirect: light that diffuse surfaces send each other, any number of bounces",
        range: "at least one",
        default: "caustic for bake, all three for pictures and the window",
        accuracy: "a layer that is not baked is missing from the picture; indirect stops at the max error, 3 % without \
                one",
        cost: "direct: a shadow ray per texel and light; indirect: 64 to 4,096 rays per texel of a coarser grid, and the \
                other two layers, shown or not; kept while only powers of lights change",
        set: |s, text| {
            s.layers = text.split(',').map(named).collect::<Read<_>>()?;
            s.layers.sort_unstable();
            s.layers.dedup();
            Ok(())
        },
        is_list: true,
        values: Some(names::<LayerKind>),
        ..row("layers", "Layers", "LAYER,...")
    },
    OptionInfo {
        brief: "Also write the contribution of each light",
        what: "Also writes each light's share of each layer, so that lights can be dimmed afterwards",
        cost: "files and memory grow with the number of lights",
        set: |s, _| {
            s.per_light = true;
            Ok(())
        },
        ..flag("per-light")
    },
    OptionInfo {
        brief: "Where glass disperses light [default: continuous]",
        what: "Wavelengths of light that meets dispersive glass: the whole spectrum, seven for the colours of the rainbow, \
                or N",
        range: "1 to 1000, rainbow or continuous",
        default: "continuous",
        accuracy: "few show as separate images of the light",
        cost: "each is traced",
        limits: Some((1.0, MAX_WAVELENGTHS as f64, |s| match s.wavelengths {
            Wavelengths::Fixed(count) => vec![f64::from(count)],
            _ => Vec::new(),
        })),
        set: |s, text| text.parse().map(|wavelengths| s.wavelengths = wavelengths),
        ..row("wavelengths", "", "continuous|rainbow|N")
    },
    OptionInfo {
        brief: "split (a ray at every wavelength) or stochastic (at one)",
        what: "Traces every ray at every wavelength, or at one",
        default: "split; stochastic for splats over the whole spectrum",
        accuracy: "stochastic rays are noisier",
        cost: "split rays are traced once for each wavelength",
        set: |s, text| named(text).map(|sampling| s.spectral_sampling = Some(sampling)),
        ..choice::<SpectralSampling>("spectral-sampling", "", "SAMPLING")
    },
    OptionInfo {
        brief: "Also write each wavelength (with --wavelengths N)",
        what: "Also writes the light of each wavelength [W/(m² nm)]; needs --wavelengths N",
        cost: "files and memory grow with the number of wavelengths",
        set: |s, _| {
            s.keep_spectrum = true;
            Ok(())
        },
        ..flag("keep-spectrum")
    },
    OptionInfo {
        brief: "Force effects, e.g. dispersion=off [default: auto]",
        what: "Forces effects on or off, such as refraction=off",
        default: "auto: on where the scene needs it",
        accuracy: "light of an effect that is off is missing",
        cost: "see `study effects`",
        set: |s, text| {
            // The last one counts if an effect is named twice.
            for one in text.split(',') {
                let (effect, switch) = effect_switch(one)?;
                s.effects.set(effect, switch);
            }
            Ok(())
        },
        is_list: true,
        ..row("effects", "", "NAME=auto|on|off")
    },
    OptionInfo {
        brief: "Seed of the random numbers [default: 0]",
        what: "Seed of the random numbers",
        default: "0",
        set: |s, text| number(text).map(|seed| s.seed = seed),
        ..row("seed", "", "N")
    },
    OptionInfo {
        brief: "Memory for maps, e.g. 512M or 2G [default: 4G]",
        what: "Memory limit for maps, such as 512M or 2G; if it is short, maps get coarser, with a warning",
        range: "1M up",
        default: "4G",
        accuracy: "coarser maps average more",
        cost: "a quarter of it keeps traced light for the next bake",
        set: |s, text| memory(text).map(|bytes| s.memory_bytes = bytes),
        ..row("memory", "", "SIZE")
    },
];

fn splats(settings: &BakeSettings) -> Applies {
    match settings.estimator.refines() {
        false => Ok(()),
        true => Err(("only the splat estimator has it", "add --estimator splat")),
    }
}

fn refining(settings: &BakeSettings) -> Applies {
    match settings.estimator.refines() {
        true => Ok(()),
        false => Err((
            "the splat estimator does not refine towards a target",
            "use --estimator auto",
        )),
    }
}

impl OptionInfo {
    /// Range of the values, or else their names.
    pub fn range(&self) -> String {
        match self.values {
            Some(values) if self.range.is_empty() => {
                let names: Vec<&str> = values().into_iter().map(|(name, _)| name).collect();
                names.join(", ")
            }
            _ => self.range.into(),
        }
    }

    /// Parses a value and sets it.
    ///
    /// # Errors
    /// What to write instead.
    pub fn set(&self, settings: &mut BakeSettings, text: &str) -> Read<()> {
        (self.set)(settings, text)
    }

    /// Checks that an option that was given is compatible with the other settings.
    ///
    /// # Errors
    /// A usage error that gives the reason.
    pub fn check_applies(&self, settings: &BakeSettings) -> Result<()> {
        (self.applies)(settings).map_err(|(what, remedy)| {
            let option = format!("--{}", self.name);
            let remedy = format!("leave {option} out or {remedy}");
            Error::usage(option, what, remedy)
        })
    }

    /// Checks that numbers are within their limits.
    ///
    /// # Errors
    /// A usage error that names the option, its value and its range.
    pub(super) fn check_limits(&self, settings: &BakeSettings) -> Result<()> {
        let Some((least, most, of)) = self.limits else {
            return Ok(());
        };
        let outside = of(settings)
            .into_iter()
            .find(|value| !(least..=most).contains(value));
        match outside {
            None => Ok(()),
            Some(value) => Err(Error::usage(
                format!("--{}", self.name),
                format!("{value} is outside {}", self.range),
                "give a number in that range",
            )),
        }
    }
}

/// Names of an enumeration's values with their documentation.
fn names<T: VariantArray + EnumMessage + Into<&'static str> + Copy>() -> Vec<(&'static str, &'static str)> {
    let named = |value: &T| ((*value).into(), value.get_documentation().unwrap_or_default());
    T::VARIANTS.iter().map(named).collect()
}

/// The variant of this name.
///
/// # Errors
/// Lists all names.
pub fn named<T: VariantArray + Copy + Into<&'static str>>(name: &str) -> Read<T> {
    let variants = T::VARIANTS.iter().copied();
    let found = variants.clone().find(|variant| (*variant).into() == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = variants.map(Into::into).collect();
        format!("there is no {name}; there are {}", names.join(", "))
    })
}

/// An estimator by its name. Patches of the wavefront were one of them.
fn estimator(name: &str) -> Read<Estimator> {
    match name {
        "wavefront" => Err("the bundles of auto took the place of wavefront: give auto".into()),
        _ => named(name),
    }
}

fn number<T: FromStr>(text: &str) -> Read<T> {
    text.parse().map_err(|_| "give a number".into())
}

fn on_off(text: &str) -> Read<bool> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("give on or off".into()),
    }
}

/// Parses a number with one of several units and converts it to the last of them.
fn with_unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    units.iter().find_map(|(unit, factor)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * factor)
    })
}

/// `2%` or `0.02`.
///
/// # Errors
/// Any other text.
pub fn share(text: &str) -> Read<f64> {
    let number = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|percent| percent / 100.0),
        None => text.parse(),
    };
    number.map_err(|_| "give a share such as 2% or 0.02".into())
}

/// `10s`, `500ms`, `2min`, `1h`, or seconds without a unit.
fn seconds(text: &str) -> Read<f64> {
    let units = [
        ("ms", 1e-3),
        ("min", 60.0),
        ("m", 60.0),
        ("h", 3600.0),
        ("s", 1.0),
        ("", 1.0),
    ];
    with_unit(text, &units).ok_or_else(|| "give a time such as 10s, 500ms or 2min".into())
}

/// Bytes with a binary suffix: `512M`, `2G`, `1.5G`.
fn memory(text: &str) -> Read<u64> {
    let power = |exponent| 1024_f64.powi(exponent);
    let units = [
        ("K", power(1)),
        ("M", power(2)),
        ("G", power(3)),
        ("T", power(4)),
        ("", 1.0),
    ];
    with_unit(&text.to_ascii_uppercase(), &units)
        .filter(|bytes| (power(2)..1e18).contains(bytes))
        .map(|bytes| bytes as u64)
        .ok_or_else(|| "give at least 1M, as bytes or with K, M, G or T, such as 512M or 2G".into())
}

/// `refraction=off`.
fn effect_switch(text: &str) -> Read<(Effect, EffectSwitch)> {
    let names = || Effect::ALL.map(Effect::name).join(", ");
    let (name, switch) = text.split_once('=').ok_or_else(|| {
        let names = names();
        format!("{text} is not of the form NAME=auto|on|off; NAME is one of {names}")
    })?;
    let effect = named(name).map_err(|_| format!("there is no effect {name}; there are {}", names()))?;
    let switch = named(switch).map_err(|_| format!("{switch} is not a switch; use auto, on or off"))?;
    Ok((effect, switch))
}

impl FromStr for Sigma {
    type Err = String;

    /// `1.5` or `adaptive`.
    fn from_str(text: &str) -> Read<Self> {
        match text {
            "adaptive" => Ok(Self::Adaptive),
            number => number
                .parse()
                .map(Self::Constant)
                .map_err(|_| "give a number or `adaptive`".into()),
        }
    }
}

impl FromStr for Wavelengths {
    type Err = String;

    /// `continuous`, `rainbow` or a number.
    fn from_str(text: &str) -> Read<Self> {
        match text {
            "continuous" => Ok(Self::Continuous),
            "rainbow" => Ok(Self::Rainbow),
            number => number
                .parse()
                .map(Self::Fixed)
                .map_err(|_| "give a number, `rainbow` or `continuous`".into()),
        }
    }
}

impl FromStr for MapResolution {
    type Err = String;

    /// `auto`, `N` (square) or `WxH` [texels].
    fn from_str(text: &str) -> Read<Self> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let (width, height) = text.split_once('x').unwrap_or((text, text));
        let sides = width.parse().ok().zip(height.parse().ok());
        sides
            .map(|(width, height)| Self::Fixed { width, height })
            .ok_or_else(|| "give `auto`, N or WxH in texels, such as 512 or 512x256".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_they_are_written() {
        let fixed = |width, height| Ok(MapResolution::Fixed { width, height });
        assert_eq!("auto".parse(), Ok(MapResolution::Auto));
        assert_eq!("64".parse(), fixed(64, 64));
        assert_eq!("64x32".parse(), fixed(64, 32));
        for text in ["", "x", "64x", "-3", "1.5", "64x32x1", "big"] {
            assert!(text.parse::<MapResolution>().is_err(), "{text}");
        }
        assert_eq!(memory("2G"), Ok(2 << 30));
        assert_eq!(memory("1.5g"), Ok(3 << 29));
        assert_eq!(memory("1048576"), Ok(1 << 20));
        for text in ["", "G", "0", "-2G", "1K", "nan", "infG", "1e300"] {
            assert!(memory(text).is_err(), "{text}");
        }
        assert_eq!("adaptive".parse(), Ok(Sigma::Adaptive));
        assert_eq!("0.5".parse(), Ok(Sigma::Constant(0.5)));
        assert!("wide".parse::<Sigma>().is_err());
        for (text, time_s) in [
            ("90", 90.0),
            ("500ms", 0.5),
            ("2min", 120.0),
            ("5m", 300.0),
            ("1h", 3600.0),
        ] {
            assert_eq!(seconds(text), Ok(time_s), "{text}");
        }
        assert!(seconds("soon").is_err());
    }

    #[test]
    fn layers_are_named_once_and_in_order() {
        let mut settings = BakeSettings::default();
        let layers = OPTIONS
            .iter()
            .find(|option| option.name == "layers")
            .expect("a row");
        layers
            .set(&mut settings, "direct,caustic,direct")
            .expect("layers");
        assert_eq!(settings.layers, [LayerKind::Caustic, LayerKind::Direct]);
    }
}
