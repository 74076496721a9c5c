//! The image of a square on the map, and how finely it has to be divided for its deposit.

use super::bundle::Node;

/// Maximum number of divisions of a square's sides for its deposit.
const MAX_DIVISIONS: usize = 64;

/// Largest distance between a curve and its chord in a deposit [texels]. Between a flattened triangle beside a fold and
/// the next one is a gap of two thirds of it.
const MAX_CHORD_TEXELS: f64 = 0.06;

/// Relative errors of a deposit: of curves, per distance of a chord over its part of the image's width, and of light
/// that varies, per variation in a part. With these, deposits of the built-in scenes with a reference have half to nine
/// tenths of the planned error, at 32 x 32 and 256 x 256.
const ERROR_PER_CHORD: f64 = 0.65;
const ERROR_PER_VARIATION: f64 = 0.15;

/// Images at least so wide are smooth enough to be moved by bilinear weights [texels].
pub(super) const SMOOTH_TEXELS: f64 = 1.5;

/// The four quarters of a square, as nodes row by row.
const QUARTERS: [[usize; 4]; 4] = [[0, 1, 3, 4], [1, 2, 4, 5], [3, 4, 6, 7], [4, 5, 7, 8]];

/// Size of the image of a whole square on the map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Image {
    /// Longest side along an axis of the map [texels].
    length: f64,
    /// Area over length [texels].
    width: f64,
    /// Largest deviation of a node from the middle between its neighbours [texels].
    pub(super) bend: f64,
    /// Difference of irradiance from end to end, relative to its mean: twice the largest between quarters.
    variation: f64,
    /// Width of the lamp's image [texels].
    blur: f64,
}

impl Image {
    pub(super) fn of(nodes: &[Node; 9]) -> Self {
        // Extents are measured along the axes of the map, as texels are.
        let place = |node: usize| nodes[node].place.as_dvec2();
        let (mut low, mut high) = (place(0), place(0));
        for node in 1..9 {
            low = low.min(place(node));
            high = high.max(place(node));
        }

        // The chord over a whole side errs most at its middle node; chords over n parts of a parabola err n² times
        // less.
        let mut bend = 0.0_f64;
        for [a, b, c] in [[0, 1, 2], [3, 4, 5], [6, 7, 8], [0, 3, 6], [1, 4, 7], [2, 5, 8]] {
            bend = bend.max((0.5 * (place(a) + place(c)) - place(b)).abs().max_element());
        }

        // Area and irradiance of each quarter.
        let (mut area, mut darkest, mut brightest) = (0.0, f64::INFINITY, 0.0_f64);
        for [a, b, c, d] in QUARTERS {
            let across = place(b) - place(a);
            let diagonal = place(d) - place(a);
            let down = place(c) - place(a);
            let quarter = 0.5 * (across.perp_dot(diagonal).abs() + diagonal.perp_dot(down).abs());
            let flux_w: f64 = [a, b, c, d]
                .iter()
                .map(|&node| nodes[node].flux_w().max_channel())
                .sum();
            let light = flux_w / quarter.max(1e-12);
            darkest = darkest.min(light);
            brightest = brightest.max(light);
            area += quarter;
        }

        // Area over length makes a thin image thin in any direction.
        let length = (high - low).max_element();
        Self {
            length,
            width: area / length.max(1e-9),
            bend,
            variation: 4.0 * (brightest - darkest) / (brightest + darkest).max(f64::MIN_POSITIVE),
            blur: 0.0,
        }
    }

    /// For a lamp whose image has this width [texels].
    pub(super) fn blurred(self, blur: f64) -> Self {
        Self { blur, ..self }
    }

    pub(super) fn is_smooth(&self) -> bool {
        self.width >= SMOOTH_TEXELS
    }

    /// Finest detail of a deposit that is seen [texels]: a texel, or the image of the lamp.
    fn detail(&self) -> f64 {
        self.blur.max(1.0)
    }

    /// Texels that the image covers, at least one detail along each axis.
    fn spread_texels(&self) -> f64 {
        self.length.max(self.detail()) * self.width.max(self.detail())
    }

    /// Parts of a spectrum that is so long on the map [texels] for which this flux errs by `allowed`: wavelengths are
    /// drawn from each part, so that its image is displaced by up to half of the part's length.
    pub(super) fn hue_parts(&self, across: f64, flux: f64, allowed: f64) -> f64 {
        let displaced = across / 12_f64.sqrt() / self.width.max(self.detail());
        let error = (self.spread_texels() * allowed).sqrt();
        (displaced * flux / error.max(f64::MIN_POSITIVE)).ceil()
    }

    /// Squared error that a deposit in n² parts of this flux leaves, and the least n for which it is at most
    /// `allowed`: chords in the place of curves, and even light in each triangle.
    pub(super) fn divisions(&self, flux: f64, allowed: f64) -> (usize, f64) {
        let least = (self.bend / (MAX_CHORD_TEXELS * self.detail()))
            .sqrt()
            .ceil()
            .clamp(1.0, MAX_DIVISIONS as f64) as usize;
        let error = |divisions: usize| {
            let parts = divisions as f64;
            let chord = self.bend / (parts * parts);
            let moved = (ERROR_PER_CHORD * chord / (self.width / parts).max(self.detail())).min(1.0);
            let shade = if self.length / parts < self.detail() {
                0.0
            } else {
                ERROR_PER_VARIATION * self.variation / parts
            };
            flux * flux / self.spread_texels() * (moved * moved + shade * shade)
        };
        let divisions = (least..MAX_DIVISIONS)
            .find(|&n| error(n) <= allowed)
            .unwrap_or(MAX_DIVISIONS);
        (divisions, error(divisions))
    }
}
