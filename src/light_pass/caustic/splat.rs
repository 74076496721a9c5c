//! One kernel of flux, taken into the texels of a map.

use glam::DVec2;

use super::footprint::Ellipse;
use super::kernel::Profile;
use crate::illumination::accumulator::FluxCount;
use crate::settings::KernelSampling;

/// Footprints thinner than this many texels across are widened to it: far below what a texel can show, and enough for
/// the inverse of a line or a point (at folds and foci).
const THINNEST_TEXELS: f64 = 0.02;

/// A kernel of flux on a map.
#[derive(Clone, Copy, Debug)]
pub struct Splat {
    /// Centre in texel coordinates: texel (i, j) covers [i, i + 1) × [j, j + 1).
    pub centre: DVec2,
    /// Footprint in texel coordinates.
    pub ellipse: Ellipse,
    /// Weight over the footprint.
    pub profile: Profile,
    /// What it carries.
    pub flux: FluxCount,
    /// Which island of the chart it lies on; other islands get nothing of it.
    pub island: u32,
}

/// Which texels of a map a surface covers.
pub trait Coverage: Sync {
    /// Texels across and down.
    fn size(&self) -> (usize, usize);

    /// Whether every texel is covered.
    fn is_full(&self) -> bool;

    /// Whether an island of the chart covers any of a texel.
    fn covers(&self, column: usize, row: usize, island: u32) -> bool;
}

/// Weights of a splat over a window of texels; reused from splat to splat.
#[derive(Debug, Default)]
pub struct Window {
    first_column: i64,
    first_row: i64,
    columns: usize,
    weights: Vec<f64>,
    sum: f64,
}

impl Splat {
    /// Spread of the kernel across its narrowest direction [texels].
    pub fn narrowest_spread(&self) -> f64 {
        let Ellipse { xx, xy, yy } = self.ellipse;
        let half_difference = 0.5 * (xx - yy);
        let least = 0.5 * (xx + yy) - (half_difference * half_difference + xy * xy).sqrt();
        self.profile.scale() * least.max(0.0).sqrt()
    }

    /// The same kernel on a map of 2^−level times the size each way.
    #[must_use]
    pub fn at_level(mut self, level: usize) -> Self {
        let scale = (-(level as f64)).exp2();
        self.centre *= scale;
        self.ellipse = self.ellipse.scaled(scale * scale);
        self
    }

    /// Rows that the kernel reaches, before folding: first and last.
    pub fn rows(&self) -> (i64, i64) {
        let half = self.half_height();
        (
            (self.centre.y - half).floor() as i64,
            (self.centre.y + half).floor() as i64,
        )
    }

    fn half_height(&self) -> f64 {
        self.profile.reach() * self.ellipse.at_least(THINNEST_TEXELS).yy.sqrt()
    }

    fn half_width(&self) -> f64 {
        // The box reaches to its slanted corners.
        let ellipse = self.ellipse.at_least(THINNEST_TEXELS);
        let slant = ellipse.xy.abs() / ellipse.yy.sqrt();
        let chord = (ellipse.xx - slant * slant).max(0.0).sqrt();
        self.profile.reach() * (slant + chord)
    }

    /// Fills `window` with the kernel's weight in each texel. The kernel is cut off one map's size beyond the borders.
    pub fn weigh(&self, sampling: KernelSampling, coverage: &impl Coverage, window: &mut Window) {
        let (width, height) = coverage.size();
        let (half_width, half_height) = (self.half_width(), self.half_height());
        let range = |centre: f64, half: f64, size: usize| {
            let size = size as f64;
            let first = (centre - half).max(-size).floor();
            let last = (centre + half).min(2.0 * size - 0.5).floor();
            (first as i64, (last - first) as usize + 1)
        };
        let (first_column, columns) = range(self.centre.x, half_width, width);
        let (first_row, rows) = range(self.centre.y, half_height, height);
        (window.first_column, window.first_row, window.columns) = (first_column, first_row, columns);
        window.weights.clear();
        window.weights.resize(columns * rows, 0.0);
        if columns * rows == 1 {
            window.weights[0] = 1.0;
        } else {
            match sampling {
                KernelSampling::Integrated => self.integrate(window),
                KernelSampling::Point => self.sample(window),
            }
        }
        if window.weights.iter().all(|&weight| weight <= 0.0) {
            // Between the sample points, or too thin for any: all of it goes where its centre is.
            let column = (self.centre.x.floor() as i64 - first_column).clamp(0, columns as i64 - 1) as usize;
            let row = (self.centre.y.floor() as i64 - first_row).clamp(0, rows as i64 - 1) as usize;
            window.weights[row * columns + column] = 1.0;
        }
        window.mask(self, coverage);
    }

