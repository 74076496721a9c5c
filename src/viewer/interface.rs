//! Connects egui to the window: events in, triangles out.

use std::time::Duration;

use egui::accesskit::{Node, NodeId, Role, TreeUpdate};
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::Window;

use crate::gpu::{Gpu, cleared};

/// egui's state for one window, and its renderer.
pub struct Interface {
    pub context: egui::Context,
    state: egui_winit::State,
    /// Draws egui's triangles and owns its textures.
    pub renderer: egui_wgpu::Renderer,
    /// Last rectangles of the controls; `None` unless requested.
    controls: Option<Vec<Control>>,
}

/// Output of one egui pass, to be painted once.
pub struct Painting {
    primitives: Vec<egui::ClippedPrimitive>,
    textures: egui::TexturesDelta,
    pixels_per_point: f32,
    /// When egui wants another pass; zero means at once.
    pub repaint_after: Duration,
    /// Rectangles of the controls, if requested and changed.
    pub moved_controls: Option<Vec<Control>>,
}

impl Interface {
    /// Must be called before the window is first shown, as accessibility requires.
    pub fn new<T: From<accessibility::Event> + Send>(
        event_loop: &ActiveEventLoop,
        window: &Window,
        proxy: EventLoopProxy<T>,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
    ) -> Self {
        let context = egui::Context::default();
        super::panel::set_style(&context);
        let mut state = egui_winit::State::new(
            context.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(device.limits().max_texture_dimension_2d as usize),
        );
        accessibility::connect(&mut state, event_loop, window, proxy);
        let renderer = egui_wgpu::Renderer::new(device, format, egui_wgpu::RendererOptions::default());
        Self {
            context,
            state,
            renderer,
            controls: None,
        }
    }

    /// Reports the rectangles of the controls from now on.
    pub fn watch_controls(&mut self) {
        self.context.enable_accesskit();
        self.controls = Some(Vec::new());
    }

    /// Passes an event to egui; returns whether a redraw is needed.
    pub fn on_event(&mut self, window: &Window, event: &WindowEvent) -> bool {
        self.state.on_window_event(window, event).repaint
    }

    /// Handles a request of a screen reader.
    pub fn on_accessibility(&mut self, event: accessibility::Event) {
        accessibility::answer(event, &mut self.state, &self.context, self.controls.is_some());
    }

    /// Runs one egui pass.
    pub fn run(&mut self, window: &Window, show: impl FnMut(&mut egui::Ui)) -> Painting {
        let input = self.state.take_egui_input(window);
        let output = self.context.run_ui(input, show);
        let moved_controls = self.moved_controls(&output);
        self.state.handle_platform_output(window, output.platform_output);
        let repaint_after = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        Painting {
            primitives: self.context.tessellate(output.shapes, output.pixels_per_point),
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
            repaint_after,
            moved_controls,
        }
    }

    fn moved_controls(&mut self, output: &egui::FullOutput) -> Option<Vec<Control>> {
        let known = self.controls.as_mut()?;
        let update = output.platform_output.accesskit_update.as_ref()?;
        let found = of(update, f64::from(output.pixels_per_point));
        if *known == found {
            return None;
        }
        known.clone_from(&found);
        Some(found)
    }

    /// Paints over the whole of a target, given with its size [pixels]. Must be called for every painting, even if
    /// there is no target: egui sends textures only once.
    pub fn paint(
        &mut self,
        gpu: &Gpu,
        painting: &mut Painting,
        target: Option<(wgpu::TextureView, [u32; 2])>,
    ) {
        // New textures are uploaded before the draw that reads them, old ones are freed after it.
        for (id, deltas) in painting.textures.set.drain() {
            for delta in &deltas {
                self.renderer.update_texture(&gpu.device, &gpu.queue, id, delta);
            }
        }

        // Buffers are filled by commands that are submitted before the pass.
        if let Some((target, size_in_pixels)) = target {
            let descriptor = egui_wgpu::ScreenDescriptor {
                size_in_pixels,
                pixels_per_point: painting.pixels_per_point,
            };
            let (renderer, primitives) = (&mut self.renderer, &painting.primitives);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let before =
                renderer.update_buffers(&gpu.device, &gpu.queue, &mut encoder, primitives, &descriptor);
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("interface"),
                color_attachments: &[Some(cleared(&target, wgpu::Color::BLACK))],
                ..Default::default()
            });
            renderer.render(&mut pass.forget_lifetime(), primitives, &descriptor);
            gpu.queue.submit(before.into_iter().chain([encoder.finish()]));
        }

        for id in painting.textures.free.drain() {
            self.renderer.free_texture(&id);
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    /// AccessKit's name of the role.
    pub role: String,
    /// Its own label, else that of the label in front of it, else its value.
    pub name: String,
    /// Left, top, right and bottom in the window [pixels].
    pub rect: [f64; 4],
}

