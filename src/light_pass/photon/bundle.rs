//! A bundle: the light of one path over a square of the launch domain.
//!
//! Where all nine points of the square have the path, place and flux are biquadratic in the position within the square.
//! Where only some have it, the square is cut along the edge of the path, and the bundle consists of triangles between
//! which both are linear.

use glam::{DMat2, DVec2, Vec2};

use super::image::{Image, SMOOTH_TEXELS};
use super::paths::{PathEnd, PointPaths, Route};
use crate::illumination::Receiver;
use crate::light_pass::coverage::FluxTriangle;
use crate::optics::LinearSrgb;
use crate::scene::PanelShape;

/// Weights of the nine points in a mean over the square (Simpson's rule).
pub(super) const MEAN_WEIGHTS: [f64; 9] = [
    1.0 / 36.0,
    4.0 / 36.0,
    1.0 / 36.0,
    4.0 / 36.0,
    16.0 / 36.0,
    4.0 / 36.0,
    1.0 / 36.0,
    4.0 / 36.0,
    1.0 / 36.0,
];

/// The same of what only some of the points have, which changes abruptly: the area that is nearest to each.
pub(super) const NEAREST_WEIGHTS: [f64; 9] = [
    1.0 / 16.0,
    2.0 / 16.0,
    1.0 / 16.0,
    2.0 / 16.0,
    4.0 / 16.0,
    2.0 / 16.0,
    1.0 / 16.0,
    2.0 / 16.0,
    1.0 / 16.0,
];

/// Extent of the light from one part of a lamp, or of a spectrum, on the map [texels], unless that takes too many
/// parts.
pub(super) const PART_TEXELS: f64 = 0.1;

/// Minimum and maximum number of parts of a lamp: of light of one hue, and of dispersed light.
const LAMP_PARTS: [(f64, f64); 2] = [(4.0, 32.0), (4.0, 4.0)];

/// Minimum and maximum number of parts of a spectrum. Fewer would leave colour noise.
const HUE_PARTS: (f64, f64) = (8.0, 64.0);

/// Maximum length of the steps in which the parts of a lamp spread an edge [texels]. A larger lamp is left to photons.
pub(super) const MAX_STEP_TEXELS: f64 = 0.5;

/// A triangle lies beside a fold if it is less than so many times as thick as it is moved: chords of x(u) = u² move the
/// first part by a sixth of it, and the next by an eighteenth.
const BESIDE_FOLD: f64 = 12.0;

/// Light at one point of a bundle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// On the map [texels].
    pub(super) place: Vec2,
    /// Per unit square of the launch domain [W per channel].
    pub(super) flux_w: [f32; 3],
}

impl Node {
    pub(super) fn of(end: &PathEnd) -> Self {
        Self {
            place: end.place.as_vec2(),
            flux_w: end.flux_w.to_array().map(|watts| watts as f32),
        }
    }

    pub(super) fn flux_w(&self) -> LinearSrgb {
        LinearSrgb::from(self.flux_w.map(f64::from))
    }
}

/// Interpolated light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predicted {
    /// On the map [texels].
    pub(super) place: DVec2,
    /// Per unit square of the launch domain [W per channel].
    pub(super) flux_w: LinearSrgb,
}

/// A triangle of a cut square.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Within the square.
    pub(super) corners: [Vec2; 3],
    pub(super) nodes: [Node; 3],
}

/// The part of the square that has the path.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// All of it, with nodes row by row.
    Whole(Box<[Node; 9]>),
    Cut(Vec<Piece>),
    /// Left to photons.
    Nothing,
}

/// Displacement of an arrival on the map, relative to light from the lamp's centre at the middle wavelength [texels].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OriginShift {
    /// For light from the end of each half-axis of an extended light.
    lamp: [Vec2; 2],
    /// At the first and the last wavelength of dispersed light.
    hues: [Vec2; 2],
}

/// Point on the lamp and wavelength.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// In half-axes from the lamp's centre.
    pub(super) lamp: DVec2,
    /// [`Hue::ends`](super::spectrum::Hue::ends).
    pub(super) ends: [f64; 2],
}

