//! Every section of the panel, found and used by accessible names alone, on small and on dense screens.

use std::collections::BTreeSet;
use std::sync::Arc;

use egui::accesskit::Role;
use egui::{Key, Rect, Vec2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::{DVec2, DVec3};
use nephroid::effect::{Effect, EffectSwitch};
use nephroid::eye_pass::{ToneMap, WhiteBalance};
use nephroid::illumination::{Chart, IlluminationMap, Layer, Receiver, UvSet};
use nephroid::scene::{Edit, Scene};
use nephroid::settings::{
    BakeSettings, Estimator, Footprint, ItemBufferKind, Kernel, LayerKind, MapResolution, Preset,
    RayPlacement, Sigma,
};
use nephroid::viewer::exporting::{Export, ExportState};
use nephroid::viewer::files::FileFacts;
use nephroid::viewer::latency::Latencies;
use nephroid::viewer::navigation::Travel;
use nephroid::viewer::new_light::NewLight;
use nephroid::viewer::panel::accuracy::preset;
use nephroid::viewer::panel::{Facts, LayerShown, Panel, Quantity, WIDTH, Wishes, set_style};
use nephroid::viewer::views::MapSurvey;
use nephroid::viewer::worker::{BakeState, BakedLevel};

use super::headless::finished;
use super::panel::scene;

/// Left of the panel in the harness [points]: it leaves a margin.
const LEFT: f32 = 8.0;
/// Sizes of windows [points] and pixels per point: as the program opens it, the same on a dense screen, and the smallest.
const SCREENS: [((f32, f32), f32); 3] = [
    ((1280.0, 720.0), 1.0),
    ((1280.0, 720.0), 2.0),
    ((700.0, 400.0), 2.0),
];
/// In their order, with what they hold in sections of their own.
const SECTIONS: [(&str, &[&str]); 10] = [
    ("Scene", &[]),
    ("Light pass", &["Rays and kernels", "Energy"]),
    ("Accuracy", &["Error against time", "Limits"]),
    ("Effects", &[]),
    ("Maps", &[]),
    ("Display", &["Frame time"]),
    ("Export", &[]),
    ("Camera path", &[]),
    ("Probe", &[]),
    ("Compare", &[]),
];

/// The panel with what it is told, and what was pressed since the start.
struct Desk {
    panel: Panel,
    scene: Arc<Scene>,
    loaded: Arc<Scene>,
    last: BakedLevel,
    export: ExportState,
    wishes: Wishes,
}

impl Desk {
    fn new(settings: BakeSettings) -> Self {
        let scene = Arc::new(scene());
        let mut last = finished(&scene, &settings);
        last.result.maps = vec![map()];
        Self {
            panel: Panel::new(settings),
            loaded: Arc::clone(&scene),
            scene,
            last,
            export: ExportState::Idle,
            wishes: Wishes::default(),
        }
    }

    fn show(&mut self, ui: &mut egui::Ui) {
        let facts = Facts {
            scene: &self.scene,
            loaded: &self.loaded,
            undo: Some("sigma"),
            redo: Some("power of `lamp`"),
            refusal: None,
            state: &BakeState::Done,
            last: Some(&self.last),
            maps: &self.last.result.maps,
            export: &self.export,
            layers: &LayerKind::ALL,
            survey: &MapSurvey::default(),
            reference: None,
            probed: None,
            sketch: None,
            is_playing: false,
            film_told: None,
            has_errors: true,
            worth: None,
            chains: None,
            frame_times: None,
            latencies: &Latencies::default(),
            travel: Travel::Fly,
            speed_m_per_s: 1.0,
            files: FileFacts::default(),
            lost_device: false,
            adapter: "no adapter",
        };
        let wishes = self.panel.show(ui, &facts);
        self.wishes = std::mem::take(&mut self.wishes).and(wishes);
    }
}

/// Four by two texels on the floor, brightest at the right, with known errors.
pub fn map() -> IlluminationMap {
    let ramp = |scale: f32| (0..8).map(|texel| [scale * (texel % 4) as f32; 3]).collect();
    IlluminationMap {
        chart: Arc::new(Chart {
            receiver: Receiver::front(0),
            uv_set: UvSet::Generated,
            corner_uvs: vec![[DVec2::ZERO, DVec2::X, DVec2::Y]],
            width: 4,
            height: 2,
            texel_areas_m2: vec![1.0],
            layout: None,
            beyond: Vec::new(),
            joints: Vec::new(),
        }),
        layers: vec![
            Layer {
                kind: LayerKind::Caustic,
                irradiance: ramp(2.0),
            },
            Layer {
                kind: LayerKind::Direct,
                irradiance: ramp(1.0),
            },
        ],
        error: Some(vec![0.25; 8]),
        estimated_relative_rmse: Some(0.0213),
    }
}

type Panels = Harness<'static, Desk>;

fn open(settings: BakeSettings, (size, pixels_per_point): ((f32, f32), f32)) -> Panels {
    let mut harness = Harness::builder()
        .with_size(Vec2::from(size))
        .with_pixels_per_point(pixels_per_point)
        .with_context_setup(set_style)
        .build_ui_state(|ui, desk: &mut Desk| desk.show(ui), Desk::new(settings));
    harness.run_steps(4);
    harness
}

/// With every section open.
fn opened(settings: BakeSettings, screen: ((f32, f32), f32)) -> Panels {
    let mut panels = open(settings, screen);
    // What is open from the start.
    for (section, parts) in SECTIONS {
        if !["Light pass", "Accuracy", "Display", "Export"].contains(&section) {
            click(&mut panels, Role::DisclosureTriangle, section);
        }
        for part in parts {
            click(&mut panels, Role::DisclosureTriangle, part);
        }
    }
    panels
}

/// Every setting at which no control is greyed.
fn splats() -> BakeSettings {
    BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..BakeSettings::splat()
    }
}