    /// Row of the texel that holds the centre.
    pub fn home_row(&self, height: usize) -> usize {
        (self.centre.y.max(0.0) as usize).min(height - 1)
    }

    /// The kernel's weight at every texel's centre (section 3.2.2 of the paper).
    fn sample(&self, window: &mut Window) {
        let frame = RowFrame::new(self.ellipse.at_least(THINNEST_TEXELS));
        let columns = window.columns;
        for (index, weight) in window.weights.iter_mut().enumerate() {
            let x = (window.first_column + (index % columns) as i64) as f64 + 0.5 - self.centre.x;
            let y = (window.first_row + (index / columns) as i64) as f64 + 0.5 - self.centre.y;
            let t = y / frame.y_radius;
            *weight = self.profile.weight((x - frame.slope * y) / frame.x_radius, t);
        }
    }

    /// The kernel's integral over every texel: exact along a row, by two-point Gauss quadrature across it, on as many
    /// parts as the kernel's shape asks for.
    fn integrate(&self, window: &mut Window) {
        let frame = RowFrame::new(self.ellipse.at_least(THINNEST_TEXELS));
        let half_height = self.profile.reach() * frame.y_radius;
        let columns = window.columns;
        let smooth = frame.is_smooth(self.profile.scale());
        for (index, weights) in window.weights.chunks_mut(columns).enumerate() {
            let row = (window.first_row + index as i64) as f64 - self.centre.y;
            let (low, high) = (row.max(-half_height), (row + 1.0).min(half_height));
            if high <= low {
                continue;
            }
            let parts = frame.parts(high - low, self.profile.scale());
            let part = (high - low) / f64::from(parts);
            let first = window.first_column as f64 - self.centre.x;
            if smooth {
                self.integrate_row(&frame, 0.5 * (low + high), first, high - low, weights);
                continue;
            }
            for node in 0..2 * parts {
                let offset = f64::from(node / 2) + if node % 2 == 0 { GAUSS_LOW } else { 1.0 - GAUSS_LOW };
                self.integrate_row(&frame, low + part * offset, first, 0.5 * part, weights);
            }
        }
    }

    /// Adds the integrals along one line at height `y` to the texels from `first` on, both relative to the centre.
    fn integrate_row(&self, frame: &RowFrame, y: f64, first: f64, factor: f64, weights: &mut [f64]) {
        let t = y / frame.y_radius;
        let half_chord = self.profile.half_chord(t);
        let middle = frame.slope * y;
        let begin = (middle - half_chord * frame.x_radius - first).floor().max(0.0) as usize;
        let end = (middle + half_chord * frame.x_radius - first).ceil().max(0.0) as usize;
        let end = end.min(weights.len());
        let along = |x: f64| ((x - middle) / frame.x_radius).clamp(-half_chord, half_chord);
        let mut before = self.profile.chord_integral(along(first + begin as f64), t);
        let factor = factor * frame.x_radius;
        for (column, weight) in weights.iter_mut().enumerate().take(end).skip(begin) {
            let after = self.profile.chord_integral(along(first + (column + 1) as f64), t);
            *weight += factor * (after - before);
            before = after;
        }
    }
}

/// Lower node of the two-point Gauss-Legendre rule on [0, 1]: (1 − 1/√3)/2.
const GAUSS_LOW: f64 = 0.211_324_865_405_187_1;

/// The ellipse as rows cut it: at height y the chord's middle is at slope·y, and (s, t) = ((x − slope·y)/x_radius,
/// y/y_radius) makes it the unit disc.
struct RowFrame {
    y_radius: f64,
    x_radius: f64,
    slope: f64,
}

impl RowFrame {
    /// Whether the kernel changes so little within a row that one line stands for it: the midpoint rule then errs by
    /// less than 1/24 of the square of the row's height in spreads, below 0.3 %.
    fn is_smooth(&self, scale: f64) -> bool {
        scale * self.y_radius >= 4.0 && self.slope.abs() <= 0.25 * scale * self.x_radius
    }