impl OriginShift {
    /// Measured at one point of the square; `None` if light takes another path from there, or if the lamp is too large.
    pub(super) fn measured(
        middle: &PathEnd,
        lamp_sides: Option<&[PointPaths; 2]>,
        spectrum_ends: Option<&[PointPaths; 2]>,
    ) -> Option<Self> {
        let signature = middle.route.signature;
        let moved = |paths: &PointPaths| Some((paths.end(signature)?.place - middle.place).as_vec2());
        let mut shift = Self::default();
        if let Some([x, y]) = lamp_sides {
            // The sides are half-way out.
            shift.lamp = [moved(x)? * 2.0, moved(y)? * 2.0];
        }
        if let Some([first, last]) = spectrum_ends.filter(|_| middle.route.is_dispersed) {
            shift.hues = [moved(first)?, moved(last)?];
        }
        (shift.lamp_step_texels() < MAX_STEP_TEXELS).then_some(shift)
    }

    /// For light from the ends of a lamp's half-axes [texels].
    #[cfg(test)]
    pub(super) fn of_lamp_sides(lamp: [DVec2; 2]) -> Self {
        Self {
            lamp: lamp.map(|moved| moved.as_vec2()),
            ..Self::default()
        }
    }

    /// Whether lamp and wavelengths spread the light over several texels.
    pub(super) fn is_smooth(&self) -> bool {
        let [x, y] = self.lamp.map(|moved| 2.0 * moved.abs().max_element());
        self.hues_across().max(f64::from(x.min(y))) >= SMOOTH_TEXELS
    }

    pub(super) fn at(&self, origin: &Origin) -> DVec2 {
        self.of_lamp(origin.lamp) + self.of_hue(origin.ends)
    }

    /// For a point of the lamp, in half-axes from its centre.
    pub(super) fn of_lamp(&self, at: DVec2) -> DVec2 {
        let [x, y] = self.lamp.map(|moved| moved.as_dvec2());
        x * at.x + y * at.y
    }

    /// Map of the lamp, in half-axes from its centre, after which its image has the second moments of the light that it
    /// and a triangle around the same middle [texels] spread together.
    pub(super) fn widened(&self, lamp: PanelShape, corners: [DVec2; 3]) -> DMat2 {
        let [x, y] = self.lamp.map(|moved| moved.as_dvec2());
        let on_lamp = DMat2::from_cols(x, y).inverse();
        let mut square = DMat2::IDENTITY;
        for corner in corners {
            let at = on_lamp * corner;
            square += DMat2::from_cols(at * at.x, at * at.y) * (1.0 / (12.0 * lamp.second_moment()));
        }
        // The square root of a symmetric matrix.
        let root = square.determinant().sqrt();
        let trace = square.x_axis.x + square.y_axis.y;
        (square + DMat2::IDENTITY * root) * (trace + 2.0 * root).sqrt().recip()
    }

    /// For a wavelength, by its [`Hue::ends`](super::spectrum::Hue::ends).
    pub(super) fn of_hue(&self, ends: [f64; 2]) -> DVec2 {
        let [first, last] = self.hues.map(|moved| moved.as_dvec2());
        first * ends[0] + last * ends[1]
    }

    /// Parts of a lamp for which a bundle is deposited, a multiple of four, or one: so many that an edge is spread in
    /// steps of about this length.
    pub(super) fn lamp_parts(&self, part_texels: f64, is_dispersed: bool) -> u32 {
        let length = self.lamp_length();
        // A single part would have no width at all.
        if length <= PART_TEXELS {
            return 1;
        }
        let (least, most) = LAMP_PARTS[usize::from(is_dispersed)];
        4 * (0.25 * (length / part_texels).clamp(least, most)).ceil() as u32
    }

    /// Width of the lamp's image across its longer side [texels].
    pub(super) fn lamp_width(&self) -> f64 {
        let [x, y] = self.lamp.map(|moved| moved.as_dvec2());
        2.0 * x.perp_dot(y).abs() / x.length().max(y.length()).max(f64::MIN_POSITIVE)
    }

    /// Length of the lamp's image along an axis of the map [texels].
    fn lamp_length(&self) -> f64 {
        let [x, y] = self.lamp.map(|moved| moved.as_dvec2());
        2.0 * (x * x + y * y).max_element().sqrt()
    }

    /// Length of the steps in which the parts of a lamp spread an edge [texels].
    fn lamp_step_texels(&self) -> f64 {
        let is_dispersed = self.parts_hues();
        self.lamp_length() / f64::from(self.lamp_parts(PART_TEXELS, is_dispersed))
    }