/// Brings a control into the window; where it is then.
fn reach(panels: &mut Panels, role: Role, name: &str) -> Rect {
    panels.get_by_role_and_label(role, name).scroll_to_me();
    panels.run_steps(3);
    panels.get_by_role_and_label(role, name).rect()
}

fn click(panels: &mut Panels, role: Role, name: &str) {
    reach(panels, role, name);
    panels.get_by_role_and_label(role, name).click();
    panels.run_steps(3);
}

fn choose(panels: &mut Panels, list: &str, value: &str) {
    click(panels, Role::ComboBox, list);
    panels.get_by_role_and_label(Role::Button, value).click();
    panels.run_steps(3);
}

/// Types a number into a field and confirms it.
fn type_into(panels: &mut Panels, role: Role, name: &str, text: &str) {
    click(panels, role, name);
    panels.event(egui::Event::Text(text.into()));
    panels.key_press(Key::Enter);
    panels.run_steps(3);
}

/// Drags a slider from one share of its way to another.
fn drag(panels: &mut Panels, name: &str, from: f32, to: f32) {
    let rect = reach(panels, Role::Slider, name);
    let at = |share: f32| rect.left_center() + vec2(4.0 + 100.0 * share, 0.0);
    panels.hover_at(at(from));
    panels.run_steps(1);
    panels.drag_at(at(from));
    panels.run_steps(1);
    panels.hover_at(at(0.5 * (from + to)));
    panels.run_steps(1);
    panels.hover_at(at(to));
    panels.run_steps(1);
    panels.drop_at(at(to));
    panels.run_steps(2);
}

fn is_control(role: Role) -> bool {
    matches!(
        role,
        Role::Button
            | Role::CheckBox
            | Role::ColorWell
            | Role::ComboBox
            | Role::RadioButton
            | Role::Slider
            | Role::SpinButton
            | Role::TextInput
    )
}

/// Role, name and place of every control.
fn controls(panels: &Panels) -> Vec<(Role, String, Rect)> {
    let nodes = panels.root().children_recursive();
    let controls = nodes.filter(|node| is_control(node.accesskit_node().role()));
    controls
        .map(|node| {
            let name = node.accesskit_node().label().unwrap_or_default();
            (node.accesskit_node().role(), name, node.rect())
        })
        .collect()
}

