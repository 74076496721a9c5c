//! The distribution function of two correlated normal variables, along rows of texel corners.

use super::gaussian::MAX_TEXELS;
use super::kernel::{SQRT_HALF_PI, half_normal_integral};
use super::numeric::exp;

/// Gauss-Legendre nodes and weights on [0, 1].
type Rule = &'static [(f64, f64)];

/// Correlation above which the expansion about full correlation errs by less than 2e-5.
const STRONG: f64 = 0.9;

/// Distribution function of two correlated normal variables at all borders of a row.
#[derive(Debug, Default)]
pub(super) struct BivariateNormal {
    correlation: f64,
    nodes: [Node; 8],
    /// Number of nodes.
    count: usize,
}

/// A node of the integral over r from 0 to the correlation.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    /// 1/(2(1 − r²)) and r/(1 − r²).
    square: f64,
    cross: f64,
    /// The node's weight times the density along each border.
    density: [f64; MAX_TEXELS],
}

/// Borders along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Borders<'a> {
    /// Ascending, a fixed step apart [standard deviations].
    pub(super) at: &'a [f64],
    /// Share of the kernel below each border.
    pub(super) below: &'a [f64],
}

impl BivariateNormal {
    /// For a correlation below 1 in magnitude, with the borders of one axis.
    pub(super) fn set(&mut self, borders: &[f64], correlation: f64) {
        self.correlation = correlation;
        let rule = rule(correlation.abs());
        self.count = rule.len();
        for (node, (place, weight)) in self.nodes.iter_mut().zip(rule) {
            let r = correlation * place;
            let rest = 1.0 / (1.0 - r * r);
            node.square = 0.5 * rest;
            node.cross = r * rest;
            let factor = weight * correlation * rest.sqrt() * (1.0 / std::f64::consts::TAU);
            for (density, u) in node.density.iter_mut().zip(borders) {
                *density = factor * exp(-node.square * u * u);
            }
        }
    }

    /// Shares of the kernel below each of the borders given to [`Self::set`] and below the border `v` of the other
    /// axis, below which lies a share of `below` in all.
    pub(super) fn shares(&self, borders: Borders, v: f64, below: f64, shares: &mut [f64]) {
        if self.correlation.abs() > STRONG {
            self.strong(borders, v, below, shares);
        } else {
            self.weak(borders, v, below, shares);
        }
    }

    /// The product of both axes' distributions plus the contribution of the correlation (Plackett 1954): the integral
    /// over r from 0 to the correlation of the density of two variables of correlation r. Exponentials run along the
    /// borders by recurrence.
    fn weak(&self, borders: Borders, v: f64, below: f64, shares: &mut [f64]) {
        for (share, left) in shares.iter_mut().zip(borders.below) {
            *share = left * below;
        }
        let Some(&first) = borders.at.first() else {
            return;
        };
        for node in &self.nodes[..self.count] {
            let mut along = exp(v * (node.cross * first - node.square * v));
            let ratio = match borders.at.get(1) {
                Some(second) => exp(node.cross * v * (second - first)),
                None => 1.0,
            };
            for (share, density) in shares.iter_mut().zip(&node.density[..borders.at.len()]) {
                *share += density * along;
                along *= ratio;
            }
        }
    }

    /// The distribution of fully correlated variables minus the integral of the same density from the correlation to 1,
    /// by expansion in √(1 − r²) (Genz 2004, without the remainder that he integrates numerically).
    fn strong(&self, borders: Borders, v: f64, below: f64, shares: &mut [f64]) {
        let square = 1.0 - self.correlation * self.correlation;
        let root = square.sqrt();
        for ((share, &u), &left) in shares.iter_mut().zip(borders.at).zip(borders.below) {
            *share = if self.correlation > 0.0 {
                left.min(below) - missing(u, v, square, root)
            } else {
                // The mirrored kernel.
                (left + below - 1.0).max(0.0) + missing(u, -v, square, root)
            };
        }
    }
}

/// See [`BivariateNormal::strong`]; `square` is 1 − r², `root` its square root.
fn missing(u: f64, v: f64, square: f64, root: f64) -> f64 {
    let distance = (u - v).abs();
    let x = distance / root;
    if x > 4.0 {
        return 0.0;
    }
    let (d2, product) = (distance * distance, u * v);
    let c = (4.0 - product) * 0.125;
    let d = (12.0 - product) * 0.0625;
    let near = root
        * exp(-0.5 * x * x)
        * (1.0 - c * (d2 - square) * (1.0 - d * d2 * 0.2) / 3.0 + c * d * square * square * 0.2);
    let tail = SQRT_HALF_PI - half_normal_integral(x);
    let far = tail * distance * (1.0 - c * d2 * (1.0 - d * d2 * 0.2) / 3.0);
    exp(-0.5 * product) * (near - far) * (1.0 / std::f64::consts::TAU)
}

/// The cheapest rule that errs by less than 1e-5 of the kernel at a correlation.
fn rule(correlation: f64) -> Rule {
    match correlation {
        c if c < 1e-6 => &[],
        c if c <= 0.1 => &RULE_1,
        c if c <= 0.4 => &RULE_2,
        c if c <= 0.6 => &RULE_3,
        c if c <= 0.8 => &RULE_5,
        c if c <= STRONG => &RULE_8,
        _ => &[],
    }
}

const RULE_1: [(f64, f64); 1] = [(0.5, 1.0)];

const RULE_2: [(f64, f64); 2] = [(0.211_324_865_405_187, 0.5), (0.788_675_134_594_813, 0.5)];

const RULE_3: [(f64, f64); 3] = [
    (0.112_701_665_379_258, 0.277_777_777_777_778),
    (0.5, 0.444_444_444_444_444),
    (0.887_298_334_620_742, 0.277_777_777_777_778),
];

const RULE_5: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_095),
    (0.230_765_344_947_158, 0.239_314_335_249_683),
    (0.5, 0.284_444_444_444_444),
    (0.769_234_655_052_841, 0.239_314_335_249_683),
    (0.953_089_922_969_332, 0.118_463_442_528_095),
];

const RULE_8: [(f64, f64); 8] = [
    (0.019_855_071_751_232, 0.050_614_268_145_189),
    (0.101_666_761_293_187, 0.111_190_517_226_687),
    (0.237_233_795_041_836, 0.156_853_322_938_943),
    (0.408_282_678_752_175, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164, 0.156_853_322_938_943),
    (0.898_333_238_706_813, 0.111_190_517_226_687),
    (0.980_144_928_248_768, 0.050_614_268_145_189),
];