    /// Extent of the spectrum on the map [texels].
    fn hues_across(&self) -> f64 {
        let [first, last] = self.hues;
        f64::from((first - last).abs().max_element())
    }

    /// Whether the spectrum spreads farther than one part of it should.
    pub(super) fn parts_hues(&self) -> bool {
        self.hues_across() > PART_TEXELS
    }
}

/// The light of one path over a square.
#[derive(Clone, Debug)]
pub(super) struct Bundle {
    pub(super) route: Route,
    pub(super) shape: Shape,
    /// Displacement for other points of the lamp and other wavelengths.
    pub(super) shift: OriginShift,
    /// Mean flux over the square [W, largest channel].
    pub(super) flux_w: f64,
    /// Expected displacement of its predictions [texels].
    pub(super) displaced_texels: f64,
    /// Divisions of the square's sides for the deposit.
    pub(super) divisions: usize,
    /// Parts of the spectrum for the deposit.
    pub(super) hue_parts: f64,
    /// Index of its first triangle among those of its path in all squares.
    pub(super) first_triangle: u32,
    /// Whether light varies little from texel to texel.
    pub(super) is_smooth: bool,
}

impl Bundle {
    /// A bundle of nothing yet.
    pub(super) fn new(route: Route, flux_w: f64) -> Self {
        Self {
            route,
            shape: Shape::Nothing,
            shift: OriginShift::default(),
            flux_w,
            displaced_texels: 0.0,
            divisions: 1,
            hue_parts: HUE_PARTS.1,
            first_triangle: 0,
            is_smooth: true,
        }
    }

    /// Chooses the divisions of the deposit so that it errs no more than `allowed`, the squared flux of the bundle with
    /// this weight [W²/m²], and as many parts of the spectrum as keep their noise below that. Returns the squared error
    /// that the divisions leave.
    pub(super) fn plan_deposit(&mut self, weight: f64, allowed: f64) -> f64 {
        let flux = self.flux_w * weight;
        let mut image = Image::default();
        let mut left = 0.0;
        if let Shape::Whole(nodes) = &self.shape {
            image = Image::of(nodes).blurred(self.shift.lamp_width());
            (self.divisions, left) = image.divisions(flux, allowed);
        }
        let parts = image.hue_parts(self.shift.hues_across(), flux, allowed);
        self.hue_parts = parts.clamp(HUE_PARTS.0, HUE_PARTS.1);
        left
    }

    pub(super) fn receiver(&self) -> Receiver {
        self.route.receiver
    }

    /// Light predicted at a point of the square and for an origin; `None` where it does not have the path.
    pub(super) fn at(&self, within: DVec2, origin: &Origin) -> Option<Predicted> {
        let predicted = match &self.shape {
            Shape::Whole(nodes) => biquadratic(nodes, within),
            Shape::Cut(pieces) => pieces.iter().find_map(|piece| piece.at(within))?,
            Shape::Nothing => return None,
        };
        Some(Predicted {
            place: predicted.place + self.shift.at(origin),
            ..predicted
        })
    }

    /// Whether the path exists at a point of the square.
    pub(super) fn has(&self, within: DVec2) -> bool {
        match &self.shape {
            Shape::Whole(_) => true,
            Shape::Cut(pieces) => pieces.iter().any(|piece| piece.weights(within).is_some()),
            Shape::Nothing => false,
        }
    }

    /// Number of triangles that it is deposited as.
    pub(super) fn triangle_count(&self) -> usize {
        match &self.shape {
            Shape::Nothing => 0,
            Shape::Cut(pieces) => pieces.len(),
            Shape::Whole(_) => 2 * self.divisions * self.divisions,
        }
    }

