//! The panel without a window, used by its accessible names.

use std::collections::BTreeSet;
use std::ops::{Deref, DerefMut};

use egui::accesskit::Role;
use egui::{Event, Key, Pos2, Rect, Vec2, vec2};
use egui_kittest::kittest::NodeT as _;
use egui_kittest::{Harness, Node};
use nephroid::bake::{BakeCounts, StopReason, Timings};
use nephroid::plan::EffectPlan;
use nephroid::viewer::ViewerOptions;
use nephroid::viewer::command::Command;
use nephroid::viewer::model::Model;
use nephroid::viewer::panel::{Panel, WIDTH, set_style};
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel};

use super::fixtures;

use support::prelude::*;

/// Left of the panel [points]: the harness leaves a margin.
pub const LEFT: f32 = 8.0;
/// A window as the program opens it [points], and pixels per point.
pub const SCREEN: ((f32, f32), f32) = ((1280.0, 720.0), 1.0);

/// The panel of a window that bakes nothing.
pub struct Desk {
    pub panel: Panel,
    pub model: Model,
    /// What was asked for, but for what is set at once.
    asked: Vec<Command>,
}

impl Desk {
    fn new(scene: Scene, settings: BakeSettings) -> Self {
        let model = fixtures::model(&ViewerOptions {
            scene: Arc::new(scene),
            settings,
            maps: Some(vec![lit()]),
            ..fixtures::options("ring")
        });
        Self {
            panel: Panel::default(),
            model,
            asked: Vec::new(),
        }
    }

    fn show(&mut self, ui: &mut egui::Ui) {
        for command in self.panel.show(ui, &self.model) {
            match command {
                Command::Choose(_) => drop(self.model.apply(command)),
                Command::Release => {}
                _ => self.asked.push(command),
            }
        }
    }

    /// What was asked for since this was called last.
    pub fn asked(&mut self) -> Vec<Command> {
        std::mem::take(&mut self.asked)
    }
}

/// A map whose error nobody knows.
fn lit() -> IlluminationMap {
    IlluminationMap {
        error: None,
        ..fixtures::map()
    }
}

/// What a bake that found nothing to do returns.
pub fn nothing() -> Bake {
    Bake {
        light_layers: Vec::new(),
        band_layers: Vec::new(),
        maps: Vec::new(),
        plan: EffectPlan::default(),
        course: Vec::new(),
        forecast: None,
        item_buffers: Vec::new(),
        ledgers: Vec::new(),
        counts: BakeCounts::default(),
        timings_s: Timings::default(),
        cpu_s: Timings::default(),
        estimated_relative_rmse: None,
        estimated_visible: None,
        stop_reason: StopReason::NothingToDo,
        partial: false,
        warnings: Vec::new(),
    }
}

/// The last level of such a bake.
pub fn finished(scene: &Arc<Scene>, settings: &BakeSettings) -> BakedLevel {
    BakedLevel {
        serial: 1,
        request: BakeRequest {
            scene: Arc::clone(scene),
            settings: settings.clone(),
        },
        level: 1,
        is_final: true,
        result: nothing(),
        seconds: 0.0,
    }
}

