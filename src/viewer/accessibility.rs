//! Screen readers, where this build has them: on Linux by the feature `accessibility`, elsewhere always.

#[cfg(any(feature = "accessibility", not(target_os = "linux")))]
mod reader {
    use egui_winit::accesskit_winit;
    pub use egui_winit::accesskit_winit::Event;
    use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
    use winit::window::Window;

    /// Connects a window that was never shown: the system has to be told before.
    pub fn connect<T: From<Event> + Send>(
        state: &mut egui_winit::State,
        event_loop: &ActiveEventLoop,
        window: &Window,
        proxy: EventLoopProxy<T>,
    ) {
        state.init_accesskit(event_loop, window, proxy);
    }

    /// Answers a screen reader; `keep_tree` where others read the tree of widgets too.
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
mod reader {
    use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
    use winit::window::Window;

    /// Never happens in this build.
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

pub use reader::{Event, answer, connect};
