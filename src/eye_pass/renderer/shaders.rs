//! The eye pass's shader modules and what they share with Rust.

use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT};
use super::uniforms::{Frame, ObjectUniform, Receiver, Surroundings, ToneMapping};
use crate::gpu::layout::StructLayout;
use crate::gpu::shader::{Program, shader_source};

/// Surfaces of the scene.
pub(super) const SURFACE: Program = Program {
    name: "surface",
    sources: &[
        shader_source!("shared/fresnel"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/surroundings"),
        shader_source!("eye_pass/surface"),
    ],
};

/// Radiance to display colour.
pub(super) const TONE_MAPPING: Program = Program {
    name: "tone_mapping",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/tone_map"),
        shader_source!("eye_pass/tone_mapping"),
    ],
};

/// Every shader module of the eye pass, for the tests.
pub fn programs() -> Vec<Program> {
    vec![SURFACE, TONE_MAPPING]
}

/// Every struct that the eye pass shares with its shaders, for the tests.
pub fn shared_structs() -> Vec<StructLayout> {
    vec![
        Frame::layout(),
        ObjectUniform::layout(),
        Receiver::layout(),
        Surroundings::layout(),
        ToneMapping::layout(),
    ]
}

/// Every attribute of the surface pass's vertex buffers, for the tests.
pub fn vertex_attributes() -> Vec<wgpu::VertexAttribute> {
    [CORNER_LAYOUT, MAP_UV_LAYOUT]
        .iter()
        .flat_map(|layout| layout.attributes)
        .copied()
        .collect()
}
