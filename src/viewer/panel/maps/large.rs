//! One map in a window over the picture: zoom, pan, values under the pointer.

use egui::{Color32, EventFilter, Key, Rect, Response, RichText, Sense, TextureHandle, Ui, pos2, vec2};

use super::texture;
use crate::illumination::IlluminationMap;
use crate::viewer::flat_map::{self, MapCrop, MapReading};
use crate::viewer::panel::WIDTH;
use crate::viewer::panel::control::significant;
use crate::viewer::panel::effects::COUNTER;

/// Initial side of the picture [points]; fits into a window of 1280 × 720 with the panel.
const SIDE: f32 = 440.0;
/// Range of the zoom [points per texel].
const ZOOM: (f64, f64) = (1e-3, 256.0);
/// Zoom factor of a button press.
const STEP: f64 = 1.5;
/// Logarithmic zoom per point scrolled.
const WHEEL: f64 = 0.004;
/// Movement per press of an arrow key [points].
const ARROW: f32 = 24.0;

const HOW: &str = "Drag to move, wheel to zoom; with the keyboard arrows, + and −. As white paper would look under this \
                   light, in an exposure that suits this map alone.";

/// The map in the window.
#[derive(Clone)]
pub struct Large {
    map: usize,
    /// Texel at the centre and zoom [points per texel]; `None` fits the whole map into the window.
    place: Option<([f64; 2], f64)>,
    texture: Option<TextureHandle>,
    /// The crop in the texture, and its size.
    shown: Option<(MapCrop, [usize; 2])>,
    exposure_stops: Option<f64>,
}

impl Large {
    /// Shows a map by its index.
    pub fn new(map: usize) -> Self {
        Self {
            map,
            place: None,
            texture: None,
            shown: None,
            exposure_stops: None,
        }
    }

    /// Index of the map.
    pub fn map(&self) -> usize {
        self.map
    }

    /// The maps have changed: forces a new picture.
    pub fn forget_picture(&mut self) {
        (self.shown, self.exposure_stops) = (None, None);
    }

    /// Shows the window; returns whether it stays open.
    pub fn show(&mut self, ui: &Ui, map: &IlluminationMap, name: &str) -> bool {
        let mut is_open = true;
        egui::Window::new(format!("Map of {name}"))
            .id(egui::Id::unique("large map"))
            .open(&mut is_open)
            .collapsible(false)
            .default_pos(pos2(WIDTH + 24.0, 48.0))
            .default_size(vec2(SIDE, SIDE + 60.0))
            .show(ui.ctx(), |ui| self.contents(ui, map));
        is_open
    }

    fn contents(&mut self, ui: &mut Ui, map: &IlluminationMap) {
        ui.horizontal(|ui| self.buttons(ui, map));
        let line = ui.text_style_height(&egui::TextStyle::Body) + ui.spacing().item_spacing.y;
        let size = (ui.available_size() - vec2(0.0, line)).max(vec2(64.0, 64.0));
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let (middle, zoom) = self.place.unwrap_or_else(|| fit(map, rect));
        let (middle, zoom) = self.moved(ui, &response, (middle, zoom));
        let part = MapCrop {
            left: middle[0] - 0.5 * f64::from(rect.width()) / zoom,
            top: middle[1] - 0.5 * f64::from(rect.height()) / zoom,
            texels_per_pixel: 1.0 / zoom,
        };
        self.paint(ui, map, rect, part);
        let under = response.hover_pos().and_then(|pointer| {
            let at = pointer - rect.min;
            let texels = |points: f32| f64::from(points) / zoom;
            flat_map::read(map, part.left + texels(at.x), part.top + texels(at.y))
        });
        let text = under
            .as_ref()
            .map_or_else(|| "Point at the map to read its irradiance.".to_owned(), sentence);
        ui.add(egui::Label::new(RichText::new(text).size(COUNTER)).truncate());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Map, large"));
    }

