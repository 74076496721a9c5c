//! False colours by viridis, which is perceptually uniform, also for the colour-blind (Smith and van der Walt, "A
//! Better Default Colormap for Matplotlib", SciPy 2015).

/// Coefficients of t⁰ … t⁶ for red, green and blue: Matt Zucker's fit to the table of viridis, see `assets/SOURCES.md`.
const FIT: [[f64; 3]; 7] = [
    [0.2777273272234177, 0.005407344544966578, 0.3340998053353061],
    [0.1050930431085774, 1.404613529898575, 1.384590162594685],
    [-0.3308618287255563, 0.214847559468213, 0.09509516302823659],
    [-4.634230498983486, -5.799100973351585, -19.33244095627987],
    [6.228269936347081, 14.17993336680509, 56.69055260068105],
    [4.776384997670288, -13.74514537774601, -65.35303263337234],
    [-5.435455855934631, 4.645852612178535, 26.3124352495832],
];

/// Display colour (sRGB in [0, 1]) at a position on the scale, clamped to [0, 1]. Twin of
/// `shaders/shared/false_colours.wgsl`.
pub fn viridis(place: f64) -> [f64; 3] {
    let t = place.clamp(0.0, 1.0);
    std::array::from_fn(|channel| {
        let fit = FIT.iter().rev();
        fit.fold(0.0, |sum, row| sum * t + row[channel]).clamp(0.0, 1.0)
    })
}

/// Display colour (sRGB) at a position in [0, 1] on a scale, interpolated between evenly spaced stops.
pub fn mixed(stops: &[[u8; 3]], place: f64) -> [u8; 3] {
    let place = place * (stops.len() - 1) as f64;
    let index = (place as usize).min(stops.len() - 2);
    let share = place - index as f64;
    std::array::from_fn(|channel| {
        let [a, b] = [0, 1].map(|step| f64::from(stops[index + step][channel]));
        (a + (b - a) * share).round() as u8
    })
}

/// Range of quantities that the colours cover.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColourScale {
    /// Quantity at the dark end; > 0 on a logarithmic scale.
    pub low: f64,
    /// Quantity at the bright end, > low.
    pub high: f64,
    /// Whether equal ratios, rather than equal differences, are equal steps.
    pub is_logarithmic: bool,
}

impl ColourScale {
    /// Position of a quantity: 0 at the dark end, 1 at the bright one, and beyond.
    pub fn place(&self, quantity: f64) -> f64 {
        let [begin, factor] = self.for_shaders();
        (self.steps(quantity) - begin) * factor
    }

    /// The quantity at a position on the scale.
    pub fn at(&self, place: f64) -> f64 {
        if self.is_logarithmic {
            self.low * (self.high / self.low).powf(place)
        } else {
            self.low + (self.high - self.low) * place
        }
    }

    /// Display colour (sRGB in [0, 1]) of a quantity.
    pub fn colour(&self, quantity: f64) -> [f64; 3] {
        viridis(self.place(quantity))
    }

    /// Start of the scale, and the factor of distances from it; in binary orders on a logarithmic scale.
    pub fn for_shaders(&self) -> [f64; 2] {
        let (low, high) = (self.steps(self.low), self.steps(self.high));
        [low, (high - low).recip()]
    }

    fn steps(&self, quantity: f64) -> f64 {
        if self.is_logarithmic {
            quantity.max(f64::MIN_POSITIVE).log2()
        } else {
            quantity
        }
    }
}