fn texts(panels: &Panels) -> BTreeSet<String> {
    let nodes = panels.root().children_recursive();
    nodes
        .filter_map(|node| node.accesskit_node().value().or(node.accesskit_node().label()))
        .collect()
}

fn settings(panels: &Panels) -> &BakeSettings {
    &panels.state().panel.settings
}

/// The last edit of the scene that was wished for.
fn edit(panels: &mut Panels) -> Option<Edit> {
    panels.state_mut().wishes.edit.take()
}

#[test]
fn sections_stand_in_one_order_and_open_and_close() {
    let mut panels = open(splats(), SCREENS[0]);
    let top = |panels: &Panels, name: &str| {
        let header = panels.get_by_role_and_label(Role::DisclosureTriangle, name);
        header.rect().top()
    };
    let tops: Vec<f32> = SECTIONS.iter().map(|(name, _)| top(&panels, name)).collect();
    assert!(tops.is_sorted() && tops[0] > 0.0 && tops[6] < 720.0, "{tops:?}");
    for (section, _) in SECTIONS {
        let before = controls(&panels).len();
        click(&mut panels, Role::DisclosureTriangle, section);
        assert_ne!(controls(&panels).len(), before, "{section}");
        click(&mut panels, Role::DisclosureTriangle, section);
        assert_eq!(controls(&panels).len(), before, "{section}");
    }
}

#[test]
fn what_is_used_most_is_in_sight_at_1280_by_720() {
    for screen in &SCREENS[..2] {
        let panels = open(BakeSettings::default(), *screen);
        for (role, name) in [
            (Role::Button, "Re-bake"),
            (Role::Button, "Cancel"),
            (Role::Slider, "Ray density [rays/sr]"),
            (Role::Slider, "Sigma [radii²]"),
            (Role::ComboBox, "Map size [texels]"),
            (Role::Slider, "Exposure [stops]"),
            (Role::ComboBox, "Tone map"),
            (Role::ComboBox, "View"),
            (Role::Button, "Save picture"),
        ] {
            let rect = panels.get_by_role_and_label(role, name).rect();
            assert!(rect.top() > 0.0 && rect.bottom() < 712.0, "{name} at {rect}");
        }
    }
}

#[test]
fn every_control_has_a_name_of_its_own_and_says_what_it_does() {
    for screen in SCREENS {
        let mut panels = opened(splats(), screen);
        // Of the splats' panel all, and what only the wavefront estimator has.
        choose(&mut panels, "Bake until", "max time");
        let found = controls(&panels);
        assert!(found.len() > 80, "{}", found.len());
        let mut seen = BTreeSet::new();
        for (role, name, _) in found {
            assert!(!name.trim().is_empty(), "a {role:?} without a name");
            // A slider and its number share a name.
            assert!(
                seen.insert((format!("{role:?}"), name.clone())),
                "two {role:?} {name:?}"
            );
            panels.hover_at(egui::pos2(690.0, 300.0));
            panels.run_steps(2);
            let before = texts(&panels);
            let rect = reach(&mut panels, role, &name);
            panels.hover_at(rect.center());
            panels.run_steps(4);
            let told: Vec<_> = texts(&panels).difference(&before).cloned().collect();
            assert!(!told.is_empty(), "{role:?} {name:?} says nothing at {rect}");
        }
    }
}

