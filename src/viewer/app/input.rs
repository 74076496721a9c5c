//! Keyboard and mouse input.

use serde_json::json;
use winit::dpi::PhysicalPosition;
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta};
use winit::keyboard::{Key, KeyCode, NamedKey, PhysicalKey};
use winit::window::CursorGrabMode;

use super::{App, PIXELS_PER_NOTCH};
use crate::geometry::Ray;
use crate::scene::Camera;
use crate::viewer::command::{Command, FilmCommand, PlayCommand};
use crate::viewer::gizmo::{self, GizmoTarget};
use crate::viewer::lens::Viewport;
use crate::viewer::navigation::{BOOKMARKS, HeldKeys, NavigationMode};

/// A press that moves farther than this is a drag, not a click [pixels].
const CLICK_PIXELS: f64 = 4.0;

/// Explains a navigation mode when it was chosen.
fn travel_notice(travel: NavigationMode) -> String {
    match travel {
        NavigationMode::Fly => "Flying: W A S D E Q, through walls too.",
        NavigationMode::Walk => "Walking: W A S D, eyes 1.6 m above the ground, stopped by walls.",
        NavigationMode::Orbit => {
            "Orbiting what is straight ahead: drag with the right mouse button, wheel for nearer and farther."
        }
    }
    .to_owned()
}

impl App {
    pub(super) fn on_key(&mut self, event: &KeyEvent) {
        let is_typing = self
            .graphics
            .as_mut()
            .is_some_and(|graphics| graphics.interface.context.text_edit_focused());
        if is_typing && event.state.is_pressed() {
            return;
        }
        self.fly();
        let is_chord = self.modifiers.control_key() || self.modifiers.super_key();
        if is_chord && event.state.is_pressed() {
            // Shortcuts with Ctrl do not also move the camera or start a bake.
            return self.on_chord(&event.logical_key);
        }
        if let PhysicalKey::Code(code) = event.physical_key
            && hold(&mut self.model.navigator.keys, code, event.state)
        {
            return;
        }
        if event.state.is_pressed() && !event.repeat {
            self.notice = None;
            match &event.logical_key {
                Key::Named(NamedKey::Escape) => self.let_go(),
                Key::Named(NamedKey::F12) => self.pressed.push(Command::SavePicture),
                Key::Character(letter) => self.on_letter(&letter.to_lowercase()),
                _ => {}
            }
        }
    }

    /// Handles a key pressed together with Ctrl.
    fn on_chord(&mut self, key: &Key) {
        match key {
            // Ctrl alone slows the motion of the keys held before.
            Key::Named(NamedKey::Control) => self.model.navigator.keys.creep = true,
            Key::Character(letter) => match letter.to_lowercase().as_str() {
                "z" if !self.modifiers.shift_key() => self.pressed.push(Command::Undo),
                "z" | "y" => self.pressed.push(Command::Redo),
                digit => {
                    let Some(number) = bookmark(digit) else { return };
                    self.model.navigator.set_bookmark(number);
                    let more = json!({"number": number + 1, "kept": true});
                    self.model.log.write("bookmark", more);
                    self.notice = Some(format!("View kept as {}: press {0} to come back.", number + 1));
                }
            },
            _ => {}
        }
    }

    /// Handles a letter key.
    fn on_letter(&mut self, letter: &str) {
        // Commands go by letter on any keyboard layout, unlike keys of motion, which go by place.
        match letter {
            "c" => drop(self.model.navigator.next_camera().map(str::to_owned)),
            "f" => self.model.frame(f64::from(self.picture_rect.aspect_ratio())),
            "r" => self.pressed.push(Command::Rebake),
            "t" => {
                let plays = !self.model.playback().is_playing;
                self.pressed.push(Command::Play(PlayCommand::Play(plays)));
            }
            "h" | "?" => self.panel.help_open ^= true,
            "v" => {
                let next = self.model.navigator.travel().next();
                self.model.travel(next);
                self.notice = Some(travel_notice(next));
            }
            "m" if self.looking_from.is_some() => self.stop_looking(),
            "m" => self.start_looking(),
            "p" => self.model.choices.probes ^= true,
            "k" => {
                self.pressed.push(Command::Film(FilmCommand::Record(None)));
                let number = self.model.choices.film.keys.len() + 1;
                self.notice = Some(format!("Key {number} of the camera's path is set here."));
            }
            digit => {
                let Some(number) = bookmark(digit) else { return };
                if self.model.navigator.go_to_bookmark(number) {
                    let more = json!({"number": number + 1, "kept": false});
                    self.model.log.write("bookmark", more);
                } else {
                    let key = number + 1;
                    self.notice = Some(format!("No view is kept as {key}: Ctrl+{key} keeps this one."));
                }
            }
        }
    }

    /// Stops mouse look, else deselects, else cancels the bake.
    fn let_go(&mut self) {
        if self.looking_from.is_some() {
            self.stop_looking();
        } else if self.model.choices.selection.held().is_some() {
            self.model.choices.selection.hold(None);
        } else {
            self.pressed.push(Command::Cancel);
        }
    }

    pub(super) fn on_mouse_button(&mut self, button: MouseButton, state: ElementState) {
        if button == MouseButton::Right {
            match state {
                ElementState::Pressed if self.is_over_picture() => self.start_looking(),
                ElementState::Pressed => {}
                ElementState::Released => self.stop_looking(),
            }
        }
        if button == MouseButton::Left {
            match state {
                ElementState::Pressed => self.on_left_press(),
                ElementState::Released => self.on_left_release(),
            }
        }
    }

