//! Deposits one kernel of flux into the texels of a map.

use glam::{DVec2, Vec2Swizzles};

use super::blocks::Block;
use super::footprint::Ellipse;
use super::gaussian::{Centred, Cornered, WIDE_TEXELS};
use super::kernel::Profile;
use super::numeric::{floor, round};
use crate::illumination::accumulator::FluxCount;
use crate::light_pass::receiver_maps::Coverage;
use crate::settings::KernelSampling;

/// Footprints thinner than this [texels] are widened to it: far below what a texel can show, and enough for the inverse
/// of a line or a point (at folds and foci).
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
    pub flux: FluxCount,
    /// Island of the chart; other islands get none of the flux.
    pub island: u32,
}

/// Weights of a splat in the texels that it reaches; reused from splat to splat.
///
/// Texels are stored line by line. Lines are rows, or columns where the footprint is wider than high: a line then never
/// crosses it at more than 45°, however thin it is.
#[derive(Debug, Default)]
pub struct Window {
    /// Whether lines are columns.
    columns: bool,
    lines: Vec<Line>,
    weights: Vec<f64>,
    sum: f64,
    cornered: Cornered,
}

/// Consecutive texels of one row or column.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// Index of the row (column), before folding.
    index: i64,
    /// Column (row) of the first texel, before folding.
    first: i64,
    /// Range of its weights.
    span: (usize, usize),
}

impl Splat {
    /// Spread of the kernel in its narrowest direction [texels].
    pub fn narrowest_spread(&self) -> f64 {
        let Ellipse { xx, xy, yy } = self.ellipse;
        let half_difference = 0.5 * (xx - yy);
        let least = 0.5 * (xx + yy) - (half_difference * half_difference + xy * xy).sqrt();
        self.profile.scale() * least.max(0.0).sqrt()
    }

    /// Upper bound on [`Self::narrowest_spread`], and cheaper.
    pub fn narrower_spread(&self) -> f64 {
        self.profile.scale() * self.ellipse.xx.min(self.ellipse.yy).max(0.0).sqrt()
    }

    /// The same kernel on a map of 2^−level times the size in both directions.
    #[must_use]
    pub fn at_level(mut self, level: usize) -> Self {
        let scale = (-(level as f64)).exp2();
        self.centre *= scale;
        self.ellipse = self.ellipse.scaled(scale * scale);
        self
    }

    /// First and last column and row that the kernel may reach, before folding. It is truncated one map's size beyond
    /// the borders.
    pub fn columns_and_rows(&self) -> ((i64, i64), (i64, i64)) {
        let ellipse = self.ellipse.at_least(THINNEST_TEXELS);
        let range = |centre: f64, along: f64, across: f64| {
            // Where lines lie across, a box reaches to its slanted corners: with a = |xy|/√across, to a + √(along −
            // a²), at most √2 √along.
            let slant = if along < across { 2.0 } else { 1.0 };
            let half = self.profile.reach() * (slant * along).sqrt();
            (floor(centre - half) - 1, floor(centre + half) + 1)
        };
        (
            range(self.centre.x, ellipse.xx, ellipse.yy),
            range(self.centre.y, ellipse.yy, ellipse.xx),
        )
    }

    /// Fills `window` with the kernel's weight in each texel. The kernel is truncated one map's size beyond the
    /// borders.
    pub fn weigh(&self, sampling: KernelSampling, coverage: &impl Coverage, window: &mut Window) {
        let ellipse = self.ellipse.at_least(THINNEST_TEXELS);
        let smooth = self
            .profile
            .deviation()
            .filter(|_| sampling == KernelSampling::Integrated);
        let covariance = smooth.map(|deviation| ellipse.scaled(deviation * deviation));
        let is_wide = covariance.is_some()
            && self.narrower_spread() >= WIDE_TEXELS
            && self.narrowest_spread() >= WIDE_TEXELS;
        let small = covariance.filter(|_| !is_wide);
        if small.is_none_or(|covariance| !window.integrate(self.centre, covariance, coverage.size())) {
            let wide = covariance.filter(|_| is_wide);
            self.weigh_by_lines(sampling, ellipse, wide, coverage.size(), window);
        }
        window.mask(self, coverage);
    }