#[test]
fn nothing_is_cut_off_and_nothing_overlaps() {
    for screen in SCREENS {
        let adaptive = BakeSettings {
            sigma: Sigma::Adaptive,
            density_per_sr: 102_400_000.0,
            ..splats()
        };
        for settings in [splats(), adaptive, BakeSettings::default()] {
            let mut panels = opened(settings, screen);
            // With what sets them back beside them.
            let edits = [
                Edit::LightPosition {
                    light: 0,
                    position: DVec3::new(-10.75, -20.125, -30.25),
                },
                Edit::object_at(0, &panels.state().loaded.objects[0].mesh, DVec3::splat(-1.125)),
            ];
            for edit in edits {
                let edited = edit.apply(&panels.state().scene).expect("it can be set").0;
                panels.state_mut().scene = Arc::new(edited);
            }
            choose(&mut panels, "Tone map", "ACES");
            click(&mut panels, Role::RadioButton, "caustic");
            let found = controls(&panels);
            for (role, name, rect) in &found {
                // A field for text shows some of it.
                let least = if *role == Role::TextInput { 60.0 } else { 5.0 };
                assert!(
                    rect.left() >= LEFT && rect.right() <= LEFT + WIDTH && rect.width() > least,
                    "{role:?} {name} at {rect} on {screen:?}"
                );
            }
            let nodes = panels.root().children_recursive();
            for label in nodes.filter(|node| node.accesskit_node().role() == Role::Label) {
                let rect = label.rect();
                assert!(
                    rect.right() <= LEFT + WIDTH + 0.5,
                    "{:?} at {rect}",
                    label.value()
                );
            }
            // What stands above the sections covers what is scrolled under it.
            let is_below = |rect: &Rect| rect.top() > 150.0;
            let below: Vec<_> = found.iter().filter(|(.., rect)| is_below(rect)).collect();
            for (index, (_, a, first)) in below.iter().enumerate() {
                for (_, b, second) in &below[index + 1..] {
                    let common = first.intersect(*second);
                    let is_apart = common.width() < 1.0 || common.height() < 1.0;
                    assert!(is_apart, "{a} at {first} and {b} at {second} on {screen:?}");
                }
            }
        }
    }
}

#[test]
fn the_scene_is_edited_by_names() {
    for screen in SCREENS {
        let mut panels = open(splats(), screen);
        click(&mut panels, Role::DisclosureTriangle, "Scene");
        drag(&mut panels, "Intensity [W/sr]", 0.5, 0.75);
        assert!(matches!(
            edit(&mut panels),
            Some(Edit::LightIntensity { light: 0, .. })
        ));
        type_into(&mut panels, Role::SpinButton, "Radius [m]", "0.25");
        assert!(matches!(
            edit(&mut panels),
            Some(Edit::LightSize { light: 0, .. })
        ));
        for (name, place) in [
            ("Position [m]", "Position [m]: y"),
            ("Position [m]", "Position [m]: z"),
        ] {
            type_into(&mut panels, Role::SpinButton, place, "2.5");
            let Some(Edit::LightPosition { position, .. }) = edit(&mut panels) else {
                panic!("{name}")
            };
            assert!(position.max_element() == 2.5 || position.z == 2.5, "{position}");
        }
        choose(&mut panels, "Light", "sun");
        type_into(&mut panels, Role::SpinButton, "Direction [°]: elevation", "-90");
        assert!(matches!(
            edit(&mut panels),
            Some(Edit::LightDirection { light: 1, .. })
        ));
        choose(&mut panels, "Light", "lamp");
        for light in NewLight::ALL {
            click(&mut panels, Role::Button, &format!("Add {}", light.name()));
            let wish = panels.state_mut().wishes.new_light.take();
            assert_eq!(wish, Some(light));
        }
        click(&mut panels, Role::Button, "Remove light");
        assert_eq!(edit(&mut panels), Some(Edit::LightRemoved { light: 0 }));
        choose(&mut panels, "Object", "ball");
        drag(&mut panels, "Refractive index", 0.25, 0.5);
        assert!(matches!(
            edit(&mut panels),
            Some(Edit::MaterialIor { material: 1, .. })
        ));
        drag(&mut panels, "Roughness", 0.0, 0.5);
        assert!(matches!(edit(&mut panels), Some(Edit::MaterialRoughness { .. })));
        type_into(&mut panels, Role::SpinButton, "Offset [m]", "0.5");
        assert!(edit(&mut panels).is_some_and(|edit| edit.apply(&panels.state().scene).is_ok()));
    }
}

