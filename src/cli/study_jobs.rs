//! Studies that are to be done, with everything checked that can be checked before they start.

use std::path::PathBuf;

use clap::ValueEnum;
use nephroid::error::{Error, Result};
use nephroid::settings::{BakeSettings, Estimator, LayerKind, MapResolution, Wavelengths};
use nephroid::study::brute_force;
use nephroid::study::convergence::{DEFAULT_DENSITIES, Ladder};
use nephroid::study::effects::EffectStudy;
use nephroid::study::pages::{PageStudy, STUDIES as PAGES};
use nephroid::study::spectrum::{DEFAULT_WAVELENGTHS, SpectrumStudy};
use nephroid::study::stability::{Case, Effort};

use super::args::{
    ALL_PAGES, ConvergenceArguments, EffectsArguments, PageArguments, ReferenceArguments, SpectrumArguments,
    StabilityArguments, Study, StudyArguments,
};
use super::job::{Job, scene_input, threads};
use super::scene_input::{MissingLight, SceneInput};
use super::study_stability;

/// `study convergence`.
#[derive(Debug)]
pub struct ConvergenceJob {
    pub scene: SceneInput,
    pub ladder: Ladder,
    pub reference: Option<PathBuf>,
    pub surface: Option<String>,
    pub output: PathBuf,
    pub force: bool,
}

/// `study reference`.
#[derive(Debug)]
pub struct ReferenceJob {
    pub scene: SceneInput,
    pub settings: BakeSettings,
    pub rays: u64,
    pub output: PathBuf,
    pub force: bool,
}

/// `study effects`.
#[derive(Debug)]
pub struct EffectsJob {
    pub scene: SceneInput,
    pub study: EffectStudy,
    pub output: PathBuf,
    pub force: bool,
}

/// What sampling the spectrum costs.
#[derive(Debug)]
pub struct SpectrumJob {
    pub scene: SceneInput,
    pub study: SpectrumStudy,
    /// Folder of the table and the strips.
    pub output: PathBuf,
    pub force: bool,
}

/// `study stability`.
#[derive(Debug)]
pub struct StabilityJob {
    pub cases: Vec<Case>,
    pub effort: Effort,
    pub threads: usize,
    pub output: PathBuf,
    pub force: bool,
}

/// Studies whose result is a page.
#[derive(Debug)]
pub struct PageJob {
    /// Each with its folder.
    pub studies: Vec<(PageStudy, PathBuf)>,
    pub quick: bool,
    pub threads: usize,
    pub force: bool,
}

/// The job of a study.
///
/// # Errors
/// No study is named; a value outside its range.
pub fn study_job(arguments: StudyArguments) -> Result<Job> {
    if let Some((name, page)) = arguments.study.as_ref().and_then(Study::as_page) {
        return page_job(name, page);
    }
    match arguments.study {
        Some(Study::Convergence(convergence)) => convergence_job(convergence),
        Some(Study::Reference(reference)) => reference_job(reference),
        Some(Study::Effects(effects)) => effects_job(effects),
        Some(Study::Spectrum(spectrum)) => spectrum_job(spectrum),
        Some(Study::Stability(stability)) => stability_job(stability),
        None if arguments.list => Ok(Job::ListStudies),
        _ => Err(Error::usage(
            "study",
            "no study is named",
            "name one, or use --list to see which there are",
        )),
    }
}

fn page_job(name: &'static str, arguments: &PageArguments) -> Result<Job> {
    let studies = if name == ALL_PAGES {
        let in_its_folder = |study: PageStudy| (study, arguments.output.join(study.name));
        PAGES.into_iter().map(in_its_folder).collect()
    } else {
        let study = PageStudy::named(name)
            .ok_or_else(|| Error::usage("study", format!("there is no study {name}"), "use --list"))?;
        vec![(study, arguments.output.clone())]
    };
    Ok(Job::Page(PageJob {
        studies,
        quick: arguments.quick,
        threads: threads(&arguments.run)?,
        force: arguments.force,
    }))
}

/// Texels across and down of a study's maps where none are asked for.
const STUDY_RESOLUTION: MapResolution = MapResolution::Fixed {
    width: 256,
    height: 256,
};

/// Bakes of each kind where no number is asked for.
const DEFAULT_REPEATS: usize = 5;

/// Most bakes of each kind.
const MAX_REPEATS: usize = 1000;

/// Densest lattice of `--quick` [1/sr].
const QUICK_DENSITY: f64 = 1e5;