    /// Fills `window` line by line; for a wide Gaussian, given by its covariance [texels²], from samples at the texels'
    /// centres.
    fn weigh_by_lines(
        &self,
        sampling: KernelSampling,
        ellipse: Ellipse,
        wide: Option<Ellipse>,
        (width, height): (usize, usize),
        window: &mut Window,
    ) {
        // Lines run along the footprint's shorter extent; if they are columns, the kernel is transposed.
        window.clear(ellipse.xx > ellipse.yy);
        let (frame, centre, size, wide) = if window.columns {
            (
                LineFrame::new(ellipse.transposed()),
                self.centre.yx(),
                (height, width),
                wide.map(Ellipse::transposed),
            )
        } else {
            (LineFrame::new(ellipse), self.centre, (width, height), wide)
        };

        // A texel that holds all of the kernel needs no integral.
        self.lay_out(&frame, centre, size, window);
        if window.weights.len() == 1 {
            window.weights[0] = 1.0;
        } else if let Some(covariance) = wide {
            window.fill(&Centred::new(covariance), centre);
        } else {
            for line in 0..window.lines.len() {
                match sampling {
                    KernelSampling::Integrated => self.integrate(&frame, centre, line, window),
                    KernelSampling::Point => self.sample(&frame, centre, line, window),
                }
            }
        }
        if window.weights.iter().all(|&weight| weight <= 0.0) {
            // Between the sample points, or too thin for any: all of it goes to the texel of its centre.
            let columns = window.columns;
            window.clear(columns);
            window.push(centre.y.floor() as i64, centre.x.floor() as i64, 1);
            window.weights[0] = 1.0;
        }
    }

    /// Lists the texels that the kernel reaches, line by line.
    fn lay_out(&self, frame: &LineFrame, centre: DVec2, size: (usize, usize), window: &mut Window) {
        let half = self.profile.reach() * frame.y_radius;
        let limits = |size: usize| (-(size as f64), 2.0 * size as f64 - 0.5);
        let (least_line, last_line) = limits(size.1);
        let (least, last) = limits(size.0);
        let first_line = floor((centre.y - half).max(least_line));
        let last_line = floor((centre.y + half).min(last_line));
        for index in first_line..=last_line {
            let (low, high) = LineFrame::within(index as f64 - centre.y, half);
            // The chord is longest where the line comes closest to the centre.
            let nearest = 0.0_f64.clamp(low.min(high), high);
            let chord = self.profile.half_chord(nearest / frame.y_radius) * frame.x_radius;
            let (a, b) = (frame.slope * low, frame.slope * high);
            let begin = floor((centre.x + a.min(b) - chord).max(least));
            let end = floor((centre.x + a.max(b) + chord).min(last));
            if high > low && end >= begin {
                window.push(index, begin, (end - begin) as usize + 1);
            }
        }
    }

    /// Samples the kernel at the texels' centres along a line (section 3.2.2 of the paper).
    fn sample(&self, frame: &LineFrame, centre: DVec2, line: usize, window: &mut Window) {
        let Line { index, first, span } = window.lines[line];
        let y = index as f64 + 0.5 - centre.y;
        for (offset, weight) in window.weights[span.0..span.1].iter_mut().enumerate() {
            let x = (first + offset as i64) as f64 + 0.5 - centre.x;
            *weight = self
                .profile
                .weight((x - frame.slope * y) / frame.x_radius, y / frame.y_radius);
        }
    }

    /// Integrates the kernel over every texel of a line: exactly along it, by two-point Gauss quadrature across it, on
    /// as many parts as the kernel's shape requires.
    fn integrate(&self, frame: &LineFrame, centre: DVec2, line: usize, window: &mut Window) {
        let Line { index, first, span } = window.lines[line];
        let (low, high) = LineFrame::within(index as f64 - centre.y, self.profile.reach() * frame.y_radius);
        let first = first as f64 - centre.x;
        let weights = &mut window.weights[span.0..span.1];
        if frame.is_smooth(self.profile.scale()) {
            return self.integrate_row(frame, 0.5 * (low + high), first, high - low, weights);
        }
        let parts = frame.parts(high - low, self.profile.scale());
        let part = (high - low) / f64::from(parts);
        for node in 0..2 * parts {
            let offset = f64::from(node / 2) + if node % 2 == 0 { GAUSS_LOW } else { 1.0 - GAUSS_LOW };
            self.integrate_row(frame, low + part * offset, first, 0.5 * part, weights);
        }
    }

