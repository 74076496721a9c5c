//! What the picture shows in place of light, and on which scale; and what it is held against.

use std::sync::Arc;

use egui::accesskit::Role;
use glam::DVec2;
use nephroid::illumination::{Chart, IlluminationMap, Layer, Receiver, UvSet};
use nephroid::settings::{BakeSettings, LayerKind};
use nephroid::viewer::beside::Reference;
use nephroid::viewer::panel::{CompareWish, Quantity};
use nephroid::viewer::views::{IrradianceUnit, MapSurvey, ScaleChoice};

use super::headless::Headless;

/// Two texels of one map over 1 and 3 m².
fn map(object: usize, irradiance: [[f32; 3]; 2]) -> IlluminationMap {
    IlluminationMap {
        chart: Arc::new(Chart {
            receiver: Receiver::front(object),
            uv_set: UvSet::Generated,
            corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
            width: 2,
            height: 1,
            texel_areas_m2: vec![1.0, 3.0],
            layout: None,
            beyond: Vec::new(),
            joints: Vec::new(),
        }),
        layers: vec![Layer {
            kind: LayerKind::Caustic,
            irradiance: irradiance.to_vec(),
        }],
        error: None,
        estimated_relative_rmse: None,
    }
}

fn panel() -> Headless {
    Headless::new(BakeSettings::splat(), (1280.0, 1400.0))
}

fn choose_view(panel: &mut Headless, name: &str) {
    let centre = Headless::rect_of(panel.labelled(Role::ComboBox, "View")).center();
    panel.click(centre);
    press(panel, Role::Button, name);
}

fn press(panel: &mut Headless, role: Role, name: &str) {
    let centre = Headless::rect_of(panel.named(role, name)).center();
    panel.click(centre);
}

#[test]
fn a_survey_tells_peak_density_and_what_is_no_number() {
    let good = map(0, [[4.0; 3], [2.0, 0.0, 0.0]]);
    let bad = map(1, [[f32::NAN, 9.0, 9.0], [0.0, f32::INFINITY, 0.0]]);
    let survey = MapSurvey::of(std::slice::from_ref(&good));
    assert!((survey.peak_w_m2 - 4.0).abs() < 1e-6, "{survey:?}");
    // Two texels on 4 m².
    let [least, most] = survey.texels_per_m.expect("there is a map");
    assert!(
        (least - 0.5_f64.sqrt()).abs() < 1e-12 && least == most,
        "{survey:?}"
    );
    assert_eq!(survey.faults, 0);
    let survey = MapSurvey::of(&[good, bad]);
    assert_eq!(survey.faults, 2);
    assert!(
        (survey.peak_w_m2 - 4.0).abs() < 1e-6,
        "faults are no light: {survey:?}"
    );
}

#[test]
fn the_scale_follows_the_maps_until_it_is_typed() {
    let survey = MapSurvey {
        peak_w_m2: 43.0,
        ..MapSurvey::default()
    };
    let mut choice = ScaleChoice::default();
    let scale = survey.scale(Quantity::Irradiance, &choice);
    assert!(scale.is_logarithmic && scale.high == 50.0 && (scale.low - 0.005).abs() < 1e-12);
    choice.is_logarithmic = false;
    let scale = survey.scale(Quantity::Irradiance, &choice);
    assert_eq!([scale.low, scale.high], [0.0, 50.0]);
    choice.is_automatic = false;
    choice.typed_w_m2 = [0.5, 2.0];
    let scale = survey.scale(Quantity::Irradiance, &choice);
    assert_eq!([scale.low, scale.high], [0.5, 2.0]);
    let dark = MapSurvey::default().scale(Quantity::Irradiance, &ScaleChoice::default());
    assert!(
        dark.low > 0.0 && dark.high > dark.low,
        "a dark scene has a scale too"
    );
}

#[test]
fn irradiance_has_a_scale_in_the_unit_that_is_chosen() {
    let mut panel = panel();
    panel.survey.peak_w_m2 = 2.0;
    assert!(!panel.says("From, to"), "it belongs to the irradiance");
    choose_view(&mut panel, "irradiance");
    assert_eq!(panel.panel.display.quantity, Quantity::Irradiance);
    panel.settle();
    assert!(panel.says(" to 2 W/m²"), "{:#?}", panel.texts());
    press(&mut panel, Role::RadioButton, "lx");
    assert_eq!(panel.panel.display.scale.unit, IrradianceUnit::Lux);
    panel.settle();
    assert!(panel.says(" to 1366 lx"), "683 times 2: {:#?}", panel.texts());
    press(&mut panel, Role::CheckBox, "auto");
    assert!(!panel.panel.display.scale.is_automatic);
}

#[test]
fn texels_without_a_finite_value_are_counted() {
    let mut panel = panel();
    assert!(!panel.says("magenta."));
    panel.survey.faults = 3;
    panel.settle();
    assert!(
        panel.says("3 texels without a finite value"),
        "{:#?}",
        panel.texts()
    );
}

#[test]
fn the_difference_to_a_reference_is_its_relative_rmse() {
    let panel = panel();
    let before = [map(0, [[2.0; 3], [2.0; 3]])];
    let mut reference = Reference::kept(&panel.scene, &before).expect("there are maps");
    reference.compare(&before);
    assert_eq!(reference.relative_rmse, Ok(0.0));
    // Off by 1 W/m² on a quarter of the area: √(1/4) over a mean of 2.
    reference.compare(&[map(0, [[3.0; 3], [2.0; 3]])]);
    let rmse = reference.relative_rmse.clone().expect("it is lit");
    assert!((rmse - 0.25).abs() < 1e-6, "{rmse}");
    assert!(reference.told().contains(" 25 %"), "{}", reference.told());
    assert!(Reference::kept(&panel.scene, &[]).is_err(), "nothing to be kept");
}

#[test]
fn a_comparison_is_begun_and_ended_by_buttons() {
    let mut panel = panel();
    press(&mut panel, Role::DisclosureTriangle, "Compare");
    press(&mut panel, Role::Button, "Keep as before");
    assert_eq!(panel.wishes.compare, Some(CompareWish::Keep));
    panel.wishes = Default::default();
    press(&mut panel, Role::Button, "End comparison");
    assert_eq!(panel.wishes.compare, None, "there is none");
    let maps = [map(0, [[1.0; 3], [1.0; 3]])];
    let mut reference = Reference::kept(&panel.scene, &maps).expect("there are maps");
    reference.compare(&maps);
    panel.reference = Some(reference);
    panel.settle();
    assert!(panel.says("differs from before by 0 %"), "{:#?}", panel.texts());
    press(&mut panel, Role::Button, "End comparison");
    assert_eq!(panel.wishes.compare, Some(CompareWish::End));
}
