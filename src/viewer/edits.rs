//! The scene that the user edits, with what takes the edits back.

use std::sync::Arc;

use crate::error::Result;
use crate::scene::{Edit, EditTarget, Scene};

/// Edits that can be taken back: the inverse of one edit is small, but a moved mesh is kept whole.
const MOST_UNDONE: usize = 1000;

/// A scene with its history.
#[derive(Clone, Debug)]
pub struct EditedScene {
    loaded: Arc<Scene>,
    scene: Arc<Scene>,
    /// What takes back each edit, the newest last.
    inverses: Vec<(EditTarget, Edit)>,
    /// What the user drags at: all of a drag is one edit to take back.
    dragged: Option<EditTarget>,
}

impl EditedScene {
    /// Nothing is edited yet.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self {
            loaded: Arc::clone(&scene),
            scene,
            inverses: Vec::new(),
            dragged: None,
        }
    }

    /// As it is now.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// As it was before every edit.
    pub fn loaded(&self) -> &Arc<Scene> {
        &self.loaded
    }

    /// Edits that can be taken back.
    pub fn undoable(&self) -> usize {
        self.inverses.len()
    }

    /// Edits the scene. Edits of one target while the mouse is down are taken back together.
    ///
    /// # Errors
    /// As [`Edit::apply`]: the scene stays.
    pub fn edit(&mut self, edit: &Edit) -> Result<()> {
        let target = edit.target();
        let (scene, inverse) = edit.apply(&self.scene)?;
        self.scene = Arc::new(scene);
        if self.dragged.as_ref() != Some(&target) {
            self.inverses.push((target.clone(), inverse));
            if self.inverses.len() > MOST_UNDONE {
                self.inverses.remove(0);
            }
        }
        self.dragged = Some(target);
        Ok(())
    }

    /// The mouse is up: the next edit is one of its own.
    pub fn release(&mut self) {
        self.dragged = None;
    }

    /// Takes the last edit back; tells whether there was one.
    ///
    /// # Errors
    /// As [`Edit::apply`].
    pub fn undo(&mut self) -> Result<bool> {
        self.dragged = None;
        let Some((_, inverse)) = self.inverses.pop() else {
            return Ok(false);
        };
        let (scene, _) = inverse.apply(&self.scene)?;
        self.scene = Arc::new(scene);
        Ok(true)
    }
}
