//! The panel without a window: pointer events in, accessibility nodes out.

use std::sync::Arc;

use egui::accesskit::{Node, NodeId, Role};
use egui::{Event, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use nephroid::illumination::IlluminationMap;
use nephroid::plan::EffectPlan;
use nephroid::scene::Scene;
use nephroid::session::{BakeCounts, BakeResult, EffectReport, StopReason, Timings};
use nephroid::settings::{BakeSettings, LayerKind};
use nephroid::viewer::beside::Reference;
use nephroid::viewer::exporting::ExportState;
use nephroid::viewer::files::FileFacts;
use nephroid::viewer::frame_times::FrameTimes;
use nephroid::viewer::latency::Latencies;
use nephroid::viewer::navigation::Travel;
use nephroid::viewer::panel::{Facts, Panel, WIDTH, Wishes};
use nephroid::viewer::probe::Probed;
use nephroid::viewer::views::MapSurvey;
use nephroid::viewer::worker::{BakeRequest, BakeState, BakedLevel, Worth};

pub struct Headless {
    context: egui::Context,
    pub panel: Panel,
    pub scene: Arc<Scene>,
    pub loaded: Arc<Scene>,
    pub undo: Option<String>,
    pub redo: Option<String>,
    pub refusal: Option<String>,
    pub state: BakeState,
    pub last: Option<BakedLevel>,
    pub maps: Vec<IlluminationMap>,
    pub export: ExportState,
    pub layers: Vec<LayerKind>,
    pub survey: MapSurvey,
    pub probed: Option<Probed>,
    pub reference: Option<Reference>,
    pub has_errors: bool,
    pub worth: Option<Worth>,
    pub chains: Option<EffectReport>,
    pub frame_times: Option<FrameTimes>,
    pub latencies: Latencies,
    pub loading: Option<String>,
    pub lost_device: bool,
    pub file_refusal: Option<String>,
    /// What was pressed since the start.
    pub wishes: Wishes,
    size: egui::Vec2,
    time_s: f64,
    nodes: Vec<(NodeId, Node)>,
    focus: NodeId,
}

/// A bake that found nothing to do.
pub fn finished(scene: &Arc<Scene>, settings: &BakeSettings) -> BakedLevel {
    BakedLevel {
        serial: 1,
        request: BakeRequest {
            scene: Arc::clone(scene),
            settings: settings.clone(),
        },
        level: 1,
        is_final: true,
        result: BakeResult {
            light_layers: Vec::new(),
            band_layers: Vec::new(),
            maps: Vec::new(),
            plan: EffectPlan::default(),
            effects: Vec::new(),
            course: Vec::new(),
            forecast: None,
            item_buffers: Vec::new(),
            ledgers: Vec::new(),
            counts: BakeCounts::default(),
            timings_s: Timings::default(),
            cpu_s: Timings::default(),
            estimated_relative_rmse: None,
            stop_reason: StopReason::NothingToDo,
            partial: false,
            warnings: Vec::new(),
        },
        seconds: 0.0,
    }
}

impl Headless {
    pub fn new(settings: BakeSettings, size: (f32, f32)) -> Self {
        let scene = Scene {
            name: "test".into(),
            ..Scene::default()
        };
        Self::with_scene(scene, settings, size)
    }

    pub fn with_scene(scene: Scene, settings: BakeSettings, size: (f32, f32)) -> Self {
        let scene = Arc::new(scene);
        let context = egui::Context::default();
        context.enable_accesskit();
        // As in the window: no fade that a test would have to wait for.
        nephroid::viewer::panel::set_style(&context);
        let mut headless = Self {
            context,
            panel: Panel::new(settings),
            loaded: Arc::clone(&scene),
            scene,
            undo: None,
            redo: None,
            refusal: None,
            state: BakeState::Idle,
            last: None,
            maps: Vec::new(),
            export: ExportState::Idle,
            layers: vec![LayerKind::Caustic, LayerKind::Direct],
            survey: MapSurvey::default(),
            probed: None,
            reference: None,
            has_errors: false,
            worth: None,
            chains: None,
            frame_times: None,
            latencies: Latencies::default(),
            wishes: Wishes::default(),
            loading: None,
            lost_device: false,
            file_refusal: None,
            size: vec2(size.0, size.1),
            time_s: 0.0,
            nodes: Vec::new(),
            focus: NodeId(0),
        };
        headless.settle();
        headless
    }

    pub fn pass(&mut self, events: Vec<Event>) {
        self.time_s += 0.1;
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            time: Some(self.time_s),
            focused: true,
            events,
            ..RawInput::default()
        };
        let Self {
            context,
            panel,
            scene,
            loaded,
            undo,
            redo,
            refusal,
            state,
            last,
            maps,
            export,
            layers,
            survey,
            probed,
            reference,
            has_errors,
            worth,
            chains,
            frame_times,
            latencies,
            loading,
            lost_device,
            file_refusal,
            wishes,
            ..
        } = self;
        let facts = Facts {
            scene,
            state,
            last: last.as_ref(),
            loaded,
            undo: undo.as_deref(),
            redo: redo.as_deref(),
            refusal: refusal.as_deref(),
            maps,
            export,
            layers,
            survey,
            probed: probed.as_ref(),
            sketch: None,
            reference: reference.as_ref(),
            is_playing: false,
            film_told: None,
            has_errors: *has_errors,
            worth: worth.as_ref(),
            chains: chains.as_ref(),
            frame_times: frame_times.as_ref(),
            latencies,
            travel: Travel::Fly,
            speed_m_per_s: 1.0,
            lost_device: *lost_device,
            files: FileFacts {
                loading: loading.as_deref(),
                refusal: file_refusal.as_deref(),
                ..FileFacts::default()
            },
            adapter: "no adapter",
        };
        let mut output = context.run_ui(input, |ui| {
            *wishes = std::mem::take(wishes).and(panel.show(ui, &facts));
        });
        output.textures_delta.clear();
        if let Some(update) = output.platform_output.accesskit_update {
            self.nodes = update.nodes;
            self.focus = update.focus;
        }
    }

    /// Lets layout and animations come to rest.
    pub fn settle(&mut self) {
        for _ in 0..10 {
            self.pass(Vec::new());
        }
    }

    fn node(&self, id: NodeId) -> &Node {
        &self
            .nodes
            .iter()
            .find(|(candidate, _)| *candidate == id)
            .expect("the node is in the tree")
            .1
    }

    pub fn rect_of(node: &Node) -> Rect {
        let bounds = node.bounds().expect("it has bounds");
        Rect::from_min_max(
            pos2(bounds.x0 as f32, bounds.y0 as f32),
            pos2(bounds.x1 as f32, bounds.y1 as f32),
        )
    }

    /// Every text in the panel, values of controls included.
    pub fn texts(&self) -> Vec<String> {
        let text = |node: &Node| node.value().or(node.label()).map(str::to_owned);
        self.nodes.iter().filter_map(|(_, node)| text(node)).collect()
    }

    pub fn says(&self, part: &str) -> bool {
        self.texts().iter().any(|text| text.contains(part))
    }

    /// The first node of a role whose own text is `name`.
    pub fn named(&self, role: Role, name: &str) -> &Node {
        let has_name = |node: &Node| node.value() == Some(name) || node.label() == Some(name);
        let mut found = self
            .nodes
            .iter()
            .filter(|(_, node)| node.role() == role && has_name(node));
        let node = found.next();
        &node
            .unwrap_or_else(|| panic!("no {role:?} {name:?} in {:#?}", self.texts()))
            .1
    }

    /// The control of a role that a label in front of it names.
    pub fn labelled(&self, role: Role, label: &str) -> &Node {
        let names_it = |node: &Node| {
            node.labelled_by().iter().any(|id| {
                let by = self.node(*id);
                by.value() == Some(label) || by.label() == Some(label)
            })
        };
        let found = self
            .nodes
            .iter()
            .find(|(_, node)| node.role() == role && names_it(node));
        &found
            .unwrap_or_else(|| panic!("no {role:?} labelled {label:?} in {:#?}", self.nodes))
            .1
    }

    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        self.nodes.iter().map(|(_, node)| node)
    }

    pub fn move_to(&mut self, position: Pos2) {
        self.pass(vec![Event::PointerMoved(position)]);
    }

    /// Rests the pointer there until a hover text shows.
    pub fn hover(&mut self, position: Pos2) {
        self.move_to(position);
        self.settle();
    }

    fn press(&mut self, position: Pos2, pressed: bool) {
        let modifiers = egui::Modifiers::default();
        self.pass(vec![Event::PointerButton {
            pos: position,
            button: PointerButton::Primary,
            pressed,
            modifiers,
        }]);
    }

    pub fn click(&mut self, position: Pos2) {
        self.move_to(position);
        self.press(position, true);
        self.press(position, false);
        self.settle();
    }

    pub fn drag(&mut self, from: Pos2, to: Pos2) {
        self.move_to(from);
        self.press(from, true);
        for step in 1..=5 {
            self.move_to(from + (to - from) * (step as f32 / 5.0));
        }
        self.press(to, false);
        self.settle();
    }

    /// Types over what a field has selected, and confirms.
    pub fn type_text(&mut self, text: &str) {
        self.pass(vec![Event::Text(text.into())]);
        self.strike(egui::Key::Enter);
        self.settle();
    }

    /// Presses a key and lets it go.
    pub fn strike(&mut self, key: egui::Key) {
        for pressed in [true, false] {
            self.pass(vec![Event::Key {
                key,
                physical_key: None,
                pressed,
                repeat: false,
                modifiers: egui::Modifiers::default(),
            }]);
        }
    }

    /// The name of what the keyboard is at.
    pub fn focused(&self) -> Option<&str> {
        let focus = self.nodes.iter().find(|(id, _)| *id == self.focus);
        focus.and_then(|(_, node)| node.label().or(node.value()))
    }

    /// Whether a rectangle is wholly within the panel.
    pub fn is_inside(&self, rect: Rect) -> bool {
        Rect::from_min_size(Pos2::ZERO, vec2(WIDTH, self.size.y)).contains_rect(rect)
    }
}
