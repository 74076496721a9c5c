//! Wavelengths of photons: a photon carries all of them until it meets a dispersive surface, and one from there.

use crate::light_pass::spectral_node::{SpectralNode, place_of};
use crate::optics::ColourMatrix;
use crate::transport::Tracer;

/// The light of one lamp by wavelength.
#[derive(Debug)]
pub struct PhotonSpectrum {
    /// The scene as light of all wavelengths meets it.
    whole: Tracer,
    /// From light in RGB to CIE XYZ.
    channels: ColourMatrix,
    nodes: Vec<WeightedNode>,
    /// Whether a photon has its own wavelength before a surface parts them: where bands have maps of their own.
    starts_parted: bool,
}

#[derive(Debug)]
struct WeightedNode {
    /// Its channels are divided by the probability of the node.
    node: SpectralNode,
    /// Band of the node among all bands of the bake.
    band: usize,
    /// Probability of all nodes up to this one, itself included.
    upto: f64,
    /// See [`Hue::ends`].
    ends: [f64; 2],
}

/// How a photon sees the scene: by all wavelengths, or by one.
#[derive(Clone, Copy, Debug)]
pub struct Hue<'a> {
    /// The scene.
    pub tracer: &'a Tracer,
    /// From flux in RGB to the channels of the light.
    pub channels: ColourMatrix,
    /// Its band; `None` while it has all of them.
    pub band: Option<usize>,
    /// What a value that differs by so much at the spectrum's first and at its last wavelength from that in the middle has of
    /// either difference: a parabola along which refractive indices are smooth.
    pub ends: [f64; 2],
}

impl PhotonSpectrum {
    /// Of bands with what they stand for; each is chosen in proportion to its X + Y + Z.
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

    /// Whether a photon has its own wavelength from its start.
    pub fn starts_parted(&self) -> bool {
        self.starts_parted
    }

    /// All wavelengths.
    pub fn whole(&self) -> Hue<'_> {
        Hue {
            tracer: &self.whole,
            channels: self.channels,
            band: None,
            ends: [0.0; 2],
        }
    }

    /// The scene as light of the middle, the first and the last wavelength meets it; `None` of fewer than three.
    pub fn tracers(&self) -> Option<[&Tracer; 3]> {
        let [first, .., last] = &self.nodes[..] else {
            return None;
        };
        let middle = &self.nodes[self.nodes.len() / 2];
        (self.nodes.len() > 2).then_some([middle, first, last].map(|node| &node.node.tracer))
    }

    /// One of them, by a number in [0, 1).
    pub fn one(&self, place: f64) -> Option<Hue<'_>> {
        let index = self.nodes.partition_point(|node| node.upto <= place);
        self.nodes.get(index).or(self.nodes.last()).map(WeightedNode::hue)
    }

    /// Each of them, with its probability.
    pub fn hues(&self) -> impl Iterator<Item = (Hue<'_>, f64)> {
        let before = std::iter::once(0.0).chain(self.nodes.iter().map(|node| node.upto));
        let nodes = self.nodes.iter().zip(before);
        nodes.map(|(node, before)| (node.hue(), node.upto - before))
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

/// See [`Hue::ends`], of a place among those of all wavelengths.
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