    /// Adds the integrals along one line at height `y` to the texels from `first` on, both relative to the centre.
    fn integrate_row(&self, frame: &LineFrame, y: f64, first: f64, factor: f64, weights: &mut [f64]) {
        let t = y / frame.y_radius;
        let half_chord = self.profile.half_chord(t);
        let middle = frame.slope * y;
        let reach = half_chord * frame.x_radius;
        // Casts round towards zero and saturate at it.
        let begin = (middle - reach - first).max(0.0) as usize;
        let end = ((middle + reach - first).max(0.0) as usize + 1).min(weights.len());
        let factor = factor * frame.x_radius;
        let line = self.profile.line(t);
        let scale = 1.0 / frame.x_radius;
        let along = |x: f64| line.integral(((x - middle) * scale).clamp(-half_chord, half_chord));
        let mut before = along(first + begin as f64);
        for (column, weight) in weights.iter_mut().enumerate().take(end).skip(begin) {
            let after = along(first + (column + 1) as f64);
            *weight += factor * (after - before);
            before = after;
        }
    }
}

/// Lower node of the two-point Gauss-Legendre rule on [0, 1]: (1 − 1/√3)/2.
const GAUSS_LOW: f64 = 0.211_324_865_405_187_1;

/// The ellipse as lines cut it (x along a line, y across): at height y the chord's middle is at slope·y, and (s, t) =
/// ((x − slope·y)/x_radius, y/y_radius) maps it to the unit disc.
struct LineFrame {
    y_radius: f64,
    x_radius: f64,
    slope: f64,
}

impl LineFrame {
    /// The part of the interval from `line` to `line` + 1 within `half` of the centre; empty where low ≥ high.
    fn within(line: f64, half: f64) -> (f64, f64) {
        (line.max(-half), (line + 1.0).min(half))
    }

    /// Whether the kernel changes so little within a row that one line represents it: the midpoint rule then errs by
    /// less than 1/24 of the square of the row's height in spreads, below 0.3 %.
    fn is_smooth(&self, scale: f64) -> bool {
        scale * self.y_radius >= 4.0 && self.slope.abs() <= 0.25 * scale * self.x_radius
    }

    fn new(ellipse: Ellipse) -> Self {
        let slope = ellipse.xy / ellipse.yy;
        // Cancellation must not push it below the floor that `at_least` gave both axes.
        let x2 = (ellipse.xx - slope * ellipse.xy).max(0.5 * THINNEST_TEXELS * THINNEST_TEXELS);
        Self {
            y_radius: ellipse.yy.sqrt(),
            x_radius: x2.sqrt(),
            slope,
        }
    }

    /// Parts of a row's height that resolve both the kernel's change with y and the chord's drift across texels.
    fn parts(&self, height: f64, scale: f64) -> u32 {
        let by_change = height / (1.4 * scale * self.y_radius);
        let by_slant = height * self.slope.abs() / (1.0 + 1.4 * scale * self.x_radius);
        by_change.max(by_slant).ceil().clamp(1.0, 8.0) as u32
    }
}

impl Window {
    fn clear(&mut self, columns: bool) {
        self.columns = columns;
        self.lines.clear();
        self.weights.clear();
    }

    fn push(&mut self, index: i64, first: i64, count: usize) {
        let begin = self.weights.len();
        self.weights.resize(begin + count, 0.0);
        self.lines.push(Line {
            index,
            first,
            span: (begin, begin + count),
        });
    }

    /// Integrates a small Gaussian over its texels; returns whether that was possible.
    fn integrate(&mut self, centre: DVec2, covariance: Ellipse, (width, height): (usize, usize)) -> bool {
        let Some(block) = self.cornered.integrate(centre, covariance, &mut self.weights) else {
            return false;
        };
        let fits = |first: i64, count: usize, size: usize| {
            first >= -(size as i64) && first + count as i64 <= 2 * size as i64
        };
        let (columns, rows) = block.size;
        if !(fits(block.first.0, columns, width) && fits(block.first.1, rows, height)) {
            return false;
        }
        self.columns = false;
        self.lines.clear();
        self.lines.extend((0..rows).map(|row| Line {
            index: block.first.1 + row as i64,
            first: block.first.0,
            span: (row * columns, (row + 1) * columns),
        }));
        true
    }

    /// Samples a wide Gaussian at the texels' centres.
    fn fill(&mut self, kernel: &Centred, centre: DVec2) {
        for Line { index, first, span } in &self.lines {
            let x = *first as f64 + 0.5 - centre.x;
            let y = *index as f64 + 0.5 - centre.y;
            kernel.fill_row(x, y, &mut self.weights[span.0..span.1]);
        }
    }

