//! What the eye pass on the device made and drew.

/// Counted where things are made; of the last picture, where it says so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EyeCounts {
    /// Render pipelines that exist, tone mapping included.
    pub pipelines: u64,
    /// Those of them that draw what is seen in mirrors and through glass.
    pub specular_pipelines: u64,
    /// What specular surfaces are shown of their surroundings [bytes].
    pub surroundings_bytes: u64,
    /// Illumination maps on the device [bytes].
    pub map_bytes: u64,
    /// Objects that the last picture drew.
    pub drawn_objects: u64,
    /// Those of them that were drawn as specular.
    pub drawn_specular: u64,
    /// Time on the device of the last picture that it has told of; `None` where it cannot tell, or has not yet.
    pub gpu_ms: Option<GpuMs>,
}

/// Time on the device [ms].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuMs {
    /// Surfaces without chains.
    pub opaque: f64,
    /// Mirrors, polish and clear bodies, and the resolving of samples after them; 0 where nothing of that kind was
    /// drawn.
    pub specular: f64,
    /// The last pass; 0 for pictures that are read back as radiance.
    pub tone_mapping: f64,
}