    /// Triangles of the map with the light of the square, whose area is `area` unit squares. `add` gets corners
    /// [texels], flux per unit square [W per channel], and the part of the area that the triangle stands for.
    pub(super) fn triangles(&self, area: f64, mut add: impl FnMut([DVec2; 3], LinearSrgb, f64)) {
        match &self.shape {
            Shape::Nothing => {}
            Shape::Cut(pieces) => {
                // Places are linear in a piece: one triangle has its exact image, with the mean of its light.
                for piece in pieces {
                    let flux_w = mean(piece.nodes.map(|node| node.flux_w()));
                    let corners = piece.nodes.map(|node| node.place.as_dvec2());
                    add(corners, flux_w, f64::from(piece.area()) * area);
                }
            }
            Shape::Whole(nodes) => {
                // Chords lie on one side of their curve, and the errors of many squares would add up: nodes are moved
                // so that the triangles keep the mean.
                let divisions = self.divisions;
                let centre = nodes[4].place;
                let nodes = unbiased(nodes, divisions);
                let moved = (nodes[4].place - centre).as_dvec2();

                // Each point of the grid is interpolated once: two rows are kept at a time.
                let step = 1.0 / divisions as f64;
                let point = |column: usize, row: usize| DVec2::new(column as f64, row as f64) * step;
                let row_of = |row: usize| -> Vec<Predicted> {
                    let columns = 0..=divisions;
                    columns
                        .map(|column| biquadratic(&nodes, point(column, row)))
                        .collect()
                };

                // Each triangle holds even light: it is moved so that this has the centre of the linear light, but
                // across no fold.
                let triangle_area = 0.5 * area * step * step;
                let mut above = row_of(0);
                for row in 1..=divisions {
                    let below = row_of(row);
                    for column in 0..divisions {
                        let (a, b) = (above[column], above[column + 1]);
                        let (c, d) = (below[column], below[column + 1]);
                        for corners in [[a, b, d], [a, d, c]] {
                            let flux_w = mean(corners.map(|corner| corner.flux_w));
                            add(off_fold(centred_on_light(corners), moved), flux_w, triangle_area);
                        }
                    }
                    above = below;
                }
            }
        }
    }
}

fn mean(fluxes: [LinearSrgb; 3]) -> LinearSrgb {
    (fluxes[0] + fluxes[1] + fluxes[2]) * (1.0 / 3.0)
}

impl Piece {
    /// Of the square's area.
    fn area(&self) -> f32 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).perp_dot(c - a).abs()
    }

    /// Barycentric coordinates of a point of the square; `None` outside the triangle.
    fn weights(&self, within: DVec2) -> Option<[f64; 3]> {
        let [a, b, c] = self.corners.map(|corner| corner.as_dvec2());
        let area = (b - a).perp_dot(c - a);
        let second = (within - a).perp_dot(c - a) / area;
        let third = (b - a).perp_dot(within - a) / area;
        let weights = [1.0 - second - third, second, third];
        // False for NaN: a triangle without area has no inside.
        weights.iter().all(|weight| *weight >= 0.0).then_some(weights)
    }

    fn at(&self, within: DVec2) -> Option<Predicted> {
        let weights = self.weights(within)?;
        let mut predicted = Predicted {
            place: DVec2::ZERO,
            flux_w: LinearSrgb::BLACK,
        };
        for (node, weight) in self.nodes.iter().zip(weights) {
            predicted.place += node.place.as_dvec2() * weight;
            predicted.flux_w += node.flux_w() * weight;
        }
        Some(predicted)
    }
}

/// The quadratic through values at 0, 1/2 and 1, as weights of these.
fn quadratic(at: f64) -> [f64; 3] {
    [
        (1.0 - at) * (1.0 - 2.0 * at),
        4.0 * at * (1.0 - at),
        at * (2.0 * at - 1.0),
    ]
}

/// Light at a point of a square with these nodes.
pub(super) fn biquadratic(nodes: &[Node; 9], within: DVec2) -> Predicted {
    let (across, down) = (quadratic(within.x), quadratic(within.y));
    let mut predicted = Predicted {
        place: DVec2::ZERO,
        flux_w: LinearSrgb::BLACK,
    };
    for (number, node) in nodes.iter().enumerate() {
        let weight = across[number % 3] * down[number / 3];
        predicted.place += node.place.as_dvec2() * weight;
        predicted.flux_w += node.flux_w() * weight;
    }
    // Between points where light nearly vanishes, a parabola may fall below 0.
    predicted.flux_w = predicted.flux_w.map(|watts| watts.max(0.0));
    predicted
}

