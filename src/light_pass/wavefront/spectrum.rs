//! Wavelength as one more smooth dimension of the wavefront: a ray is traced at three wavelengths, and where all three go
//! the same ways the light between them is interpolated along 1/λ².

use std::ops::RangeInclusive;

use super::strand::{Landing, Strand};
use crate::geometry::Ray;
use crate::optics::spectrum::{Spectrum, Xyz, xyz_bar};
use crate::optics::{ColourBasis, LinearSrgb, Nanometres};
use crate::transport::{RayDerivative, Tracer};

/// Wavelengths that every ray of a spectral light is traced at.
pub const NODES: usize = 3;

/// Most slices of a spectrum, as a power of two.
const MOST_SLICES_LOG2: u32 = 7;

/// Share of a lamp's colour, at either end, beyond the outermost nodes: Chebyshev's places over the rest.
const TAIL: f64 = 0.002;

/// What is traced at one wavelength.
#[derive(Debug)]
pub struct SpectralNode {
    /// The scene as that wavelength meets it.
    pub tracer: Tracer,
    /// What a factor in RGB is there.
    pub basis: ColourBasis,
    /// CIE XYZ of the light that the node stands for where nothing is interpolated, of a lamp of 1 W
    /// (luminous-equivalent).
    pub xyz: LinearSrgb,
    /// What the node counts for where light is interpolated: the sum of that over all wavelengths.
    pub interpolated_xyz: LinearSrgb,
}

/// Light of a narrow band.
#[derive(Clone, Copy, Debug)]
pub struct Slice {
    /// Of the three nodes: Lagrange's.
    weights: [f64; NODES],
    /// CIE XYZ of its light, of a lamp of 1 W (luminous-equivalent).
    pub xyz: LinearSrgb,
    /// What a factor in RGB is there.
    pub basis: ColourBasis,
}

/// How the light of one lamp is traced and spread over the spectrum.
#[derive(Debug)]
pub struct LightSpectrum {
    /// The middle one first: what does not depend on wavelength is traced there alone.
    pub nodes: [SpectralNode; NODES],
    /// By the logarithm of their number.
    ladder: Vec<Vec<Slice>>,
    /// Length of the whole spectrum over that between the outer nodes, along 1/λ².
    reach: f64,
    /// Of the whole lamp.
    pub xyz: LinearSrgb,
}

/// X, Y and Z in the place of red, green and blue: never negative, whatever the wavelength.
pub fn as_channels(xyz: Xyz) -> LinearSrgb {
    LinearSrgb::new(xyz.x, xyz.y, xyz.z)
}

/// Back from [`as_channels`].
pub fn to_linear_srgb(channels: LinearSrgb) -> LinearSrgb {
    let [x, y, z] = channels.to_array();
    Xyz { x, y, z }.to_linear_srgb()
}

fn place_of(wavelength: Nanometres) -> f64 {
    wavelength.0.powi(-2)
}

fn wavelength_at(place: f64) -> Nanometres {
    Nanometres(place.powf(-0.5))
}

impl LightSpectrum {
    /// For a lamp of 1 luminous-equivalent watt in a scene.
    pub fn new(tracer: &Tracer, lamp: &Spectrum) -> Self {
        let (first, last) = ends(lamp);
        let [low, high] = [last, first].map(place_of);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let outer = half * (std::f64::consts::PI / 6.0).cos();
        let places = [middle, middle - outer, middle + outer];
        let between = [middle + 0.5 * outer, middle - 0.5 * outer].map(wavelength_at);
        let whole = lamp.range();
        let ranges = [
            between[0]..=between[1],
            between[1]..=*whole.end(),
            *whole.start()..=between[0],
        ];
        let ladder: Vec<Vec<Slice>> = (0..=MOST_SLICES_LOG2)
            .map(|log2| slices(lamp, (low, high), 1 << log2, places))
            .collect();
        let finest = &ladder[ladder.len() - 1];
        let nodes = std::array::from_fn(|node| {
            let wavelength = wavelength_at(places[node]);
            SpectralNode {
                tracer: tracer.at_wavelength(wavelength),
                basis: ColourBasis::at(wavelength),
                xyz: as_channels(lamp.xyz_within(ranges[node].clone())),
                interpolated_xyz: finest.iter().fold(LinearSrgb::BLACK, |sum, slice| {
                    sum + slice.xyz * slice.weights[node]
                }),
            }
        });
        Self {
            nodes,
            ladder,
            reach: half / outer,
            xyz: as_channels(lamp.xyz()),
        }
    }