#[test]
fn the_light_pass_is_set_by_names() {
    for screen in SCREENS {
        let mut panels = opened(BakeSettings::default(), screen);
        choose(&mut panels, "Estimator", "splat");
        assert_eq!(settings(&panels).estimator, Estimator::Splat);
        click(&mut panels, Role::CheckBox, "indirect");
        assert_eq!(
            settings(&panels).layers,
            [LayerKind::Caustic, LayerKind::Indirect]
        );
        drag(&mut panels, "Ray density [rays/sr]", 0.4, 0.8);
        assert!(settings(&panels).density_per_sr > 4e5);
        type_into(&mut panels, Role::SpinButton, "Sigma [radii²]", "2.5");
        assert_eq!(settings(&panels).sigma, Sigma::Constant(2.5));
        click(&mut panels, Role::CheckBox, "Adaptive sigma");
        assert_eq!(settings(&panels).sigma, Sigma::Adaptive);
        choose(&mut panels, "Footprint", "fixed");
        choose(&mut panels, "Rays", "jittered");
        choose(&mut panels, "Item buffer", "cube");
        choose(&mut panels, "Kernel", "disc");
        let set = settings(&panels);
        assert_eq!(
            (set.footprint, set.rays, set.item_buffer, set.kernel),
            (
                Footprint::Fixed,
                RayPlacement::Jittered,
                ItemBufferKind::Cube,
                Kernel::Disc
            )
        );
    }
}

#[test]
fn accuracy_is_set_by_names_and_presets_are_told_from_what_is_custom() {
    for screen in SCREENS {
        let mut panels = opened(BakeSettings::default(), screen);
        let preset_shown = |panels: &Panels| {
            let list = panels.get_by_role_and_label(Role::ComboBox, "Preset");
            list.value()
        };
        assert_eq!(
            preset_shown(&panels).as_deref(),
            Some("custom"),
            "a density alone is none"
        );
        for (name, of) in [
            ("draft", Preset::Draft),
            ("final", Preset::Final),
            ("preview", Preset::Preview),
        ] {
            choose(&mut panels, "Preset", name);
            assert_eq!(settings(&panels).max_error, Some(of.max_error()));
            assert_eq!(preset::of(settings(&panels)), Some(of));
            assert_eq!(preset_shown(&panels).as_deref(), Some(name));
        }
        type_into(&mut panels, Role::SpinButton, "Max error [%]", "0.5");
        assert_eq!(settings(&panels).max_error, Some(0.005));
        assert_eq!(preset_shown(&panels).as_deref(), Some("custom"));
        click(&mut panels, Role::Button, "Reset Max error [%]");
        assert_eq!(preset::of(settings(&panels)), Some(Preset::Preview));
        choose(&mut panels, "Map size [texels]", "256");
        assert_eq!(preset::of(settings(&panels)), None);
        choose(&mut panels, "Bake until", "max time");
        drag(&mut panels, "Max time [s]", 0.57, 0.3);
        let time_s = settings(&panels).max_time_s.expect("it ends by time");
        assert!((0.01..2.0).contains(&time_s), "{time_s}");
        type_into(&mut panels, Role::SpinButton, "Max depth", "4");
        drag(&mut panels, "Weakest branch", 0.4, 0.8);
        choose(&mut panels, "Wavefronts", "64");
        let set = settings(&panels);
        assert_eq!((set.max_depth, set.wavefronts), (4, Some(64)));
        assert!(set.branch_threshold.is_some_and(|share| share > 1e-3));
        assert!(set.validate().is_ok());
    }
}

#[test]
fn the_splats_preset_is_a_density() {
    let mut panels = open(splats(), SCREENS[0]);
    choose(&mut panels, "Preset", "final");
    let set = settings(&panels);
    assert_eq!((set.density_per_sr, set.max_error), (800_000.0, None));
    assert_eq!(preset::of(set), Some(Preset::Final));
}

#[test]
fn effects_are_switched_by_names() {
    for screen in SCREENS {
        let mut panels = opened(splats(), screen);
        for effect in Effect::ALL {
            let name = format!("{}: off", effect.name().replace('_', " "));
            click(&mut panels, Role::RadioButton, &name);
            assert_eq!(settings(&panels).effects.get(effect), EffectSwitch::Off, "{name}");
        }
    }
}

