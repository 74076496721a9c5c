//! The whole panel on small and on dense screens.

use egui::accesskit::Role;
use egui::pos2;
use glam::DVec3;
use nephroid::scene::{Edit, LightEdit, Motion};
use nephroid::settings::{BakeSettings, Sigma};
use nephroid::viewer::command::Command;

use super::headless::{Headless, SCREEN, splats};

/// As the program opens it, the same on a dense screen, and the smallest.
const SCREENS: [((f32, f32), f32); 3] = [SCREEN, (SCREEN.0, 2.0), ((700.0, 400.0), 2.0)];

#[test]
fn every_control_says_what_it_does() {
    for screen in SCREENS {
        let mut panel = Headless::opened(splats(), screen);
        // Of the splats' panel all, and what only the wavefront estimator has.
        panel.choose("Bake until", "max time");
        panel.assert_names();
        for (role, name, _) in panel.controls() {
            panel.move_to(pos2(690.0, 300.0));
            panel.settle();
            let before = panel.texts();
            panel.hover(role, &name);
            assert!(
                !panel.texts().is_subset(&before),
                "{role:?} {name:?} says nothing on {screen:?}"
            );
        }
    }
}

#[test]
fn nothing_is_cut_off_or_overlaps() {
    let adaptive = BakeSettings {
        sigma: Sigma::Adaptive,
        density_per_sr: 102_400_000.0,
        ..splats()
    };
    for screen in SCREENS {
        for settings in [splats(), adaptive.clone(), BakeSettings::default()] {
            let mut panel = Headless::opened(settings, screen);
            // With what sets them back beside them.
            let edits = [
                Edit::Light(0, LightEdit::Position(DVec3::new(-10.75, -20.125, -30.25))),
                Edit::Place(0, Motion::turned(0.0, DVec3::splat(-1.125))),
            ];
            panel.tell(|model| {
                for edit in edits {
                    model.apply(Command::Edit(edit));
                }
            });
            panel.choose("Tone map", "ACES");
            panel.click(Role::RadioButton, "caustic");
            panel.assert_layout();
        }
    }
}
