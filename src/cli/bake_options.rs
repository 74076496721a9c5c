//! Bake options: from flags to validated settings.

use clap::builder::{PossibleValuesParser, ValueParser};
use clap::{Arg, ArgAction, ArgGroup, ArgMatches, Args, Command, FromArgMatches, Id};
use nephroid::error::{Error, Result};
use nephroid::settings::options::{OPTIONS, OptionInfo, named};
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MIN_MAX_ERROR, Preset};

/// The bake options that were given, with their values as text.
#[derive(Clone, Debug, Default)]
pub struct BakeOptions(Vec<(&'static OptionInfo, String)>);

/// Group of all bake options, for conflicts with them.
pub const GROUP: &str = "BakeOptions";

/// Their heading in `--help`.
pub const HEADING: &str = "Bake options";

/// Options in `-h`, and in `--help` of commands other than `bake`.
pub const COMMON: [&str; 8] = [
    "preset",
    "estimator",
    "density",
    "max-error",
    "max-time",
    "map-resolution",
    "layers",
    "effects",
];

fn arg(option: &'static OptionInfo) -> Arg {
    let arg = Arg::new(option.name)
        .long(option.name)
        .help_heading(HEADING)
        .help(option.brief)
        .hide_short_help(!COMMON.contains(&option.name));
    if option.value.is_empty() {
        return arg.action(ArgAction::SetTrue);
    }
    let parser = match option.values {
        Some(values) => PossibleValuesParser::new(values().into_iter().map(|(name, _)| name)).into(),
        None => ValueParser::from(|text: &str| {
            option.set(&mut BakeSettings::default(), text)?;
            Ok::<_, String>(text.to_string())
        }),
    };
    let arg = arg
        .value_name(option.value)
        .value_parser(parser)
        .allow_hyphen_values(true);
    match option.is_list {
        true => arg.value_delimiter(',').action(ArgAction::Append),
        false => arg,
    }
}

impl Args for BakeOptions {
    fn group_id() -> Option<Id> {
        Some(GROUP.into())
    }

    fn augment_args(command: Command) -> Command {
        let group = ArgGroup::new(GROUP).multiple(true);
        let group = group.args(OPTIONS.iter().map(|option| option.name));
        command.args(OPTIONS.iter().map(arg)).group(group)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for BakeOptions {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let given = OPTIONS.iter().filter_map(|option| {
            if option.value.is_empty() {
                return matches.get_flag(option.name).then(|| (option, String::new()));
            }
            let values: Vec<String> = matches.get_many(option.name)?.cloned().collect();
            Some((option, values.join(",")))
        });
        Ok(Self(given.collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl BakeOptions {
    /// Validated settings; `default_layers` if no layers are given, `threads` 0 = one per core.
    ///
    /// # Errors
    /// A value outside its range; an option that does not apply to the others given.
    pub fn settings(&self, default_layers: &[LayerKind], threads: usize) -> Result<BakeSettings> {
        let estimator = self.value("estimator").map(named::<Estimator>);
        let estimator = estimator.and_then(|named| named.ok()).unwrap_or(Estimator::Auto);
        let mut settings = BakeSettings {
            layers: default_layers.to_vec(),
            threads,
            ..BakeSettings::of(estimator)
        };
        for (option, text) in &self.0 {
            let refused = |what| Error::usage(format!("--{}", option.name), what, "give another value");
            option.set(&mut settings, text).map_err(refused)?;
        }
        self.aim(&mut settings);
        for (option, _) in &self.0 {
            option.check_applies(&settings)?;
        }
        settings.validate()?;
        Ok(settings)
    }

    /// Sets target error and starting density if they were not given.
    fn aim(&self, settings: &mut BakeSettings) {
        let preset = self.value("preset").and_then(|name| named::<Preset>(name).ok());
        let is_exact = self.value("density").is_some() || !settings.estimator.refines();
        if settings.max_error.is_none() && !is_exact {
            settings.max_error = match (preset, settings.max_time_s) {
                // Refine for as long as the time lasts.
                (None, Some(_)) => Some(MIN_MAX_ERROR),
                _ => Some(preset.unwrap_or_default().max_error()),
            };
        }
        if self.value("density").is_none() {
            settings.density_per_sr = match (settings.estimator, settings.max_error) {
                (Estimator::Splat, _) => preset.unwrap_or_default().splat_density_per_sr(),
                (_, Some(target)) => BakeSettings::starting_density_per_sr(target),
                (estimator, None) => estimator.preview_density_per_sr(),
            };
        }
    }

    /// Value of an option as text, if it was given.
    fn value(&self, name: &str) -> Option<&str> {
        let given = self.0.iter().find(|(option, _)| option.name == name);
        given.map(|(_, text)| text.as_str())
    }

    /// For the scene that opens by default: draft quality, unless the options say otherwise.
    pub fn for_a_first_look(mut self) -> Self {
        if !self.names_quality() && self.value("estimator") != Some("splat") {
            let preset = OPTIONS.iter().find(|option| option.name == "preset");
            self.0.extend(preset.map(|option| (option, "draft".to_string())));
        }
        self
    }

    /// Whether any bake option was given.
    #[cfg(feature = "viewer")]
    pub fn names_any(&self) -> bool {
        !self.0.is_empty()
    }

    /// Whether an option sets the quality of the maps or the time of the bake.
    pub fn names_quality(&self) -> bool {
        let options = ["preset", "density", "max-error", "max-time"];
        options.iter().any(|name| self.value(name).is_some())
    }
}
