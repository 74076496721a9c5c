//! How light runs through the scene, over the picture: found on a thread of its own, and drawn.

use std::sync::Arc;

use egui::{Color32, Painter, Stroke};

use super::background::{Background, Wake};
use super::lens::Lens;
use crate::light_pass::sketch::{Sketch, SketchLimits, sketch};
use crate::progress::Control;
use crate::transport::Tracer;

const HIT: Color32 = Color32::from_rgb(255, 214, 110);
const OUTLINE: Color32 = Color32::from_rgb(120, 220, 255);
/// Radius of a landing [points].
const DOT: f32 = 1.2;

/// What of it is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sketched {
    /// Where rays land.
    pub hits: bool,
    /// Patches of wavefronts.
    pub patches: bool,
}

impl Sketched {
    /// Whether anything is.
    pub fn is_any(self) -> bool {
        self.hits || self.patches
    }
}

/// Finds it, and keeps what it found.
#[derive(Debug)]
pub struct Sketcher {
    wake: Wake,
    /// Of these surfaces.
    shown: Option<(Arc<Tracer>, SketchLimits, Arc<Sketch>)>,
    coming: Option<(Arc<Tracer>, SketchLimits, Background<Sketch>)>,
}

impl Sketcher {
    /// Nothing yet; `wake` is called from another thread when there is something.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            wake: Wake(wake),
            shown: None,
            coming: None,
        }
    }

    /// What was found last.
    pub fn shown(&self) -> Option<&Arc<Sketch>> {
        self.shown.as_ref().map(|(.., sketch)| sketch)
    }

    /// Nothing is drawn any more.
    pub fn forget(&mut self) {
        (self.shown, self.coming) = (None, None);
    }

    /// Keeps what is shown that of these surfaces; tells whether something new was found. While a search goes on, surfaces
    /// that come after its own wait.
    pub fn follow(&mut self, tracer: &Arc<Tracer>, limits: SketchLimits) -> bool {
        let mut is_new = false;
        if let Some((of, with, coming)) = &self.coming
            && let Some(outcome) = coming.poll()
        {
            is_new = outcome.is_some();
            if let Some(sketch) = outcome {
                self.shown = Some((Arc::clone(of), *with, Arc::new(sketch)));
            }
            self.coming = None;
        }
        let is_of_these =
            |(of, with, _): &(Arc<Tracer>, SketchLimits, _)| Arc::ptr_eq(of, tracer) && *with == limits;
        if self.coming.is_none() && !self.shown.as_ref().is_some_and(is_of_these) {
            self.start(tracer, limits);
        }
        is_new
    }

    fn start(&mut self, tracer: &Arc<Tracer>, limits: SketchLimits) {
        let of = Arc::clone(tracer);
        let search = move |control: &Control| sketch(&of, limits, control);
        let started = Background::start("sketch", &self.wake, search);
        self.coming = started.ok().map(|coming| (Arc::clone(tracer), limits, coming));
    }
}

/// Draws it over a picture as the camera sees it, in front of everything.
pub fn draw(painter: &Painter, lens: &Lens<'_>, sketch: &Sketch, what: Sketched) {
    let painter = painter.with_clip_rect(lens.picture);
    if what.patches {
        let stroke = Stroke::new(0.6, OUTLINE.gamma_multiply(0.7));
        for patch in &sketch.patches {
            for side in 0..4 {
                let (from, to) = (patch.corners[side], patch.corners[(side + 1) % 4]);
                if let Some(ends) = lens.line(from, to) {
                    painter.line_segment(ends, stroke);
                }
            }
        }
    }
    if what.hits {
        for landing in &sketch.landings {
            if lens.is_before(landing.point) {
                painter.circle_filled(lens.place(landing.point), DOT, HIT);
            }
        }
    }
}
