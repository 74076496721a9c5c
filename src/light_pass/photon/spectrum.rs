//! Wavelengths of photons: all at once until a surface parts them, then one.

use crate::light_pass::spectral_node::SpectralNode;
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
}

#[derive(Debug)]
struct WeightedNode {
    /// Its channels are divided by the probability of the node.
    node: SpectralNode,
    /// Band of the node among all bands of the bake.
    band: usize,
    /// Probability of all nodes up to this one, itself included.
    upto: f64,
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
}

impl PhotonSpectrum {
    /// Of bands with what they stand for; each is chosen in proportion to its X + Y + Z.
    pub fn new(whole: Tracer, bands: Vec<(usize, SpectralNode)>) -> Self {
        let brightness =
            |node: &SpectralNode| node.channels.of_white().to_array().iter().sum::<f64>().max(0.0);
        let total: f64 = bands.iter().map(|(_, node)| brightness(node)).sum();
        let mut upto = 0.0;
        let channels = bands.iter().map(|(_, node)| node.channels).sum();
        let nodes = bands
            .into_iter()
            .filter(|(_, node)| brightness(node) > 0.0)
            .map(|(band, node)| {
                let probability = brightness(&node) / total;
                upto += probability;
                let channels = node.channels.scaled(1.0 / probability);
                WeightedNode {
                    node: SpectralNode { channels, ..node },
                    band,
                    upto,
                }
            })
            .collect();
        Self {
            whole,
            channels,
            nodes,
        }
    }

    /// All wavelengths.
    pub fn whole(&self) -> Hue<'_> {
        Hue {
            tracer: &self.whole,
            channels: self.channels,
            band: None,
        }
    }

    /// One of them, by a number in [0, 1).
    pub fn one(&self, place: f64) -> Option<Hue<'_>> {
        let index = self.nodes.partition_point(|node| node.upto <= place);
        let chosen = self.nodes.get(index).or(self.nodes.last())?;
        Some(Hue {
            tracer: &chosen.node.tracer,
            channels: chosen.node.channels,
            band: Some(chosen.band),
        })
    }
}