/// Nodes whose interpolation by triangles, two in each of so many divisions squared, has the means of the biquadratic.
///
/// Chords of a curve lie all on the same side of it. Where triangles are smaller than a texel this is their only error,
/// and that of many squares adds up.
fn unbiased(nodes: &[Node; 9], divisions: usize) -> [Node; 9] {
    // Derivatives of the quadratic at its three nodes, and its second derivative, as weights of these.
    const SLOPE: [[f64; 3]; 3] = [[-3.0, 4.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -4.0, 3.0]];
    const CURVATURE: [f64; 3] = [4.0, -8.0, 4.0];
    // Mean of x², xy and y² over a triangle of the unit square, less that between its corners.
    let scale = 1.0 / (12.0 * (divisions * divisions) as f64);
    std::array::from_fn(|number| {
        let (column, row) = (number % 3, number / 3);
        let (mut place, mut flux_w) = (nodes[number].place.as_dvec2(), nodes[number].flux_w());
        for (other, node) in nodes.iter().enumerate() {
            let (other_column, other_row) = (other % 3, other / 3);
            let mut weight = SLOPE[column][other_column] * SLOPE[row][other_row];
            if other_row == row {
                weight += CURVATURE[other_column];
            }
            if other_column == column {
                weight += CURVATURE[other_row];
            }
            place -= node.place.as_dvec2() * (weight * scale);
            flux_w += node.flux_w() * (-weight * scale);
        }
        Node {
            place: place.as_vec2(),
            flux_w: flux_w.to_array().map(|watts| watts as f32),
        }
    })
}

/// A triangle in which light is linear, moved so that even light in it has the same centre.
fn centred_on_light(corners: [Predicted; 3]) -> [DVec2; 3] {
    let flux = corners.map(|corner| corner.flux_w.max_channel());
    let mean = (flux[0] + flux[1] + flux[2]) / 3.0;
    let places = corners.map(|corner| corner.place);
    if mean <= 0.0 {
        return places;
    }
    let middle = (places[0] + places[1] + places[2]) / 3.0;
    let mut moved = DVec2::ZERO;
    for (place, flux) in places.iter().zip(flux) {
        moved += (*place - middle) * ((flux - mean) / (12.0 * mean));
    }
    places.map(|place| place + moved)
}

/// A triangle that was moved by `moved`, roughly [texels]. Beside a fold, which light does not cross, it is flattened
/// instead, about its middle, so that it reaches no farther than before.
fn off_fold(corners: [DVec2; 3], moved: DVec2) -> [DVec2; 3] {
    // The triangle is thin across its longest side.
    let [a, b, c] = corners;
    let mut longest = b - a;
    for side in [c - b, a - c] {
        if side.length_squared() > longest.length_squared() {
            longest = side;
        }
    }
    let Some(along) = longest.perp().try_normalize() else {
        return corners;
    };
    let along = along * moved.dot(along).signum();
    let distance = moved.dot(along);

    // How far each corner lies behind the foremost.
    let places = corners.map(|corner| corner.dot(along));
    let behind = places.map(|place| places[0].max(places[1]).max(places[2]) - place);
    let thickness = behind[0].max(behind[1]).max(behind[2]);
    if thickness >= distance * BESIDE_FOLD {
        return corners;
    }
    let mean = (behind[0] + behind[1] + behind[2]) / 3.0;
    let flattened = if mean > distance { distance / mean } else { 1.0 };
    let back = distance.min(mean);
    std::array::from_fn(|corner| corners[corner] + along * (behind[corner] * flattened - back))
}