    fn buttons(&mut self, ui: &mut Ui, map: &IlluminationMap) {
        let zoomed = |times: f64, place: Option<([f64; 2], f64)>| {
            let (middle, zoom) =
                place.unwrap_or_else(|| fit(map, Rect::from_min_size(pos2(0.0, 0.0), vec2(SIDE, SIDE))));
            Some((middle, (zoom * times).clamp(ZOOM.0, ZOOM.1)))
        };
        let button = |ui: &mut Ui, sign: &str, name: &str| {
            let button = ui.button(sign).accessible_name(name);
            button.on_hover_text(format!("{name}. {HOW}")).clicked()
        };
        if button(ui, "+", "Zoom in") {
            self.place = zoomed(STEP, self.place);
        }
        if button(ui, "−", "Zoom out") {
            self.place = zoomed(1.0 / STEP, self.place);
        }
        if button(ui, "Fit", "Fit") {
            self.place = None;
        }
        if button(ui, "1:1", "One texel a point") {
            let (middle, zoom) = self
                .place
                .unwrap_or(([0.5 * map.width() as f64, 0.5 * map.height() as f64], 1.0));
            self.place = zoomed(1.0 / zoom, Some((middle, zoom)));
        }
        ui.label(RichText::new(super::figures(map)).weak());
    }

    /// Centre and zoom after input by mouse and keyboard.
    fn moved(
        &mut self,
        ui: &Ui,
        canvas: &Response,
        (mut middle, mut zoom): ([f64; 2], f64),
    ) -> ([f64; 2], f64) {
        // Once it was clicked, the map has the keyboard: arrows move it, plus and minus zoom.
        let before = (middle, zoom);
        let mut drag = canvas.drag_delta();
        if canvas.clicked() || canvas.drag_started() {
            canvas.request_focus();
        }
        let mut times = 1.0;
        if canvas.has_focus() {
            let filter = EventFilter {
                horizontal_arrows: true,
                vertical_arrows: true,
                ..EventFilter::default()
            };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(canvas.id, filter));
            let presses = |key| ui.input(|input| input.num_presses(key)) as f32;
            drag.x += ARROW * (presses(Key::ArrowLeft) - presses(Key::ArrowRight));
            drag.y += ARROW * (presses(Key::ArrowUp) - presses(Key::ArrowDown));
            let steps = presses(Key::Plus) + presses(Key::Equals) - presses(Key::Minus);
            times *= STEP.powf(f64::from(steps));
        }

        // The texel under the pointer stays there, whether the map is dragged or zoomed.
        middle[0] -= f64::from(drag.x) / zoom;
        middle[1] -= f64::from(drag.y) / zoom;
        let pointer = canvas.hover_pos();
        if pointer.is_some() {
            let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            times *= (WHEEL * f64::from(scroll)).exp() * f64::from(pinch);
        }
        let zoomed = (zoom * times).clamp(ZOOM.0, ZOOM.1);

        // Zooms about the pointer.
        let off = pointer.map_or(vec2(0.0, 0.0), |pointer| pointer - canvas.rect.center());
        middle[0] += f64::from(off.x) * (1.0 / zoom - 1.0 / zoomed);
        middle[1] += f64::from(off.y) * (1.0 / zoom - 1.0 / zoomed);
        zoom = zoomed;

        // A map that was never moved keeps fitting the window, whatever its size becomes.
        if (middle, zoom) != before {
            self.place = Some((middle, zoom));
        }
        (middle, zoom)
    }

    fn paint(&mut self, ui: &Ui, map: &IlluminationMap, rect: Rect, part: MapCrop) {
        let size = [rect.width() as usize, rect.height() as usize].map(|side| side.max(1));
        if self.shown != Some((part, size)) {
            let stops = *self
                .exposure_stops
                .get_or_insert_with(|| flat_map::exposure_stops(map));
            let shown = flat_map::show(map, part, size, stops);
            self.texture = Some(texture(ui, "large map", &shown, self.texture.take()));
            self.shown = Some((part, size));
        }
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        if let Some(texture) = &self.texture {
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.image(texture.id(), rect, whole, Color32::WHITE);
        }
    }
}

/// Centre and zoom that fit the whole map into a rectangle.
fn fit(map: &IlluminationMap, rect: Rect) -> ([f64; 2], f64) {
    let (width, height) = (map.width() as f64, map.height() as f64);
    let zoom = (f64::from(rect.width()) / width).min(f64::from(rect.height()) / height);
    ([0.5 * width, 0.5 * height], zoom.clamp(ZOOM.0, ZOOM.1))
}

/// "texel 12, 34: caustic 1.23, direct 0.45 W/m², error ±0.02".
fn sentence(reading: &MapReading) -> String {
    let [column, row] = reading.texel;
    let layers = reading.layers_w_per_m2.iter();
    let layers: Vec<String> = layers
        .map(|(kind, e)| format!("{} {}", kind.name(), significant(*e)))
        .collect();
    let error = reading
        .error_w_per_m2
        .map_or(String::new(), |error| format!(", error ±{}", significant(error)));
    format!("texel {column}, {row}: {} W/m²{error}", layers.join(", "))
}