#[test]
fn the_display_is_set_by_names() {
    for screen in SCREENS {
        let mut panels = opened(splats(), screen);
        drag(&mut panels, "Exposure [stops]", 0.5, 0.7);
        choose(&mut panels, "Tone map", "ACES");
        choose(&mut panels, "White balance", "temperature");
        drag(&mut panels, "White balance [K]", 0.58, 0.3);
        click(&mut panels, Role::RadioButton, "caustic");
        choose(&mut panels, "View", "error");
        let display = panels.state().panel.display;
        assert!(display.exposure_stops > 1.0);
        assert_eq!(display.tone_map, ToneMap::Aces);
        assert!(matches!(display.white_balance, WhiteBalance::Kelvin(kelvin) if kelvin < 5000.0));
        assert_eq!(display.layer, LayerShown::Only(LayerKind::Caustic));
        assert_eq!(display.quantity, Quantity::Error);
        click(&mut panels, Role::Button, "Auto");
        assert!(panels.state().wishes.measure_exposure);
    }
}

#[test]
fn maps_are_listed_looked_at_and_exported() {
    for screen in SCREENS {
        let mut panels = open(splats(), screen);
        click(&mut panels, Role::DisclosureTriangle, "Maps");
        let told = texts(&panels);
        assert!(told.contains("4 × 2 texels, 448 B, error 2.1 %"), "{told:#?}");
        click(&mut panels, Role::Button, "Export map of floor");
        assert_eq!(panels.state_mut().wishes.export.take(), Some(Export::Map(0)));
        click(&mut panels, Role::Button, "Export all");
        let all = Export::All("nephroid-reference-maps".into());
        let scene = panels.state().scene.name.clone();
        let wish = panels.state_mut().wishes.export.take();
        assert_eq!(
            wish.is_some_and(|wish| wish == all),
            scene == "reference",
            "{scene}"
        );

        click(&mut panels, Role::Button, "Map of floor");
        panels.run_steps(4);
        let canvas = panels.get_by_role_and_label(Role::Image, "Map, large").rect();
        // In the middle of the lower right texel of the whole map: 4 × 2 texels across.
        let texel = canvas.width().min(2.0 * canvas.height()) / 4.0;
        panels.hover_at(canvas.center() + vec2(1.5 * texel, 0.5 * texel));
        panels.run_steps(3);
        let reading = "texel 3, 1: caustic 6.000, direct 3.000 W/m², error ±0.2500";
        assert!(texts(&panels).contains(reading), "{:#?}", texts(&panels));
        // Zoomed in, the texel to its left moves out from under the pointer; dragged, it comes back.
        panels.get_by_role_and_label(Role::Button, "Zoom in").click();
        panels.run_steps(2);
        let texel = 1.5 * texel;
        let place = canvas.center() + vec2(0.5 * texel, 0.5 * texel);
        panels.hover_at(place);
        panels.run_steps(2);
        assert!(texts(&panels).iter().any(|text| text.starts_with("texel 2, 1: ")));
        panels.drag_at(place);
        panels.run_steps(1);
        panels.hover_at(place - vec2(texel, 0.0));
        panels.run_steps(1);
        panels.drop_at(place - vec2(texel, 0.0));
        panels.run_steps(1);
        panels.hover_at(place);
        panels.run_steps(2);
        assert!(texts(&panels).contains(reading), "{:#?}", texts(&panels));
        panels.get_by_role_and_label(Role::Button, "Fit").click();
        panels.run_steps(2);
    }
}

#[test]
fn exports_tell_how_they_got_on() {
    let mut panels = open(splats(), SCREENS[0]);
    click(&mut panels, Role::TextInput, "Maps folder");
    panels.event(egui::Event::Text("elsewhere".into()));
    panels.run_steps(2);
    click(&mut panels, Role::Button, "Export maps");
    let wish = panels.state_mut().wishes.export.take();
    assert_eq!(wish, Some(Export::All("elsewhere".into())));
    click(&mut panels, Role::Button, "Save picture");
    assert!(panels.state().wishes.save_picture);
    let sentence = "elsewhere: the folder holds files; choose another";
    panels.state_mut().export = ExportState::Failed(sentence.into());
    panels.run_steps(2);
    assert!(texts(&panels).contains(sentence));
    panels.state_mut().export = ExportState::Writing;
    panels.run_steps(2);
    click(&mut panels, Role::Button, "Export maps");
    assert_eq!(panels.state().wishes.export, None, "one at a time");
}

