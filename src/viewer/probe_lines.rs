//! The light paths of a probed point over the picture: in front of everything, so that what is within glass is seen.

use egui::{Color32, Painter, Stroke, pos2};

use super::lens::Lens;
use super::probe::Probed;

/// Paths that are drawn: the strongest.
const MOST_PATHS: usize = 24;
const CAUSTIC: Color32 = Color32::from_rgb(255, 196, 64);
const DIRECT: Color32 = Color32::from_rgb(120, 190, 255);
const POINT: Color32 = Color32::from_rgb(255, 80, 80);

/// Draws the paths over a picture as the camera sees them: the wider, the larger their share.
pub fn draw(painter: &Painter, lens: &Lens<'_>, probed: &Probed) {
    let painter = painter.with_clip_rect(lens.picture);
    let paths = probed.explanation.iter().flat_map(|told| &told.paths);
    for path in paths.take(MOST_PATHS) {
        let share = probed.share(path) as f32;
        let colour = if path.vertices.is_empty() { DIRECT } else { CAUSTIC };
        let stroke = Stroke::new(1.2 + 2.5 * share.clamp(0.0, 1.0), colour.gamma_multiply(0.9));
        let corners = path.vertices.iter().map(|vertex| vertex.point);
        let mut from = path.start;
        for to in corners.chain([path.end]) {
            if let Some(ends) = lens.line(from, to) {
                painter.line_segment(ends, stroke);
            }
            from = to;
        }
        for vertex in &path.vertices {
            if lens.is_before(vertex.point) {
                painter.circle_filled(lens.place(vertex.point), 3.0, colour);
            }
        }
        if lens.is_before(path.start) {
            painter.circle_stroke(lens.place(path.start), 5.0, Stroke::new(1.5, colour));
        }
    }
    if lens.is_before(probed.point) {
        let at = lens.place(probed.point);
        for (x, y) in [(6.0, 0.0), (0.0, 6.0)] {
            let ends = [pos2(at.x - x, at.y - y), pos2(at.x + x, at.y + y)];
            painter.line_segment(ends, Stroke::new(2.0, POINT));
        }
        painter.circle_stroke(at, 5.0, Stroke::new(1.5, POINT));
    }
}