    fn on_left_press(&mut self) {
        // egui widgets and handles under the pointer take the click.
        if !self.is_over_picture() || self.gizmo.is_hot() {
            return;
        }
        if self.model.choices.probes {
            self.model.probe(self.view_ray());
        } else if let Some(view_ray) = self
            .view_ray()
            .filter(|_| self.model.choices.selection.placed().is_some())
        {
            self.model.begin_placing(view_ray);
        } else {
            self.clicks_at = Some(self.pointer);
        }
    }

    fn on_left_release(&mut self) {
        self.model.end_placing();
        if self.clicks_at.take().is_none() {
            return;
        }
        let camera = self.camera();
        let Some((lens, place)) = self.pointed(&camera) else {
            return;
        };
        // Lights are drawn, and can be clicked, only while there are handles.
        let marks = self.model.choices.selection.held().is_some();
        let light = gizmo::light_at(&lens, self.model.scene(), place).filter(|_| marks);
        let view_ray = lens.view_ray(place);
        match light {
            Some(light) => self.model.hold(GizmoTarget::Light(light)),
            None => self.model.pick(view_ray),
        }
        self.request_redraw();
    }

    pub(super) fn on_pointer(&mut self, position: PhysicalPosition<f64>) {
        self.pointer = position;
        let is_drag =
            |from: PhysicalPosition<f64>| (from.x - position.x).hypot(from.y - position.y) > CLICK_PIXELS;
        if self.clicks_at.is_some_and(is_drag) {
            self.clicks_at = None;
        }
        if let Some(view_ray) = self.view_ray() {
            self.model.go_on_placing(view_ray);
        }
    }

    /// The camera of the picture.
    fn camera(&self) -> Camera {
        let aspect = f64::from(self.picture_rect.aspect_ratio());
        self.model.navigator.camera_for(aspect)
    }

    fn pointer_points(&self) -> Option<egui::Pos2> {
        let scale = self.graphics.as_ref()?.window().scale_factor();
        let points = |pixels: f64| (pixels / scale) as f32;
        Some(egui::pos2(points(self.pointer.x), points(self.pointer.y)))
    }

    /// The viewport, and the pointer's position in the window [points].
    fn pointed<'a>(&self, camera: &'a Camera) -> Option<(Viewport<'a>, egui::Pos2)> {
        let picture = self.picture_rect;
        Some((Viewport { camera, picture }, self.pointer_points()?))
    }

    /// The view ray under the pointer.
    fn view_ray(&self) -> Option<Ray> {
        let camera = self.camera();
        self.pointed(&camera).map(|(lens, place)| lens.view_ray(place))
    }

    pub(super) fn on_wheel(&mut self, delta: MouseScrollDelta) {
        if self.is_over_picture() {
            self.model.navigator.wheel(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
            });
        }
    }

    /// Whether the pointer is over the picture and not over a widget in front of it.
    pub(super) fn is_over_picture(&mut self) -> bool {
        let (Some(place), Some(graphics)) = (self.pointer_points(), &mut self.graphics) else {
            return false;
        };
        let is_background = |layer: egui::LayerId| layer.order == egui::Order::Background;
        let layer = graphics.interface.context.layer_id_at(place);
        self.picture_rect.contains(place) && layer.is_none_or(is_background)
    }

    pub(super) fn start_looking(&mut self) {
        self.looking_from = Some(self.pointer);
        if let Some(graphics) = &self.graphics {
            let window = graphics.window();
            // If the system supports neither mode, mouse movements still arrive; only the pointer leaves the window.
            let _ = window
                .set_cursor_grab(CursorGrabMode::Locked)
                .or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined));
            window.set_cursor_visible(false);
        }
    }

    pub(super) fn stop_looking(&mut self) {
        if let Some(from) = self.looking_from.take()
            && let Some(graphics) = &self.graphics
        {
            let window = graphics.window();
            // Puts the pointer back where it was. Not every system supports that.
            let _ = window.set_cursor_position(from);
            let _ = window.set_cursor_grab(CursorGrabMode::None);
            window.set_cursor_visible(true);
        }
    }
}

/// Updates a movement key; returns whether the key is one. Keys are identified by physical position, so that every
/// keyboard layout works with the same fingers.
fn hold(keys: &mut HeldKeys, key: KeyCode, state: ElementState) -> bool {
    let held = match key {
        KeyCode::KeyW => &mut keys.forward,
        KeyCode::KeyS => &mut keys.backward,
        KeyCode::KeyA => &mut keys.left,
        KeyCode::KeyD => &mut keys.right,
        KeyCode::KeyE => &mut keys.up,
        KeyCode::KeyQ => &mut keys.down,
        KeyCode::ShiftLeft | KeyCode::ShiftRight => &mut keys.run,
        KeyCode::ControlLeft | KeyCode::ControlRight => &mut keys.creep,
        _ => return false,
    };
    *held = state.is_pressed();
    true
}

/// Index of the bookmark that a digit key stands for, from 0.
fn bookmark(digit: &str) -> Option<usize> {
    let number: usize = digit.parse().ok()?;
    (1..=BOOKMARKS).contains(&number).then(|| number - 1)
}
