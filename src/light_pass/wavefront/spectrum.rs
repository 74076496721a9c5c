//! Wavelength as one more smooth dimension of the wavefront: a ray is traced at three wavelengths, and where their
//! paths agree the light between them is interpolated in 1/λ².
//!
//! Paths carry factors in RGB whatever their wavelength; what those are at a wavelength is asked where light becomes
//! colour. So a light without dispersion on its way is the same in RGB and by wavelength.

use std::ops::RangeInclusive;

use super::lattice_ray::{PathSegment, SegmentEnd};
use crate::geometry::Ray;
use crate::light_pass::spectral_node::{SpectralNode, channels_within, place_of, wavelength_at};
use crate::optics::spectrum::{Spectrum, xyz_bar};
use crate::optics::{ColourMatrix, LinearSrgb, Nanometres};
use crate::transport::{RayDerivative, Tracer};

/// Wavelengths at which every ray of a spectral light is traced.
pub const NODES: usize = 3;

/// Most slices of a spectrum, as a power of two.
const MAX_SLICES_LOG2: u32 = 9;

/// Fraction of a lamp's colour that is cut off at either end of the spectrum to place the nodes: they are the Chebyshev
/// nodes of the rest.
const TAIL: f64 = 0.002;

/// Light of a narrow band.
#[derive(Clone, Copy, Debug)]
pub struct Slice {
    /// Lagrange weights of the three nodes.
    weights: [f64; NODES],
    /// From the flux at each node to CIE XYZ, where light is interpolated between them.
    interpolated: [ColourMatrix; NODES],
    /// The same where each node stands for the wavelengths around it.
    own: [ColourMatrix; NODES],
}

/// How the light of one lamp is traced and spread over the spectrum.
#[derive(Debug)]
pub struct LightSpectrum {
    /// The middle one first: what does not depend on wavelength is traced there alone.
    pub nodes: [SpectralNode; NODES],
    /// From the flux at each node to CIE XYZ of the whole lamp, where light is interpolated.
    pub interpolated: [ColourMatrix; NODES],
    /// Slices of the whole spectrum, by the logarithm of their number.
    ladder: Vec<Vec<Slice>>,
    /// Length of the whole spectrum relative to the distance between the outer nodes, along 1/λ².
    reach: f64,
    /// From emitted light in RGB to CIE XYZ, over all wavelengths of the lamp.
    pub channels: ColourMatrix,
}

/// The part of a light's spectrum that one lattice traces.
#[derive(Clone, Copy, Debug)]
pub enum LightPart<'a> {
    /// All of a light in RGB.
    White,
    /// All of a light that may be dispersed.
    Spectrum(&'a LightSpectrum),
    /// The band that one wavelength stands for.
    Band(&'a SpectralNode),
}

impl<'a> LightPart<'a> {
    /// The whole spectrum; `None` for other parts.
    pub fn spectrum(self) -> Option<&'a LightSpectrum> {
        match self {
            Self::Spectrum(spectrum) => Some(spectrum),
            Self::White | Self::Band(_) => None,
        }
    }

    /// One of the wavelengths; `None` for a light in RGB.
    pub fn node(self, node: usize) -> Option<&'a SpectralNode> {
        match self {
            Self::White => None,
            Self::Spectrum(spectrum) => spectrum.nodes.get(node),
            Self::Band(band) => Some(band),
        }
    }

    /// Number of wavelengths at which every ray is traced; 1 for a light in RGB.
    pub fn node_count(self) -> usize {
        self.spectrum().map_or(1, |spectrum| spectrum.nodes.len())
    }

    /// From light that has hit nothing yet to the light's channels.
    pub fn channels(self) -> ColourMatrix {
        match self {
            Self::White => ColourMatrix::IDENTITY,
            Self::Spectrum(spectrum) => spectrum.channels,
            Self::Band(band) => band.channels,
        }
    }
}

impl LightSpectrum {
    /// For a lamp of 1 luminous-equivalent watt in a scene.
    pub fn new(tracer: &Tracer, lamp: &Spectrum) -> Self {
        let (first, last) = ends(lamp);
        let [low, high] = [last, first].map(place_of);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let outer = half * (std::f64::consts::PI / 6.0).cos();
        let places = [middle, middle - outer, middle + outer];
        let mut ladder = vec![finest(lamp, (low, high), places)];
        while ladder[0].len() > 1 {
            let coarser = coarser(lamp, (low, high), places, &ladder[0]);
            ladder.insert(0, coarser);
        }
        let whole = &ladder[0][0];
        let tracer = tracer.with_metals_under(lamp);
        let nodes = std::array::from_fn(|node| {
            let wavelength = wavelength_at(places[node]);
            SpectralNode {
                tracer: tracer.with_indices_at(wavelength),
                wavelength,
                channels: whole.own[node],
                number: node as u32,
            }
        });
        Self {
            nodes,
            interpolated: whole.interpolated,
            channels: whole.own.into_iter().sum(),
            reach: half / outer,
            ladder,
        }
    }

    /// Slices that are at most one unit apart, given the distance `apart` between the outer nodes in this unit.
    pub fn slices(&self, apart: f64) -> &[Slice] {
        let wanted = (apart * self.reach).max(1.0).log2().ceil();
        let step = (wanted as usize).min(self.ladder.len() - 1);
        &self.ladder[step]
    }
}

