//! Light paths drawn over the picture, traced on a thread of its own.

use std::sync::Arc;

use egui::{Color32, Painter, Stroke};

use super::background::Latest;
use super::lens::Viewport;
use crate::light_pass::sketch::{PathPreview, SketchLimits, sketch};
use crate::transport::Tracer;

const HIT: Color32 = Color32::from_rgb(255, 214, 110);
const OUTLINE: Color32 = Color32::from_rgb(120, 220, 255);
/// Radius of the dots [points].
const DOT: f32 = 1.2;

/// Which parts of the path preview are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PreviewFlags {
    /// Points where light paths end.
    pub hits: bool,
    /// Wavefront patches.
    pub patches: bool,
}

impl PreviewFlags {
    pub fn is_any(self) -> bool {
        self.hits || self.patches
    }
}

/// The last path preview, by the surfaces and limits that it was traced with.
pub type PreviewTask = Latest<(Arc<Tracer>, SketchLimits), PathPreview>;

/// Traces a preview of these surfaces unless the last one is of them; returns whether a new one is ready. One preview is
/// traced at a time: newer surfaces wait until it ends.
pub fn follow(task: &mut PreviewTask, tracer: &Arc<Tracer>, limits: SketchLimits) -> bool {
    let of = Arc::clone(tracer);
    task.follow(
        &(Arc::clone(tracer), limits),
        |(a, with_a), (b, with_b)| Arc::ptr_eq(a, b) && with_a == with_b,
        move |_, task| sketch(&of, limits, &task.control),
    )
}

/// Draws the preview over the picture, in front of everything.
pub fn draw(painter: &Painter, lens: &Viewport<'_>, sketch: &PathPreview, what: PreviewFlags) {
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
                painter.circle_filled(lens.project(landing.point), DOT, HIT);
            }
        }
    }
}
