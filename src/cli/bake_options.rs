//! Bake options: from flags to validated settings.

use clap::builder::{PossibleValue, PossibleValuesParser, ValueParser};
use clap::{Arg, ArgAction, ArgGroup, ArgMatches, Args, Command, FromArgMatches, Id};
use nephroid::error::{Error, Result};
use nephroid::settings::options::{OPTIONS, OptionInfo, named};
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MIN_MAX_ERROR, Preset};

/// The options of a bake that are named, with their values as they are written.
#[derive(Clone, Debug, Default)]
pub struct BakeOptions(Vec<(&'static OptionInfo, String)>);

/// All of them, in what conflicts with them.
pub const GROUP: &str = "BakeOptions";

fn arg(option: &'static OptionInfo) -> Arg {
    let stated = |before: &str, text: &str| match text {
        "" => String::new(),
        text => format!(" [{before}{text}]"),
    };
    // Names stand below.
    let range = option.values.map_or(option.range(), |_| String::new());
    let default = stated("default: ", option.default);
    let help = format!("{}{}{default}", option.what, stated("", &range));
    let arg = Arg::new(option.name)
        .long(option.name)
        .help_heading("Bake options")
        .long_help(format!(
            "{help}\nAccuracy: {}. Cost: {}",
            option.accuracy, option.cost
        ))
        .help(help);
    if option.value.is_empty() {
        return arg.action(ArgAction::SetTrue);
    }
    let parser = match option.values {
        Some(values) => {
            let values = values().into_iter();
            PossibleValuesParser::new(values.map(|(name, what)| PossibleValue::new(name).help(what))).into()
        }
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
    /// Validated settings; `default_layers` where no layer is named, `threads` 0 = one per core.
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

    /// Sets the error to refine towards and the density to begin from where they are not named.
    fn aim(&self, settings: &mut BakeSettings) {
        let preset = self.value("preset").and_then(|name| named::<Preset>(name).ok());
        let is_exact = self.value("density").is_some() || !settings.estimator.refines();
        if settings.max_error.is_none() && !is_exact {
            settings.max_error = match (preset, settings.max_time_s) {
                // As far as the time goes.
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

    /// An option's value as it is written.
    fn value(&self, name: &str) -> Option<&str> {
        let given = self.0.iter().find(|(option, _)| option.name == name);
        given.map(|(_, text)| text.as_str())
    }

    /// Of the scene that nobody asked for: all its light, as a draft, where nothing else is asked.
    pub fn for_a_first_look(mut self) -> Self {
        let is_draft = !self.names_quality() && self.value("estimator") != Some("splat");
        let added = [
            ("preset", "draft", is_draft),
            (
                "layers",
                "caustic,direct,indirect",
                self.value("layers").is_none(),
            ),
        ];
        for (name, text, _) in added.into_iter().filter(|(.., is_added)| *is_added) {
            let option = OPTIONS.iter().find(|option| option.name == name);
            self.0.extend(option.map(|option| (option, text.to_string())));
        }
        self
    }

    /// Whether any of them is given.
    #[cfg(feature = "viewer")]
    pub fn names_any(&self) -> bool {
        !self.0.is_empty()
    }

    /// Whether an option says how good maps are to be, or how long they may take.
    pub fn names_quality(&self) -> bool {
        let options = ["preset", "density", "max-error", "max-time"];
        options.iter().any(|name| self.value(name).is_some())
    }
}