/// The controls in an update of the accessibility tree, from top to bottom.
pub fn of(update: &TreeUpdate, pixels_per_point: f64) -> Vec<Control> {
    let name_of = |id: &NodeId| {
        let node = update.nodes.iter().find(|(candidate, _)| candidate == id);
        node.and_then(|(_, node)| node.label().or(node.value()).map(str::to_owned))
    };
    let control = |node: &Node| {
        let bounds = node.bounds().filter(|_| is_control(node.role()))?;
        let label = || node.labelled_by().iter().find_map(name_of);
        let value = || node.value().map(str::to_owned);
        let name = node.label().map(str::to_owned).or_else(label).or_else(value)?;
        Some(Control {
            role: format!("{:?}", node.role()),
            name,
            rect: [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(|at| at * pixels_per_point),
        })
    };
    let mut found: Vec<Control> = update
        .nodes
        .iter()
        .filter_map(|(_, node)| control(node))
        .collect();
    found.sort_by(|a, b| a.rect[1].total_cmp(&b.rect[1]));
    found
}

fn is_control(role: Role) -> bool {
    matches!(
        role,
        Role::Button
            | Role::CheckBox
            | Role::ComboBox
            | Role::DisclosureTriangle
            | Role::RadioButton
            | Role::Slider
            | Role::SpinButton
            | Role::TextInput
            | Role::Tab
    )
}

/// Screen readers. On Linux they need the feature `accessibility`.
#[cfg(any(feature = "accessibility", not(target_os = "linux")))]
pub mod accessibility {
    use egui_winit::accesskit_winit;
    pub use egui_winit::accesskit_winit::Event;
    use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
    use winit::window::Window;

    /// Connects a window to the system's accessibility interface. Must be called before the window is first shown.
    pub fn connect<T: From<Event> + Send>(
        state: &mut egui_winit::State,
        event_loop: &ActiveEventLoop,
        window: &Window,
        proxy: EventLoopProxy<T>,
    ) {
        state.init_accesskit(event_loop, window, proxy);
    }

    /// Handles a request of a screen reader. `keep_tree`: something else reads the widget tree too.
    pub fn answer(event: Event, state: &mut egui_winit::State, context: &egui::Context, keep_tree: bool) {
        match event.window_event {
            accesskit_winit::WindowEvent::InitialTreeRequested => context.enable_accesskit(),
            accesskit_winit::WindowEvent::ActionRequested(request) => {
                state.on_accesskit_action_request(request)
            }
            accesskit_winit::WindowEvent::AccessibilityDeactivated if !keep_tree => {
                context.disable_accesskit()
            }
            accesskit_winit::WindowEvent::AccessibilityDeactivated => {}
        }
    }
}

#[cfg(not(any(feature = "accessibility", not(target_os = "linux"))))]
pub mod accessibility {
    use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
    use winit::window::Window;

    /// Never occurs in this build.
    #[derive(Debug)]
    pub enum Event {}

    pub fn connect<T: From<Event> + Send>(
        _: &mut egui_winit::State,
        _: &ActiveEventLoop,
        _: &Window,
        _: EventLoopProxy<T>,
    ) {
    }

    pub fn answer(event: Event, _: &mut egui_winit::State, _: &egui::Context, _: bool) {
        match event {}
    }
}