fn convergence_job(arguments: ConvergenceArguments) -> Result<Job> {
    let settings = BakeSettings {
        map_resolution: arguments.map_resolution.unwrap_or(STUDY_RESOLUTION),
        threads: threads(&arguments.run)?,
        ..BakeSettings::default()
    };
    let densities = arguments.densities.unwrap_or_else(|| {
        let wanted = |density: &f64| !arguments.quick || *density <= QUICK_DENSITY;
        DEFAULT_DENSITIES.into_iter().filter(wanted).collect()
    });
    check_ladder(&densities, &settings)?;
    let mut estimators: Vec<Estimator> = Vec::new();
    for estimator in arguments
        .estimators
        .unwrap_or_else(|| Estimator::value_variants().to_vec())
    {
        if !estimators.contains(&estimator) {
            estimators.push(estimator);
        }
    }
    let repeats = match arguments.repeat {
        None if arguments.quick => 1,
        asked => repeats(asked)?,
    };
    let scene = arguments.scene.unwrap_or_else(|| "builtin:ring".to_string());
    Ok(Job::Convergence(ConvergenceJob {
        scene: scene_input(scene, &arguments.scene_options, MissingLight::Fail),
        ladder: Ladder {
            estimators,
            densities,
            repeats,
            settings,
        },
        reference: arguments.reference,
        surface: arguments.surface,
        output: arguments.output,
        force: arguments.force,
    }))
}

/// Bakes of each kind.
fn repeats(asked: Option<usize>) -> Result<usize> {
    match asked {
        None => Ok(DEFAULT_REPEATS),
        Some(repeats) if (1..=MAX_REPEATS).contains(&repeats) => Ok(repeats),
        Some(repeats) => Err(Error::usage(
            "--repeat",
            format!("{repeats} is outside 1 to {MAX_REPEATS}"),
            "give a number in that range",
        )),
    }
}

fn check_ladder(densities: &[f64], settings: &BakeSettings) -> Result<()> {
    if densities.is_empty() || !densities.is_sorted_by(|a, b| a < b) {
        return Err(Error::usage(
            "--densities",
            "they have to be in ascending order, each once",
            "give numbers such as 1e3,1e4,1e5",
        ));
    }
    for &density_per_sr in densities {
        let rung = BakeSettings {
            density_per_sr,
            ..settings.clone()
        };
        rung.validate().map_err(|error| Error {
            location: "--densities".into(),
            ..error
        })?;
    }
    Ok(())
}

fn reference_job(arguments: ReferenceArguments) -> Result<Job> {
    let settings = BakeSettings {
        map_resolution: arguments.map_resolution.unwrap_or(STUDY_RESOLUTION),
        seed: arguments.seed.unwrap_or(0),
        threads: threads(&arguments.run)?,
        ..BakeSettings::default()
    };
    settings.validate()?;
    brute_force::check_rays(arguments.rays)?;
    Ok(Job::Reference(ReferenceJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Fail),
        settings,
        rays: arguments.rays,
        output: arguments.output,
        force: arguments.force,
    }))
}

fn effects_job(arguments: EffectsArguments) -> Result<Job> {
    let settings = arguments
        .bake
        .settings(&[LayerKind::Caustic], threads(&arguments.run)?)?;
    if settings.max_time_s.is_some() {
        return Err(Error::usage(
            "--max-time",
            "bakes that a clock ends do not differ by their effects alone",
            "leave it out, or use --max-error or --density",
        ));
    }
    Ok(Job::Effects(EffectsJob {
        scene: scene_input(arguments.scene, &arguments.scene_options, MissingLight::Fail),
        study: EffectStudy {
            settings,
            repeats: repeats(arguments.repeat)?,
        },
        output: arguments.output,
        force: arguments.force,
    }))
}

/// Density of thin beams where none is asked for [rays/sr].
const BEAM_DENSITY_PER_SR: f64 = 1e8;

fn spectrum_job(arguments: SpectrumArguments) -> Result<Job> {
    let wavelengths = arguments
        .wavelengths
        .unwrap_or_else(|| DEFAULT_WAVELENGTHS.to_vec());
    let settings = BakeSettings {
        map_resolution: arguments.map_resolution.unwrap_or(MapResolution::Fixed {
            width: 1024,
            height: 1024,
        }),
        density_per_sr: arguments.density.unwrap_or(BEAM_DENSITY_PER_SR),
        threads: threads(&arguments.run)?,
        ..BakeSettings::default()
    };
    for &count in &wavelengths {
        let way = BakeSettings {
            wavelengths: Wavelengths::Fixed(count),
            ..settings.clone()
        };
        way.validate()?;
    }
    let scene = arguments.scene.unwrap_or_else(|| "builtin:spectrum".to_string());
    Ok(Job::Spectrum(SpectrumJob {
        scene: scene_input(scene, &arguments.scene_options, MissingLight::Fail),
        study: SpectrumStudy {
            settings,
            wavelengths,
            repeats: repeats(arguments.repeat)?,
        },
        output: arguments.output,
        force: arguments.force,
    }))
}

fn stability_job(arguments: StabilityArguments) -> Result<Job> {
    let effort = if arguments.long {
        Effort::Long
    } else {
        Effort::Quick
    };
    Ok(Job::Stability(StabilityJob {
        cases: study_stability::chosen(arguments.case.as_deref(), effort)?,
        effort,
        threads: threads(&arguments.run)?,
        output: arguments.output,
        force: arguments.force,
    }))
}