/// What is done to a control, by its name.
#[derive(Clone, Copy, Debug)]
pub enum Gesture {
    Press(&'static str),
    Check(&'static str),
    Radio(&'static str),
    /// A list, and the entry to choose.
    Choose(&'static str, &'static str),
    /// A field, and the text to type over what is in it.
    Type(&'static str, &'static str),
    /// A slider, from one share of its length to another.
    Drag(&'static str, f32, f32),
}

pub struct Headless(Harness<'static, Desk>);

impl Deref for Headless {
    type Target = Desk;

    fn deref(&self) -> &Desk {
        self.0.state()
    }
}

impl DerefMut for Headless {
    fn deref_mut(&mut self) -> &mut Desk {
        self.0.state_mut()
    }
}

impl Headless {
    /// An empty scene, in a window in which everything has room.
    pub fn new(settings: BakeSettings) -> Self {
        Self::with_scene(Scene::default(), settings, ((1280.0, 1800.0), 1.0))
    }

    pub fn with_scene(
        scene: Scene,
        settings: BakeSettings,
        (size, pixels_per_point): ((f32, f32), f32),
    ) -> Self {
        let harness = Harness::builder()
            .with_size(Vec2::from(size))
            .with_pixels_per_point(pixels_per_point)
            .with_context_setup(set_style)
            .build_ui_state(|ui, desk: &mut Desk| desk.show(ui), Desk::new(scene, settings));
        let mut headless = Self(harness);
        headless.settle();
        headless
    }

    /// Lets the layout come to rest.
    pub fn settle(&mut self) {
        self.0.run_steps(3);
    }

    pub fn settings(&self) -> &BakeSettings {
        &self.model.choices.settings
    }

    /// The last edit that was asked for.
    pub fn edit(&mut self) -> Option<Edit> {
        let edit = |command| match command {
            Command::Edit(edit) => Some(edit),
            _ => None,
        };
        self.asked().into_iter().rev().find_map(edit)
    }

    /// Makes that edit of the scene, as the window does.
    pub fn apply(&mut self) -> Arc<Scene> {
        let edit = self.edit().expect("an edit was asked for");
        self.tell(|model| drop(model.apply(Command::Edit(edit))));
        assert_eq!(self.model.refusal, None);
        Arc::clone(self.model.scene())
    }

    /// Something is new.
    pub fn tell(&mut self, set: impl FnOnce(&mut Model)) {
        set(&mut self.model);
        self.settle();
    }

    /// A bake of the panel's settings has ended with this.
    pub fn tell_level(&mut self, set: impl FnOnce(&mut BakedLevel)) {
        let mut last = finished(self.model.scene(), self.settings());
        last.result.maps = vec![lit()];
        set(&mut last);
        self.tell(|model| {
            model.last = Some(Arc::new(last));
            model.state = BakeState::Done;
        });
    }

    pub fn nodes(&self) -> impl Iterator<Item = Node<'_>> {
        self.0.root().children_recursive()
    }

    /// The first node of a role that `is_it` says yes to, given its name.
    pub fn find(&self, role: Role, is_it: impl Fn(&str) -> bool) -> Option<Node<'_>> {
        self.nodes().find(|node| {
            let node = node.accesskit_node();
            let has_name = |name: Option<String>| name.is_some_and(|name| is_it(&name));
            node.role() == role && (has_name(node.label()) || has_name(node.value()))
        })
    }

    pub fn named(&self, role: Role, name: &str) -> Node<'_> {
        let found = self.find(role, |text| text == name);
        found.unwrap_or_else(|| panic!("no {role:?} {name:?} in {:#?}", self.texts()))
    }

    pub fn is_disabled(&self, role: Role, name: &str) -> bool {
        self.named(role, name).accesskit_node().is_disabled()
    }

    /// Every text, values of controls included.
    pub fn texts(&self) -> BTreeSet<String> {
        let nodes = self.nodes().map(|node| node.accesskit_node());
        nodes.filter_map(|node| node.value().or(node.label())).collect()
    }

    pub fn says(&self, part: &str) -> bool {
        self.texts().iter().any(|text| text.contains(part))
    }

    #[track_caller]
    pub fn assert_says(&self, parts: &[&str]) {
        for part in parts {
            assert!(self.says(part), "{part:?} is not in {:#?}", self.texts());
        }
    }

    /// Brings a control into the window; where it is then.
    pub fn reach(&mut self, role: Role, name: &str) -> Rect {
        self.named(role, name).scroll_to_me();
        self.settle();
        self.named(role, name).rect()
    }

    pub fn click(&mut self, role: Role, name: &str) {
        let centre = self.reach(role, name).center();
        self.click_at(centre);
    }

    pub fn click_at(&mut self, position: Pos2) {
        self.0.hover_at(position);
        self.0.drag_at(position);
        self.0.drop_at(position);
        self.settle();
    }

    pub fn open(&mut self, section: &str) {
        self.click(Role::DisclosureTriangle, section);
    }

    /// A part whose title goes on.
    pub fn open_part(&mut self, title: &str) {
        let part = self.find(Role::DisclosureTriangle, |name| name.starts_with(title));
        let centre = part.expect("there is such a part").rect().center();
        self.click_at(centre);
    }

    pub fn press(&mut self, button: &str) {
        self.click(Role::Button, button);
    }

    pub fn choose(&mut self, list: &str, entry: &str) {
        self.click(Role::ComboBox, list);
        let centre = self.named(Role::Button, entry).rect().center();
        self.click_at(centre);
    }

    /// Types over what a field holds, and confirms.
    pub fn type_into(&mut self, field: &str, text: &str) {
        self.click(Role::SpinButton, field);
        self.type_text(text);
    }

    pub fn type_text(&mut self, text: &str) {
        self.0.event(Event::Text(text.into()));
        self.strike(Key::Enter);
    }

    pub fn strike(&mut self, key: Key) {
        self.0.key_press(key);
        self.0.run_steps(2);
    }

    pub fn focus(&mut self, role: Role, name: &str) {
        self.named(role, name).focus();
        self.0.run_steps(2);
    }

    pub fn drag(&mut self, slider: &str, from: f32, to: f32) {
        let rect = self.reach(Role::Slider, slider);
        let at = |share: f32| rect.left_center() + vec2(4.0 + 100.0 * share, 0.0);
        self.drag_at(at(from), at(to));
    }

    pub fn drag_at(&mut self, from: Pos2, to: Pos2) {
        self.move_to(from);
        self.0.drag_at(from);
        self.0.run_steps(1);
        self.move_to(from.lerp(to, 0.5));
        self.move_to(to);
        self.0.drop_at(to);
        self.settle();
    }

    pub fn move_to(&mut self, position: Pos2) {
        self.0.hover_at(position);
        self.0.run_steps(1);
    }

    /// Rests the pointer there until a hover text shows.
    pub fn hover(&mut self, role: Role, name: &str) {
        let centre = self.reach(role, name).center();
        self.move_to(centre);
        self.settle();
    }

    pub fn make(&mut self, gesture: Gesture) {
        match gesture {
            Gesture::Press(name) => self.press(name),
            Gesture::Check(name) => self.click(Role::CheckBox, name),
            Gesture::Radio(name) => self.click(Role::RadioButton, name),
            Gesture::Choose(list, entry) => self.choose(list, entry),
            Gesture::Type(field, text) => self.type_into(field, text),
            Gesture::Drag(slider, from, to) => self.drag(slider, from, to),
        }
    }

    /// Role, name and place of every control.
    pub fn controls(&self) -> Vec<(Role, String, Rect)> {
        let control = |node: Node<'_>| {
            let role = node.accesskit_node().role();
            let name = node.accesskit_node().label().unwrap_or_default();
            is_control(role).then(|| (role, name, node.rect()))
        };
        self.nodes().filter_map(control).collect()
    }

    /// Whether a rectangle is within the panel's width.
    pub fn is_inside(rect: Rect) -> bool {
        rect.left() >= LEFT && rect.right() <= LEFT + WIDTH + 0.5
    }
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

/// Sections in their order, with what they hold in parts of their own.
pub const SECTIONS: [(&str, &[&str]); 10] = [
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

/// Changes the power of the first light three times, and takes the last back: it is as it was, with something to undo and
/// to redo.
pub fn edit_power(model: &mut Model) {
    let strength = model.scene().lights[0].kind.strength();
    for times in [2.0, 1.0, 3.0] {
        let edit = fixtures::intensity(0, times * strength);
        for command in [Command::Edit(edit), Command::Release] {
            model.apply(command);
        }
    }
    model.apply(Command::Undo);
}

/// Settings of the splat estimator: they grey no control.
pub fn splats() -> BakeSettings {
    BakeSettings {
        layers: vec![LayerKind::Caustic, LayerKind::Direct],
        ..BakeSettings::splat()
    }
}

impl Headless {
    /// After a bake of [`fixtures::scene`], with something to undo and to redo.
    pub fn baked(settings: BakeSettings, screen: ((f32, f32), f32)) -> Self {
        let mut panel = Self::with_scene(fixtures::scene(), settings, screen);
        panel.tell(edit_power);
        panel.tell_level(|last| last.result.maps = vec![fixtures::map()]);
        panel
    }

    /// The same, with every section open.
    pub fn opened(settings: BakeSettings, screen: ((f32, f32), f32)) -> Self {
        let mut panel = Self::baked(settings, screen);
        for (section, parts) in SECTIONS {
            // The others are open from the start.
            if !["Light pass", "Accuracy", "Display", "Export"].contains(&section) {
                panel.open(section);
            }
            parts.iter().for_each(|part| panel.open(part));
        }
        panel
    }

    /// Every control has a name, and no two of a kind the same.
    pub fn assert_names(&self) {
        let mut seen = BTreeSet::new();
        for (role, name, _) in self.controls() {
            assert!(!name.trim().is_empty(), "a {role:?} without a name");
            // A slider and its number share a name.
            let is_new = seen.insert((format!("{role:?}"), name.clone()));
            assert!(is_new, "two {role:?} {name:?}");
        }
        assert!(seen.len() > 80, "{}", seen.len());
    }

    /// Controls and labels lie within the panel, and no control on another.
    pub fn assert_layout(&self) {
        let found = self.controls();
        for (role, name, rect) in &found {
            // A field for text shows some of it.
            let least = if *role == Role::TextInput { 60.0 } else { 5.0 };
            let fits = Self::is_inside(*rect) && rect.width() > least;
            assert!(fits, "{role:?} {name} at {rect}");
        }
        let is_label = |node: &Node<'_>| node.accesskit_node().role() == Role::Label;
        for label in self.nodes().filter(is_label) {
            assert!(
                Self::is_inside(label.rect()),
                "{:?} at {}",
                label.value(),
                label.rect()
            );
        }
        // What stands above the sections covers what is scrolled under it.
        let below: Vec<_> = found.iter().filter(|(.., rect)| rect.top() > 150.0).collect();
        for (index, (_, a, first)) in below.iter().enumerate() {
            for (_, b, second) in &below[index + 1..] {
                let common = first.intersect(*second);
                let are_apart = common.width() < 1.0 || common.height() < 1.0;
                assert!(are_apart, "{a} at {first} and {b} at {second}");
            }
        }
    }
}