#[test]
fn every_value_is_set_back_by_its_own_button_which_is_there_only_then() {
    let mut panels = opened(splats(), SCREENS[0]);
    let resets = |panels: &Panels| -> Vec<String> {
        let names = controls(panels).into_iter().map(|(_, name, _)| name);
        names.filter(|name| name.starts_with("Reset ")).collect()
    };
    // The splat estimator is another than the program begins with; all else is as it begins with that.
    let first = ["Reset Estimator", "Reset Preset"];
    choose(&mut panels, "Preset", "preview");
    assert_eq!(resets(&panels), first[..1], "all is as it was");
    type_into(&mut panels, Role::SpinButton, "Sigma [radii²]", "2.5");
    choose(&mut panels, "Kernel", "gaussian");
    choose(&mut panels, "Footprint", "disc");
    choose(&mut panels, "Map size [texels]", "64");
    choose(&mut panels, "Tone map", "AgX");
    click(&mut panels, Role::CheckBox, "direct");
    let there = [
        "Reset Estimator",
        "Reset Layers",
        "Reset Sigma [radii²]",
        "Reset Footprint",
        "Reset Preset",
        "Reset Map size [texels]",
        "Reset Tone map",
    ];
    let found: BTreeSet<String> = resets(&panels).into_iter().collect();
    assert_eq!(found, there.map(String::from).into());
    for name in there.into_iter().filter(|name| !first.contains(name)) {
        click(&mut panels, Role::Button, name);
    }
    assert_eq!(resets(&panels), first[..1], "the preset is none of its own");
    assert_eq!(*settings(&panels), splats());
}

#[test]
fn the_keyboard_alone_moves_on_and_changes_values() {
    let mut panels = open(splats(), SCREENS[0]);
    panels
        .get_by_role_and_label(Role::Slider, "Sigma [radii²]")
        .focus();
    panels.run_steps(2);
    let Sigma::Constant(before) = settings(&panels).sigma else {
        panic!("it is constant")
    };
    panels.key_press(Key::ArrowRight);
    panels.run_steps(2);
    assert!(matches!(settings(&panels).sigma, Sigma::Constant(now) if now > before));

    panels.get_by_role_and_label(Role::ComboBox, "Estimator").focus();
    panels.run_steps(2);
    panels.key_press(Key::ArrowUp);
    panels.run_steps(2);
    assert_eq!(settings(&panels).estimator, Estimator::Wavefront);
    panels.key_press(Key::ArrowUp);
    panels.run_steps(2);
    assert_eq!(
        settings(&panels).estimator,
        Estimator::Wavefront,
        "the first stays"
    );
    panels.key_press(Key::ArrowDown);
    panels.run_steps(2);
    assert_eq!(settings(&panels).estimator, Estimator::Splat);
    panels.key_press(Key::ArrowUp);
    panels.run_steps(2);
    // From the list to the first layer, which Space switches.
    panels.key_press(Key::Tab);
    panels.run_steps(2);
    assert!(
        panels
            .get_by_role_and_label(Role::CheckBox, "caustic")
            .is_focused()
    );
    panels.key_press(Key::Space);
    panels.run_steps(2);
    assert_eq!(settings(&panels).layers, [LayerKind::Direct]);
}

#[test]
fn what_was_changed_is_handed_on_with_what_it_was() {
    let mut panels = open(splats(), SCREENS[0]);
    assert!(panels.state().wishes.changed.is_none(), "looking is no change");
    drag(&mut panels, "Sigma [radii²]", 0.5, 0.75);
    let (before, _) = *panels.state_mut().wishes.changed.take().expect("it was changed");
    assert_eq!(before, splats());
    assert_eq!(settings(&panels).map_resolution, MapResolution::Auto);
    click(&mut panels, Role::Button, "Undo (Ctrl+Z)");
    click(&mut panels, Role::Button, "Redo (Ctrl+Y)");
    assert!(panels.state().wishes.undo && panels.state().wishes.redo);
}
