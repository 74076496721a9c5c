//! How light runs through the scene, over the picture: found on a thread of its own, and drawn.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use egui::{Color32, Painter, Stroke};

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
pub struct Sketcher {
    wake: Arc<dyn Fn() + Send + Sync>,
    /// Of these surfaces.
    shown: Option<(Arc<Tracer>, SketchLimits, Arc<Sketch>)>,
    coming: Option<Coming>,
}

struct Coming {
    of: Arc<Tracer>,
    limits: SketchLimits,
    sketch: Receiver<Sketch>,
    control: Arc<Control>,
}

impl Drop for Coming {
    fn drop(&mut self) {
        self.control.cancel();
    }
}

impl fmt::Debug for Sketcher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (is_shown, is_coming) = (self.shown.is_some(), self.coming.is_some());
        write!(f, "Sketcher {{ shown: {is_shown}, coming: {is_coming} }}")
    }
}

impl Sketcher {
    /// Nothing yet; `wake` is called from another thread when there is something.
    pub fn new(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        Self {
            wake,
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
        if let Some(coming) = self.coming.take() {
            match coming.sketch.try_recv() {
                Ok(sketch) => {
                    self.shown = Some((Arc::clone(&coming.of), coming.limits, Arc::new(sketch)));
                    is_new = true;
                }
                Err(TryRecvError::Empty) => self.coming = Some(coming),
                Err(TryRecvError::Disconnected) => {}
            }
        }
        let is_of_these =
            |(of, with, _): &(Arc<Tracer>, SketchLimits, _)| Arc::ptr_eq(of, tracer) && *with == limits;
        if self.coming.is_none() && !self.shown.as_ref().is_some_and(is_of_these) {
            self.start(tracer, limits);
        }
        is_new
    }

    fn start(&mut self, tracer: &Arc<Tracer>, limits: SketchLimits) {
        let (give, found) = channel();
        let control = Arc::new(Control::default());
        let (of_search, wake) = (Arc::clone(&control), Arc::clone(&self.wake));
        let of = Arc::clone(tracer);
        let search = move || {
            // Nobody waits any more where it was switched off.
            let _ = give.send(sketch(&of, limits, &of_search));
            wake();
        };
        let started = thread::Builder::new().name("sketch".into()).spawn(search);
        self.coming = started.is_ok().then(|| Coming {
            of: Arc::clone(tracer),
            limits,
            sketch: found,
            control,
        });
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