/// A triangle of flux for the map of a bundle's receiver.
pub(super) fn flux_triangle(bundle: &Bundle, corners: [DVec2; 3], flux: [i64; 3]) -> FluxTriangle {
    FluxTriangle {
        corners,
        flux,
        island: bundle.route.island,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sampling::even_point;
    use crate::light_pass::path::PathSignature;
    use crate::light_pass::photon::paths::Chain;

    /// Nodes of a square whose place and flux are these functions.
    fn nodes(place: impl Fn(DVec2) -> DVec2, flux_w: impl Fn(DVec2) -> f64) -> Box<[Node; 9]> {
        Box::new(std::array::from_fn(|node| {
            let within = DVec2::new((node % 3) as f64, (node / 3) as f64) * 0.5;
            Node {
                place: place(within).as_vec2(),
                flux_w: [flux_w(within) as f32; 3],
            }
        }))
    }

    fn route() -> Route {
        Route {
            signature: PathSignature::default(),
            chain: Chain::default(),
            receiver: Receiver::front(0),
            island: 0,
            is_dispersed: false,
            leg_m: 1.0,
        }
    }

    fn curved(within: DVec2) -> DVec2 {
        let DVec2 { x, y } = within;
        DVec2::new(
            3.0 + 5.0 * x - 2.0 * x * x + x * y,
            1.0 + 4.0 * y + y * y - 0.5 * x * y,
        )
    }

    #[test]
    fn parabolas_are_interpolated_exactly() {
        let flux_w = |within: DVec2| 2.0 + within.x - within.x * within.x * within.y;
        let nodes = nodes(curved, flux_w);
        for index in 0..100 {
            let within = even_point(index, 0, 1);
            let predicted = biquadratic(&nodes, within);
            assert!((predicted.place - curved(within)).length() < 1e-5, "{within}");
            assert!((predicted.flux_w.g - flux_w(within)).abs() < 1e-5, "{within}");
        }
    }

    /// The flux of all triangles is that of the square, and their area that of its image.
    #[test]
    fn triangles_carry_the_light_of_the_square() {
        let flux_w = |within: DVec2| 2.0 + within.x + within.y;
        let bundle = Bundle {
            shape: Shape::Whole(nodes(|within| within * DVec2::new(3.0, 2.0), flux_w)),
            divisions: 4,
            ..Bundle::new(route(), 3.0)
        };
        let (mut flux, mut area) = (0.0, 0.0);
        bundle.triangles(0.25, |[a, b, c], flux_w, of_square| {
            flux += flux_w.g * of_square;
            area += 0.5 * (b - a).perp_dot(c - a).abs();
        });
        assert!((flux - 0.25 * 3.0).abs() < 1e-6, "{flux} W");
        assert!((area - 6.0).abs() < 1e-5, "{area} texels");
    }

    /// However coarse it is, a deposit has the centre of the light.
    #[test]
    fn triangles_keep_the_centre_of_the_light() {
        let flux_w = |within: DVec2| 2.0 + within.x;
        let (mut whole, mut centre) = (0.0, DVec2::ZERO);
        for index in 0..1 << 16 {
            let within = even_point(index, 0, 1);
            whole += flux_w(within);
            centre += curved(within) * flux_w(within);
        }
        for divisions in [1, 3] {
            let bundle = Bundle {
                shape: Shape::Whole(nodes(curved, flux_w)),
                divisions,
                ..Bundle::new(route(), 1.0)
            };
            let (mut flux, mut moment) = (0.0, DVec2::ZERO);
            bundle.triangles(1.0, |[a, b, c], flux_w, area| {
                flux += flux_w.g * area;
                moment += (a + b + c) / 3.0 * (flux_w.g * area);
            });
            let off = (moment / flux - centre / whole).length();
            assert!(off < 1e-3, "{divisions} divisions: {off} texels");
        }
    }

    /// A finer deposit errs less, and no more than it is allowed.
    #[test]
    fn deposits_are_as_fine_as_asked() {
        let mut bundle = Bundle {
            shape: Shape::Whole(nodes(|within| curved(within) * 8.0, |within| 1.0 + within.x)),
            ..Bundle::new(route(), 1.0)
        };
        let mut before = 0;
        for allowed in [1e-5, 1e-7, 1e-8] {
            let left = bundle.plan_deposit(1.0, allowed);
            assert!(left <= allowed, "{left} of {allowed}");
            assert!(bundle.divisions > before, "{} divisions", bundle.divisions);
            before = bundle.divisions;
        }

        // A spectrum of many texels has more parts, the less is allowed.
        bundle.shift.hues = [Vec2::ZERO, Vec2::X * 30.0];
        let parts = [1e-4, 1e-6].map(|allowed| {
            bundle.plan_deposit(1.0, allowed);
            bundle.hue_parts
        });
        assert!(parts[0] < parts[1], "{parts:?}");
        assert!(
            parts
                .iter()
                .all(|parts| (HUE_PARTS.0..=HUE_PARTS.1).contains(parts)),
            "{parts:?}"
        );

        // No finer than the lamp shows it.
        bundle.shift.lamp = [Vec2::X * 2.0, Vec2::Y * 2.0];
        bundle.plan_deposit(1.0, 1e-8);
        assert!(bundle.divisions < before, "{} divisions", bundle.divisions);
    }
}