    /// Slices that lie at most one unit apart, where the outer nodes are so far apart.
    pub fn slices(&self, apart: f64) -> &[Slice] {
        let wanted = (apart * self.reach).max(1.0).log2().ceil();
        let step = (wanted as usize).min(self.ladder.len() - 1);
        &self.ladder[step]
    }
}

/// The wavelengths between which all but the tails of a lamp's colour lie.
fn ends(lamp: &Spectrum) -> (Nanometres, Nanometres) {
    let brightness = |range: RangeInclusive<Nanometres>| {
        let xyz = lamp.xyz_within(range);
        xyz.x + xyz.y + xyz.z
    };
    let (start, end) = lamp.range().into_inner();
    let whole = brightness(start..=end);
    let quantile = |share: f64| {
        let (mut low, mut high) = (start.0, end.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if brightness(start..=Nanometres(middle)) < share * whole {
                low = middle;
            } else {
                high = middle;
            }
        }
        Nanometres(0.5 * (low + high))
    };
    (quantile(TAIL), quantile(1.0 - TAIL))
}

/// So many bands of equal width along 1/λ²; the outermost hold the tails.
fn slices(lamp: &Spectrum, (low, high): (f64, f64), count: usize, nodes: [f64; NODES]) -> Vec<Slice> {
    let border = |index: usize| {
        if index == 0 {
            *lamp.range().end()
        } else if index == count {
            *lamp.range().start()
        } else {
            wavelength_at(low + (high - low) * index as f64 / count as f64)
        }
    };
    (0..count)
        .map(|index| {
            let range = border(index + 1)..=border(index);
            let place = centre(lamp, range.clone()).clamp(low, high);
            Slice {
                weights: lagrange(nodes, place),
                xyz: as_channels(lamp.xyz_within(range)),
                basis: ColourBasis::at(wavelength_at(place)),
            }
        })
        .collect()
}

/// Where the light of a band lies on average, as the eye weighs it [nm⁻²].
fn centre(lamp: &Spectrum, range: RangeInclusive<Nanometres>) -> f64 {
    let weight = |wavelength: Nanometres| xyz_bar(wavelength).iter().sum::<f64>();
    let [weighted, weights] = lamp.integral_times(range.clone(), |wavelength| {
        let weight = weight(wavelength);
        [weight * place_of(wavelength), weight]
    });
    if weights > 0.0 {
        weighted / weights
    } else {
        0.5 * (place_of(*range.start()) + place_of(*range.end()))
    }
}

fn lagrange(nodes: [f64; NODES], place: f64) -> [f64; NODES] {
    std::array::from_fn(|node| {
        let others = (0..NODES).filter(|other| *other != node);
        others
            .map(|other| (place - nodes[other]) / (nodes[node] - nodes[other]))
            .product()
    })
}

impl Slice {
    /// The strand of its wavelength between those of one signature at the nodes.
    pub fn strand(&self, nodes: [&Strand; NODES]) -> Strand {
        let mix = |of: &dyn Fn(&Strand) -> glam::DVec3| {
            let weighted = nodes.iter().zip(self.weights);
            weighted.fold(glam::DVec3::ZERO, |sum, (strand, weight)| {
                sum + of(strand) * weight
            })
        };
        let derivative = |of: &dyn Fn(&Strand) -> RayDerivative| RayDerivative {
            origin: mix(&|strand| of(strand).origin),
            direction: mix(&|strand| of(strand).direction),
        };
        let flux_w = nodes
            .iter()
            .zip(self.weights)
            .fold(LinearSrgb::BLACK, |sum, (strand, weight)| {
                sum + strand.flux_w * weight
            });
        let nearest = (0..NODES)
            .max_by(|a, b| self.weights[*a].total_cmp(&self.weights[*b]))
            .unwrap_or(0);
        let mut strand = *nodes[nearest];
        strand.ray = Ray {
            origin: mix(&|strand| strand.ray.origin),
            direction: mix(&|strand| strand.ray.direction).normalize_or_zero(),
        };
        strand.differential.across = derivative(&|strand| strand.differential.across);
        strand.differential.down = derivative(&|strand| strand.differential.down);
        // Beyond the outer nodes a share that falls to nothing would go on below it; the ledger's quadrature has the rest.
        strand.flux_w = flux_w.map(|channel| channel.max(0.0));
        strand
    }
}

/// Whether the same light lands on one surface at all nodes.
pub fn lands_alike(nodes: [&Strand; NODES]) -> bool {
    let first = &nodes[0].landing;
    nodes.iter().all(|strand| match (first, &strand.landing) {
        (Landing::Receiver { receiver, .. }, Landing::Receiver { receiver: other, .. }) => receiver == other,
        (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
    })
}
