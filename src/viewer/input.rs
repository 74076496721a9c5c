//! What keys and mouse mean over the picture.

use winit::event::ElementState;
use winit::keyboard::KeyCode;

use super::navigation::HeldKeys;

/// A key that does something once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shortcut {
    /// C
    NextCamera,
    /// F
    Frame,
    /// R
    Rebake,
    /// H
    Help,
    /// Esc
    LetGo,
}

/// Holds or releases a movement key, by its place on the keyboard, so that any layout flies with the same fingers;
/// tells whether it is one.
pub fn hold(keys: &mut HeldKeys, key: KeyCode, state: ElementState) -> bool {
    let held = match key {
        KeyCode::KeyW => &mut keys.forward,
        KeyCode::KeyS => &mut keys.backward,
        KeyCode::KeyA => &mut keys.left,
        KeyCode::KeyD => &mut keys.right,
        KeyCode::KeyE => &mut keys.up,
        KeyCode::KeyQ => &mut keys.down,
        KeyCode::ShiftLeft | KeyCode::ShiftRight => &mut keys.run,
        _ => return false,
    };
    *held = state.is_pressed();
    true
}

/// What a key press does, if anything.
pub fn shortcut(key: KeyCode) -> Option<Shortcut> {
    match key {
        KeyCode::KeyC => Some(Shortcut::NextCamera),
        KeyCode::KeyF => Some(Shortcut::Frame),
        KeyCode::KeyR => Some(Shortcut::Rebake),
        KeyCode::KeyH => Some(Shortcut::Help),
        KeyCode::Escape => Some(Shortcut::LetGo),
        _ => None,
    }
}
