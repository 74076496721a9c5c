//! The eye pass's shader modules and what they share with Rust.

use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT};
use super::pipelines::{Faces, PipelineKey, Writes};
use super::tone_mapping;
use super::uniforms::{Frame, ObjectUniform, Receiver, Surroundings};
use crate::eye_pass::ToneMap;
use crate::gpu::layout::StructLayout;
use crate::gpu::shader::{Program, shader_source};
use crate::scene::SurfaceKind;

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

/// A fragment stage as a pipeline may use it.
#[derive(Clone, Debug, PartialEq)]
pub struct Specialisation {
    /// Name of its program.
    pub program: &'static str,
    /// Name of the stage in WGSL.
    pub entry_point: &'static str,
    /// Values of the program's overrides.
    pub constants: Vec<(&'static str, f64)>,
}

/// Every specialisation that pipelines can ask for, for the tests; some of them more than once.
pub fn specialisations() -> Vec<Specialisation> {
    const KINDS: [SurfaceKind; 5] = [
        SurfaceKind::Diffuse,
        SurfaceKind::Mirror,
        SurfaceKind::Dielectric,
        SurfaceKind::ThinWall,
        SurfaceKind::Mixed,
    ];
    let mut all = Vec::new();
    for writes in Writes::ALL {
        for kind in KINDS {
            for flags in 0..4 {
                let key = PipelineKey::new(writes, kind, Faces::Both, flags & 1 > 0, flags & 2 > 0);
                all.push(Specialisation {
                    program: SURFACE.name,
                    entry_point: writes.entry_point(),
                    constants: key.constants().to_vec(),
                });
            }
        }
    }
    for tone_map in ToneMap::ALL {
        for encode_srgb in [false, true] {
            all.push(Specialisation {
                program: TONE_MAPPING.name,
                entry_point: "to_display",
                constants: tone_mapping::constants(tone_map, encode_srgb).to_vec(),
            });
        }
    }
    all
}
