//! Wavelengths of photons: a photon carries all of them until it meets a dispersive surface, and one from there.

use crate::light_pass::spectral_node::{SpectralNode, place_of};
use crate::optics::ColourMatrix;
use crate::transport::Tracer;

/// The spectrum of one light.
#[derive(Debug)]
pub struct PhotonSpectrum {
    /// The scene for photons that carry all wavelengths.
    whole: Tracer,
    /// From RGB to CIE XYZ.
    channels: ColourMatrix,
    nodes: Vec<WeightedNode>,
    /// Whether photons have a single wavelength from their start, as separate maps for each band require.
    starts_parted: bool,
}

#[derive(Debug)]
struct WeightedNode {
    /// Its channels are divided by the node's probability.
    node: SpectralNode,
    /// Index among all bands of the bake.
    band: usize,
    /// Cumulative probability, including its own.
    upto: f64,
    /// See [`Hue::ends`].
    ends: [f64; 2],
}

/// The wavelengths of a photon: all of them, or one.
#[derive(Clone, Copy, Debug)]
pub struct Hue<'a> {
    pub tracer: &'a Tracer,
    /// From RGB flux to the channels of the light.
    pub channels: ColourMatrix,
    /// `None` for all wavelengths.
    pub band: Option<usize>,
    /// Weights that interpolate how a value differs at this wavelength from the middle one, given its differences at
    /// the first and at the last: by a parabola in a variable in which refractive indices are smooth.
    pub ends: [f64; 2],
}

impl PhotonSpectrum {
    /// Each band is sampled in proportion to the X + Y + Z of its node.
    pub fn new(whole: Tracer, bands: Vec<(usize, SpectralNode)>, starts_parted: bool) -> Self {
        let brightness =
            |node: &SpectralNode| node.channels.of_white().to_array().iter().sum::<f64>().max(0.0);
        let total: f64 = bands.iter().map(|(_, node)| brightness(node)).sum();
        let mut upto = 0.0;
        let places: Vec<f64> = bands.iter().map(|(_, node)| place_of(node.wavelength)).collect();
        let channels = bands.iter().map(|(_, node)| node.channels).sum();
        let nodes = bands
            .into_iter()
            .zip(&places)
            .filter(|((_, node), _)| brightness(node) > 0.0)
            .map(|((band, node), place)| {
                let probability = brightness(&node) / total;
                upto += probability;
                let channels = node.channels.scaled(1.0 / probability);
                WeightedNode {
                    node: SpectralNode { channels, ..node },
                    band,
                    upto,
                    ends: ends(&places, *place),
                }
            })
            .collect();
        Self {
            whole,
            channels,
            nodes,
            starts_parted,
        }
    }

    pub fn starts_parted(&self) -> bool {
        self.starts_parted
    }

    /// All wavelengths together.
    pub fn whole(&self) -> Hue<'_> {
        Hue {
            tracer: &self.whole,
            channels: self.channels,
            band: None,
            ends: [0.0; 2],
        }
    }

    /// The scene at the middle, the first and the last wavelength; `None` if there are fewer than three.
    pub fn tracers(&self) -> Option<[&Tracer; 3]> {
        let [first, .., last] = &self.nodes[..] else {
            return None;
        };
        let middle = &self.nodes[self.nodes.len() / 2];
        (self.nodes.len() > 2).then_some([middle, first, last].map(|node| &node.node.tracer))
    }

    /// Samples one wavelength by a number in [0, 1).
    pub fn one(&self, place: f64) -> Option<Hue<'_>> {
        let index = self.nodes.partition_point(|node| node.upto <= place);
        self.nodes.get(index).or(self.nodes.last()).map(WeightedNode::hue)
    }
}

impl WeightedNode {
    fn hue(&self) -> Hue<'_> {
        Hue {
            tracer: &self.node.tracer,
            channels: self.node.channels,
            band: Some(self.band),
            ends: self.ends,
        }
    }
}

/// [`Hue::ends`] at one place among those of all wavelengths.
fn ends(places: &[f64], place: f64) -> [f64; 2] {
    let [first, .., last] = places else {
        return [0.0; 2];
    };
    let middle = places[places.len() / 2];
    [
        (place - middle) * (place - last) / ((first - middle) * (first - last)),
        (place - middle) * (place - first) / ((last - middle) * (last - first)),
    ]
}