    /// Column and row of a texel of a line, before folding.
    fn place(&self, line: &Line, offset: usize) -> (i64, i64) {
        let along = line.first + offset as i64;
        if self.columns {
            (line.index, along)
        } else {
            (along, line.index)
        }
    }

    /// Removes weights of texels that the splat's island does not cover. The remaining weights are normalised by their
    /// sum, so that no flux is lost.
    fn mask(&mut self, splat: &Splat, coverage: &impl Coverage) {
        if !coverage.is_full() {
            let (width, height) = coverage.size();
            for line in &self.lines {
                for offset in 0..line.span.1 - line.span.0 {
                    let (column, row) = self.place(line, offset);
                    let weight = self.weights[line.span.0 + offset];
                    if weight > 0.0 && !coverage.covers(fold(column, width), fold(row, height), splat.island)
                    {
                        self.weights[line.span.0 + offset] = 0.0;
                    }
                }
            }
        }
        self.sum = self.weights.iter().sum();
    }

    /// Whether any texel takes part of the kernel.
    pub fn is_placed(&self) -> bool {
        self.sum > 0.0
    }

    /// Adds the splat's flux to the texels of a map of the given size; `block` has to contain all that the kernel
    /// reaches.
    ///
    /// Each texel gets its share rounded to counts, and the heaviest one the remainder, so that the sum is exact. What
    /// reaches beyond the map's border is folded back: the ray landed on the surface, and so does its light.
    pub fn add(&self, flux: FluxCount, size: (usize, usize), block: &mut Block) {
        // The fast rounding is for numbers below 2⁵¹ alone.
        let mut rest = flux;
        let (mut heaviest, mut most) = ((0, 0), -1.0);
        let per_weight = 1.0 / self.sum;
        let scale = flux.map(|channel| channel as f64 * per_weight);
        let grey = flux[0] == flux[1] && flux[1] == flux[2];
        let is_large = flux.iter().any(|&channel| channel >= 1 << 50);
        let part = |share: f64| {
            if is_large {
                (share + 0.5) as i64
            } else {
                round(share).1
            }
        };
        let share = |weight: f64| {
            if grey {
                [part(scale[0] * weight); 3]
            } else {
                scale.map(|channel| part(channel * weight))
            }
        };

        // The heaviest texel is the one where the remainder of the rounding shows least.
        for line in &self.lines {
            let weights = &self.weights[line.span.0..line.span.1];
            let (offset, weight) = largest(weights);
            if weight > most {
                (heaviest, most) = (self.place(line, offset), weight);
            }
            let mut add = |texel: &mut FluxCount, weight: f64| {
                let share = share(weight);
                for channel in 0..3 {
                    texel[channel] += share[channel];
                    rest[channel] -= share[channel];
                }
            };

            // A row within the map needs no folding.
            if let Some((column, row)) = self.inside(line, size) {
                let texels = block.row_mut(column, row, weights.len());
                texels
                    .iter_mut()
                    .zip(weights)
                    .for_each(|(texel, &weight)| add(texel, weight));
            } else {
                for (offset, &weight) in weights.iter().enumerate() {
                    add(texel_mut(block, self.place(line, offset), size), weight);
                }
            }
        }
        let texel = texel_mut(block, heaviest, size);
        for channel in 0..3 {
            texel[channel] += rest[channel];
        }
    }

    /// Column and row of a line's first texel, if the line is a row segment entirely within the map.
    fn inside(&self, line: &Line, (width, height): (usize, usize)) -> Option<(usize, usize)> {
        let column = usize::try_from(line.first).ok().filter(|_| !self.columns)?;
        let row = usize::try_from(line.index).ok().filter(|&row| row < height)?;
        (column + line.span.1 - line.span.0 <= width).then_some((column, row))
    }
}

/// A texel given by its position before folding.
fn texel_mut(block: &mut Block, (column, row): (i64, i64), size: (usize, usize)) -> &mut FluxCount {
    &mut block.row_mut(fold(column, size.0), fold(row, size.1), 1)[0]
}

/// Index and value of the first of the largest weights; weights are not negative.
fn largest(weights: &[f64]) -> (usize, f64) {
    let mut largest = (0, 0.0);
    for (offset, &weight) in weights.iter().enumerate() {
        if weight > largest.1 {
            largest = (offset, weight);
        }
    }
    largest
}

/// Mirrors an index up to one size beyond either border into 0..size.
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