    fn new(ellipse: Ellipse) -> Self {
        let slope = ellipse.xy / ellipse.yy;
        // Not below the floor that `at_least` gave both axes, whatever cancels.
        let x2 = (ellipse.xx - slope * ellipse.xy).max(0.5 * THINNEST_TEXELS * THINNEST_TEXELS);
        Self {
            y_radius: ellipse.yy.sqrt(),
            x_radius: x2.sqrt(),
            slope,
        }
    }

    /// Parts of a row's height that resolve both the kernel's change with y and the chord's way across texels.
    fn parts(&self, height: f64, scale: f64) -> u32 {
        let by_change = height / (1.4 * scale * self.y_radius);
        let by_slant = height * self.slope.abs() / (1.0 + 1.4 * scale * self.x_radius);
        by_change.max(by_slant).ceil().clamp(1.0, 8.0) as u32
    }
}

impl Window {
    /// Takes weights off texels that the splat's island does not cover; what is left is normalised by the sum, so
    /// that no flux is lost there.
    fn mask(&mut self, splat: &Splat, coverage: &impl Coverage) {
        if coverage.is_full() {
            self.sum = self.weights.iter().sum();
            return;
        }
        self.sum = 0.0;
        let (width, height) = coverage.size();
        for (index, weight) in self.weights.iter_mut().enumerate() {
            let column = fold(self.first_column + (index % self.columns) as i64, width);
            let row = fold(self.first_row + (index / self.columns) as i64, height);
            if *weight > 0.0 && !coverage.covers(column, row, splat.island) {
                *weight = 0.0;
            }
            self.sum += *weight;
        }
    }

    /// Whether any texel takes part of the kernel.
    pub fn is_placed(&self) -> bool {
        self.sum > 0.0
    }

    /// Adds the splat's flux to the texels of the rows `rows.0..rows.1`, which `texels` holds; returns what was added.
    ///
    /// Each texel gets the nearest count of its share, and the heaviest one the rest, so that the whole is exact. What
    /// reaches beyond the map's border is folded back: the ray landed on the surface, and so does its light.
    pub fn add(
        &self,
        flux: FluxCount,
        size: (usize, usize),
        rows: (usize, usize),
        texels: &mut [FluxCount],
    ) -> FluxCount {
        let mut target = Target {
            size,
            rows,
            texels,
            added: [0; 3],
        };
        let mut rest = flux;
        let (mut heaviest, mut most) = (0, 0.0);
        let scale = flux.map(|channel| channel as f64 / self.sum);
        let grey = flux[0] == flux[1] && flux[1] == flux[2];
        for (line, weights) in self.weights.chunks(self.columns).enumerate() {
            let row = target.row(self.first_row + line as i64);
            for (offset, &weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                if weight > most {
                    (heaviest, most) = (line * self.columns + offset, weight);
                }
                let share = if grey {
                    [nearest(scale[0] * weight); 3]
                } else {
                    scale.map(|channel| nearest(channel * weight))
                };
                for channel in 0..3 {
                    rest[channel] -= share[channel];
                }
                target.add(row, self.first_column + offset as i64, share);
            }
        }
        let row = target.row(self.first_row + (heaviest / self.columns) as i64);
        target.add(row, self.first_column + (heaviest % self.columns) as i64, rest);
        target.added
    }
}

/// The nearest whole number of a share of flux, which is never negative; without a call into the mathematics library.
fn nearest(share: f64) -> i64 {
    (share + 0.5) as i64
}

/// Some rows of a map, being added to.
struct Target<'a> {
    size: (usize, usize),
    rows: (usize, usize),
    texels: &'a mut [FluxCount],
    added: FluxCount,
}

impl Target<'_> {
    /// Where the texels of a row begin, if it is one of ours.
    fn row(&self, row: i64) -> Option<usize> {
        let row = fold(row, self.size.1);
        (row >= self.rows.0 && row < self.rows.1).then(|| (row - self.rows.0) * self.size.0)
    }

    fn add(&mut self, row: Option<usize>, column: i64, share: FluxCount) {
        let Some(begin) = row else { return };
        let texel = &mut self.texels[begin + fold(column, self.size.0)];
        for channel in 0..3 {
            texel[channel] += share[channel];
            self.added[channel] += share[channel];
        }
    }
}

/// Index in 0..size of an index up to one size beyond either border, mirrored at the border.
pub fn fold(index: i64, size: usize) -> usize {
    let size = size as i64;
    let folded = if index < 0 {
        -1 - index
    } else if index >= size {
        2 * size - 1 - index
    } else {
        index
    };
    folded.clamp(0, size - 1) as usize
}
