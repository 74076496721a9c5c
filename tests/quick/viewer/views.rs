//! What the picture shows in place of light, on which scale, and what it is compared with.

use nephroid::viewer::beside::Reference;
use nephroid::viewer::views::{IrradianceUnit, MapSurvey, ScaleChoice};

use super::headless::Gesture::{Check, Choose, Radio};
use super::*;

/// Two texels over 1 and 3 m².
fn map(object: usize, irradiance: [[f32; 3]; 2]) -> IlluminationMap {
    caustic(chart(object, 2, 1, vec![1.0, 3.0]), irradiance.to_vec())
}

fn survey(peak_w_m2: f64, faults: usize) -> MapSurvey {
    MapSurvey {
        peak_w_m2,
        faults,
        ..MapSurvey::default()
    }
}

fn panel() -> Headless {
    Headless::new(BakeSettings::splat())
}

#[test]
fn survey_tells_peak_density_and_faults() {
    let good = map(0, [[4.0; 3], [2.0, 0.0, 0.0]]);
    let bad = map(1, [[f32::NAN, 9.0, 9.0], [0.0, f32::INFINITY, 0.0]]);
    for (maps, faults) in [(vec![good.clone()], 0), (vec![good, bad], 2)] {
        let survey = MapSurvey::of(&maps);
        assert_eq!(survey.faults, faults);
        // Faults are no light.
        near(survey.peak_w_m2, 4.0, 1e-6, "peak");
        // Two texels on 4 m².
        let density = survey.texels_per_m.expect("there is a map");
        near(density, [0.5_f64.sqrt(); 2], 1e-12, "density");
    }
}

#[test]
fn scale_follows_the_maps_until_typed() {
    let survey = survey(43.0, 0);
    let mut choice = ScaleChoice::default();
    let scale = survey.scale(Quantity::Irradiance, &choice);
    assert!(scale.is_logarithmic && scale.high == 50.0 && (scale.low - 0.005).abs() < 1e-12);
    let dark = MapSurvey::default().scale(Quantity::Irradiance, &choice);
    assert!(dark.low > 0.0 && dark.high > dark.low);
    choice.is_logarithmic = false;
    for (is_automatic, ends) in [(true, [0.0, 50.0]), (false, [0.5, 2.0])] {
        (choice.is_automatic, choice.typed_w_m2) = (is_automatic, [0.5, 2.0]);
        let scale = survey.scale(Quantity::Irradiance, &choice);
        assert_eq!([scale.low, scale.high], ends);
    }
}

#[test]
fn irradiance_has_a_unit_and_counts_faults() {
    let mut panel = panel();
    panel.model.survey = survey(2.0, 0);
    assert!(!panel.says("From, to"), "it belongs to the irradiance");
    panel.make(Choose("View", "irradiance"));
    assert_eq!(panel.model.choices.display.quantity, Quantity::Irradiance);
    panel.assert_says(&[" to 2 W/m²"]);
    panel.make(Radio("lx"));
    assert_eq!(panel.model.choices.display.scale.unit, IrradianceUnit::Lux);
    // 683 times 2.
    panel.assert_says(&[" to 1366 lx"]);
    panel.make(Check("auto"));
    assert!(!panel.model.choices.display.scale.is_automatic && !panel.says("magenta."));
    panel.tell(|model| model.survey = survey(0.0, 3));
    panel.assert_says(&["3 texels without a finite value"]);
}

#[test]
fn reference_tells_its_relative_rmse() {
    let panel = panel();
    let before = [map(0, [[2.0; 3], [2.0; 3]])];
    let mut reference = Reference::kept(panel.model.scene(), &before).expect("there are maps");
    reference.compare(&before);
    assert_eq!(reference.relative_rmse, Ok(0.0));
    // Off by 1 W/m² on a quarter of the area: √(1/4) over a mean of 2.
    reference.compare(&[map(0, [[3.0; 3], [2.0; 3]])]);
    near(
        reference.relative_rmse.clone().expect("it is lit"),
        0.25,
        1e-6,
        "RMSE",
    );
    says(reference.told(), " 25 %");
    assert!(Reference::kept(panel.model.scene(), &[]).is_err());
}

#[test]
fn comparison_begins_and_ends_by_buttons() {
    let mut panel = panel();
    panel.open("Compare");
    panel.press("Keep as before");
    assert_eq!(panel.asked(), [Command::Compare(CompareCommand::Keep)]);
    assert!(panel.is_disabled(Role::Button, "End comparison"));
    let maps = [map(0, [[1.0; 3], [1.0; 3]])];
    let mut reference = Reference::kept(panel.model.scene(), &maps).expect("there are maps");
    reference.compare(&maps);
    panel.tell(|model| model.reference = Some(reference));
    panel.assert_says(&["differs from before by 0 %"]);
    panel.press("End comparison");
    assert_eq!(panel.asked(), [Command::Compare(CompareCommand::End)]);
}
