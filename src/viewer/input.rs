//! What keys mean.

use winit::event::ElementState;
use winit::keyboard::{Key, KeyCode, NamedKey};

use super::navigation::{BOOKMARKS, HeldKeys};

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
    /// V
    NextTravel,
    /// M
    Look,
    /// P
    Probe,
    /// K
    RecordKey,
    /// 1 to 9, from 0 on
    Bookmark(usize),
    /// F12
    SavePicture,
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
        KeyCode::ControlLeft | KeyCode::ControlRight => &mut keys.creep,
        _ => return false,
    };
    *held = state.is_pressed();
    true
}

/// What a key press does, if anything, by the letter on the key.
pub fn shortcut(key: &Key) -> Option<Shortcut> {
    match key {
        Key::Named(NamedKey::Escape) => Some(Shortcut::LetGo),
        Key::Named(NamedKey::F12) => Some(Shortcut::SavePicture),
        Key::Character(letter) => match letter.to_lowercase().as_str() {
            "c" => Some(Shortcut::NextCamera),
            "f" => Some(Shortcut::Frame),
            "r" => Some(Shortcut::Rebake),
            "h" | "?" => Some(Shortcut::Help),
            "v" => Some(Shortcut::NextTravel),
            "m" => Some(Shortcut::Look),
            "p" => Some(Shortcut::Probe),
            "k" => Some(Shortcut::RecordKey),
            digit => bookmark(digit).map(Shortcut::Bookmark),
        },
        _ => None,
    }
}

/// Which kept view a key with a digit means, from 0 on.
pub fn bookmark(digit: &str) -> Option<usize> {
    let number: usize = digit.parse().ok()?;
    (1..=BOOKMARKS).contains(&number).then(|| number - 1)
}

/// What a key does with Ctrl held: true takes the last change back, false does it again.
pub fn undoes(key: &Key, shift: bool) -> Option<bool> {
    let Key::Character(letter) = key else {
        return None;
    };
    match letter.to_lowercase().as_str() {
        "z" => Some(!shift),
        "y" => Some(false),
        _ => None,
    }
}
