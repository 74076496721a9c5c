//! The catalogue of hard cases at its quick effort, group by group, and what the README says of it.

use std::sync::Arc;

use nephroid::progress::Control;
use nephroid::scene::builtin;
use nephroid::session::{BakeResult, BakeSession};
use nephroid::settings::{BakeSettings, MapResolution};
use nephroid::study::stability::bench::{BOOKS_BOUND, books_open};
use nephroid::study::stability::table::number;
use nephroid::study::stability::{Bench, Case, CaseReport, Effort, Group, cases};

const README: &str = include_str!("../../README.md");

fn of(group: Group) -> impl Iterator<Item = Case> {
    let is_quick = |case: &Case| case.effort == Effort::Quick;
    cases()
        .into_iter()
        .filter(move |case| case.group == group && is_quick(case))
}

/// Every law of a group holds, and stands in the README with its bound.
fn keep(group: Group) {
    let mut faults = Vec::new();
    for case in of(group) {
        match case.check((Effort::Quick, 0), &(), &Control::default()) {
            Err(error) => faults.push(format!("{}: {error}", case.name)),
            Ok(report) => faults.extend(faults_of(&report)),
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn faults_of(report: &CaseReport) -> Vec<String> {
    let mut faults = Vec::new();
    if !report.holds() {
        faults.push(format!("{report:?}"));
    }
    for finding in &report.findings {
        let is_listed = README.lines().any(|line| {
            let mut cells = line.split('|').map(str::trim).skip(2);
            cells.next() == Some(finding.law.as_str()) && cells.nth(1) == Some(number(finding.bound).as_str())
        });
        if !is_listed {
            faults.push(format!(
                "{}: the README does not say `{}`",
                report.case, finding.law
            ));
        }
    }
    faults
}

#[test]
fn optics_keep_to_their_laws() {
    keep(Group::Optics);
}

#[test]
fn geometry_keeps_to_its_laws() {
    keep(Group::Geometry);
}

#[test]
fn materials_and_lights_keep_to_their_laws() {
    keep(Group::Materials);
}

#[test]
fn numbers_keep_to_their_laws() {
    keep(Group::Numbers);
}

#[test]
fn symmetry_and_proportion_hold() {
    keep(Group::Laws);
}

#[test]
fn the_readme_lists_every_case_and_none_that_fails() {
    let listed: Vec<&str> = README
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` |").map(|(name, _)| name))
        .collect();
    let known: Vec<&str> = cases().iter().map(|case| case.name).collect();
    for name in &known {
        assert!(listed.contains(name), "the README's table lacks {name}");
        assert_eq!(
            known.iter().filter(|other| *other == name).count(),
            1,
            "{name} twice"
        );
    }
    assert!(!README.contains("**fails**"));
}

fn ring() -> BakeResult {
    let scene = Arc::new(builtin::build("ring").expect("it is built in"));
    let settings = BakeSettings {
        density_per_sr: 500.0,
        map_resolution: MapResolution::Fixed {
            width: 16,
            height: 16,
        },
        ..BakeSettings::default()
    };
    let mut session = BakeSession::new(scene).expect("a session");
    session.bake(&settings, &(), &Control::default()).expect("a bake")
}

#[test]
fn a_lost_watt_and_a_value_that_is_no_number_are_noticed() {
    let sound = ring();
    assert!(books_open(&sound) <= BOOKS_BOUND);
    let mut lost = sound.clone();
    lost.ledgers[0].energy_w.deposited *= 1.0 + 1e-5;
    assert!(books_open(&lost) > BOOKS_BOUND);
    let mut dark = sound.clone();
    let values = &mut dark.maps[0].layers[0].irradiance;
    let lit = values.iter_mut().find(|e| e[1] > 0.0).expect("a lit texel");
    *lit = [0.0; 3];
    assert!(books_open(&dark) > BOOKS_BOUND);
    for bad in [f32::NAN, f32::INFINITY, -1e-3] {
        let mut broken = sound.clone();
        broken.maps[0].layers[0].irradiance[7][2] = bad;
        assert!(books_open(&broken).is_infinite(), "{bad}");
    }
}

#[test]
fn a_law_that_is_broken_once_is_broken() {
    let control = Control::default();
    let mut bench = Bench::new((Effort::Quick, 0), &(), &control);
    for off in [0.1, f64::NAN, 0.2] {
        bench.law("law", off, 0.5);
    }
    bench.must("must", true);
    assert_eq!(bench.findings.len(), 2);
    assert!(!bench.findings[0].holds() && bench.findings[1].holds());
    bench.must("must", false);
    assert!(!bench.findings[1].holds());
}
