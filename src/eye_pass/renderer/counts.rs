//! What the eye pass on the device made and drew.

use super::EyeQuality;

/// Counted where things are made; of the last picture, where it says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EyeCounts {
    /// Render pipelines of surfaces and tone mapping that exist.
    pub pipelines: u64,
    /// Those of them that draw what is seen in mirrors and through glass.
    pub specular_pipelines: u64,
    /// What chains are traced through: the hierarchy with its triangles [bytes].
    pub chain_bytes: u64,
    /// The environment on the device [bytes].
    pub sky_bytes: u64,
    /// Illumination maps on the device [bytes].
    pub map_bytes: u64,
    /// Maps of which the device does not hold the finest level, for want of memory.
    pub coarse_maps: u64,
    /// Objects that the last picture drew.
    pub drawn_objects: u64,
    /// Those of them that were drawn as specular.
    pub drawn_specular: u64,
    /// Pixels of the traced picture; 0 where nothing specular was in view.
    pub traced_pixels: u64,
    /// Pictures of which the last one is the mean.
    pub samples: u32,
    /// Time on the device of the last picture that it has told of; `None` where it cannot tell, or has not yet.
    pub gpu_ms: Option<GpuMs>,
    /// How that picture was made.
    pub timed_quality: Option<EyeQuality>,
}

/// Time on the device [ms].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuMs {
    /// All surfaces, as the picture shows them, and the resolving of samples after them.
    pub opaque: f64,
    /// Chains of mirrors, polish and clear bodies; 0 where nothing of that kind was drawn.
    pub specular: f64,
    /// The last pass; 0 for pictures that are read back as radiance.
    pub tone_mapping: f64,
}
