//! The laws of optics, of lights and of units, tested as laws.

mod colour;
mod colour_basis;
mod differentials;
mod false_colours;
mod fresnel;
mod glass;
mod interfaces;
mod lights;
mod metal_paths;
mod metals;
mod microfacets;
mod polish;
mod refraction;
mod spectrum;
mod tone_maps;
mod upsampling;
mod waves;