/// The wavelengths that enclose a lamp's colour except for its tails.
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

/// The band at an index among `count` of equal width along 1/λ²; the outermost contain the tails.
fn band(lamp: &Spectrum, (low, high): (f64, f64), index: usize, count: usize) -> RangeInclusive<Nanometres> {
    let border = |index: usize| {
        if index == 0 {
            *lamp.range().end()
        } else if index == count {
            *lamp.range().start()
        } else {
            wavelength_at(low + (high - low) * index as f64 / count as f64)
        }
    };
    border(index + 1)..=border(index)
}

/// The narrowest slices.
fn finest(lamp: &Spectrum, ends: (f64, f64), nodes: [f64; NODES]) -> Vec<Slice> {
    let count = 1 << MAX_SLICES_LOG2;
    let slice = |index: usize| {
        let range = band(lamp, ends, index, count);
        let within = |weight: &dyn Fn(f64) -> f64| {
            channels_within(lamp, range.clone(), |wavelength| {
                weight(place_of(wavelength).clamp(ends.0, ends.1))
            })
        };
        Slice {
            weights: lagrange(nodes, centre(lamp, range.clone()).clamp(ends.0, ends.1)),
            interpolated: std::array::from_fn(|node| within(&|place| lagrange(nodes, place)[node])),
            own: std::array::from_fn(|node| {
                within(&|place| f64::from(u8::from(nearest(nodes, place) == node)))
            }),
        }
    };
    (0..count).map(slice).collect()
}

/// Merges pairs of slices.
fn coarser(lamp: &Spectrum, ends: (f64, f64), nodes: [f64; NODES], finer: &[Slice]) -> Vec<Slice> {
    let count = finer.len() / 2;
    let sum = |pair: &[Slice], of: fn(&Slice, usize) -> ColourMatrix| {
        std::array::from_fn(|node| pair.iter().map(|slice| of(slice, node)).sum())
    };
    let pairs = finer.chunks_exact(2).enumerate();
    pairs
        .map(|(index, pair)| {
            let place = centre(lamp, band(lamp, ends, index, count));
            Slice {
                weights: lagrange(nodes, place.clamp(ends.0, ends.1)),
                interpolated: sum(pair, |slice, node| slice.interpolated[node]),
                own: sum(pair, |slice, node| slice.own[node]),
            }
        })
        .collect()
}

/// Mean position of a band's light along 1/λ², weighted by the matching functions [nm⁻²].
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

fn nearest(nodes: [f64; NODES], place: f64) -> usize {
    let far = |node: usize| (nodes[node] - place).abs();
    (0..NODES).min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(0)
}

impl Slice {
    /// The slice's segment, interpolated between the nodes' segments of one signature; its flux is in the light's
    /// channels.
    ///
    /// `parted`: whether each node stands for the wavelengths around it, because other light of its cell is dispersed.
    pub fn segment(&self, nodes: [&PathSegment; NODES], parted: bool) -> PathSegment {
        let mix = |of: &dyn Fn(&PathSegment) -> glam::DVec3| {
            let weighted = nodes.iter().zip(self.weights);
            weighted.fold(glam::DVec3::ZERO, |sum, (segment, weight)| {
                sum + of(segment) * weight
            })
        };
        let derivative = |of: &dyn Fn(&PathSegment) -> RayDerivative| RayDerivative {
            origin: mix(&|segment| of(segment).origin),
            direction: mix(&|segment| of(segment).direction),
        };
        let parts = nodes.iter().zip(self.matrices(parted));
        let flux_w = parts.fold(LinearSrgb::BLACK, |sum, (segment, matrix)| {
            sum + matrix.apply(segment.flux_w)
        });
        let nearest = (0..NODES)
            .max_by(|a, b| self.weights[*a].total_cmp(&self.weights[*b]))
            .unwrap_or(0);
        let mut segment = *nodes[nearest];
        segment.ray = Ray {
            origin: mix(&|segment| segment.ray.origin),
            direction: mix(&|segment| segment.ray.direction).normalize_or_zero(),
        };
        segment.differential.across = derivative(&|segment| segment.differential.across);
        segment.differential.down = derivative(&|segment| segment.differential.down);
        // Extrapolated beyond the outer nodes, a share that falls to zero would become negative; the ledger's
        // quadrature takes the difference.
        segment.flux_w = flux_w.map(|channel| channel.max(0.0));
        segment
    }

    /// Maps an RGB factor on the light of such segments to the light's channels.
    pub fn factors(&self, nodes: [&PathSegment; NODES], parted: bool) -> ColourMatrix {
        let parts = nodes.iter().zip(self.matrices(parted));
        let parts = parts.map(|(segment, matrix)| matrix.weighing(segment.flux_w));
        parts.sum::<ColourMatrix>().per_channel()
    }

    fn matrices(&self, parted: bool) -> &[ColourMatrix; NODES] {
        if parted { &self.own } else { &self.interpolated }
    }
}

/// Whether light of one signature lands on one surface at all nodes.
pub fn lands_alike(nodes: [&PathSegment; NODES]) -> bool {
    let first = &nodes[0].landing;
    nodes.iter().all(|segment| match (first, &segment.landing) {
        (SegmentEnd::Receiver { receiver, .. }, SegmentEnd::Receiver { receiver: other, .. }) => {
            receiver == other
        }
        (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
    })
}
