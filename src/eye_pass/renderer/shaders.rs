//! The eye pass's shader modules and what they share with Rust.

use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT};
use super::pipelines::{DrawnHow, Faces, PipelineKey, Writes};
use super::tone_mapping;
use super::uniforms::{
    Accumulation, ChainStart, DisplayWhite, Frame, LightRecord, Node, ObjectRecord, ProbeHit, ProbeRay,
    SeenWavelengths, Triangle,
};
use crate::eye_pass::ToneMap;
use crate::gpu::layout::StructLayout;
use crate::gpu::shader::{Program, shader_source};
use crate::scene::SurfaceKind;

/// Surfaces of the scene by themselves.
pub(super) const SURFACE: Program = Program {
    name: "surface",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/refraction"),
        shader_source!("shared/fresnel"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/bumps"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/surface"),
        shader_source!("eye_pass/own"),
    ],
};

/// Surfaces by something else than their light.
pub(super) const INSPECTED: Program = Program {
    name: "inspected",
    sources: &[
        shader_source!("shared/false_colours"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/inspected"),
    ],
};

/// Chains of specular surfaces.
pub(super) const TRACED: Program = Program {
    name: "traced",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/refraction"),
        shader_source!("shared/fresnel"),
        shader_source!("shared/traversal"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/bumps"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/start"),
        shader_source!("eye_pass/lights"),
        shader_source!("eye_pass/corners"),
        shader_source!("eye_pass/one_index"),
        shader_source!("eye_pass/medium"),
        shader_source!("eye_pass/interaction"),
        shader_source!("eye_pass/plain_background"),
        shader_source!("eye_pass/chain"),
        shader_source!("eye_pass/traced"),
    ],
};

/// The same in an environment.
pub(super) const TRACED_UNDER_SKY: Program = Program {
    name: "traced_under_sky",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/refraction"),
        shader_source!("shared/fresnel"),
        shader_source!("shared/traversal"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/bumps"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/start"),
        shader_source!("eye_pass/lights"),
        shader_source!("eye_pass/corners"),
        shader_source!("eye_pass/one_index"),
        shader_source!("eye_pass/medium"),
        shader_source!("eye_pass/interaction"),
        shader_source!("eye_pass/sky"),
        shader_source!("eye_pass/chain"),
        shader_source!("eye_pass/traced"),
    ],
};

/// Chains of specular surfaces, by wavelength from where glass parts light.
pub(super) const PARTED: Program = Program {
    name: "parted",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/refraction"),
        shader_source!("shared/fresnel"),
        shader_source!("shared/traversal"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/bumps"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/start"),
        shader_source!("eye_pass/lights"),
        shader_source!("eye_pass/corners"),
        shader_source!("eye_pass/wavelengths"),
        shader_source!("eye_pass/medium"),
        shader_source!("eye_pass/interaction"),
        shader_source!("eye_pass/plain_background"),
        shader_source!("eye_pass/chain"),
        shader_source!("eye_pass/traced"),
    ],
};

/// The same in an environment.
pub(super) const PARTED_UNDER_SKY: Program = Program {
    name: "parted_under_sky",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/refraction"),
        shader_source!("shared/fresnel"),
        shader_source!("shared/traversal"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/bumps"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/start"),
        shader_source!("eye_pass/lights"),
        shader_source!("eye_pass/corners"),
        shader_source!("eye_pass/wavelengths"),
        shader_source!("eye_pass/medium"),
        shader_source!("eye_pass/interaction"),
        shader_source!("eye_pass/sky"),
        shader_source!("eye_pass/chain"),
        shader_source!("eye_pass/traced"),
    ],
};

/// An environment behind all surfaces.
pub(super) const SKY: Program = Program {
    name: "sky",
    sources: &[
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/sky"),
        shader_source!("eye_pass/sky_drawn"),
    ],
};

/// Surfaces of the scene by themselves, while lights are moved.
pub(super) const UNDER_LIGHTS: Program = Program {
    name: "under_lights",
    sources: &[
        shader_source!("shared/srgb"),
        shader_source!("shared/refraction"),
        shader_source!("shared/fresnel"),
        shader_source!("shared/traversal"),
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/objects"),
        shader_source!("eye_pass/images"),
        shader_source!("eye_pass/bumps"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/start"),
        shader_source!("eye_pass/lights"),
        shader_source!("eye_pass/surface"),
        shader_source!("eye_pass/own_under_lights"),
    ],
};

/// What was traced, in the picture.
pub(super) const COMPOSED: Program = Program {
    name: "composed",
    sources: &[
        shader_source!("eye_pass/frame"),
        shader_source!("eye_pass/place"),
        shader_source!("eye_pass/composed"),
    ],
};

/// Means of pictures.
pub(super) const ACCUMULATED: Program = Program {
    name: "accumulated",
    sources: &[
        shader_source!("shared/cover"),
        shader_source!("eye_pass/accumulated"),
    ],
};

/// Rays, to hold the device's answers against the processor's.
pub(super) const PROBE: Program = Program {
    name: "probe",
    sources: &[
        shader_source!("shared/traversal"),
        shader_source!("eye_pass/probe"),
    ],
};

/// Radiance to display colour.
pub(super) const TONE_MAPPING: Program = Program {
    name: "tone_mapping",
    sources: &[
        shader_source!("shared/cover"),
        shader_source!("shared/srgb"),
        shader_source!("shared/tone_map"),
        shader_source!("eye_pass/tone_mapping"),
    ],
};

/// Every shader module of the eye pass, for the tests.
pub fn programs() -> Vec<Program> {
    vec![
        SURFACE,
        UNDER_LIGHTS,
        INSPECTED,
        TRACED,
        TRACED_UNDER_SKY,
        PARTED,
        PARTED_UNDER_SKY,
        SKY,
        COMPOSED,
        ACCUMULATED,
        PROBE,
        TONE_MAPPING,
    ]
}

/// Every struct that the eye pass shares with its shaders, for the tests.
pub fn shared_structs() -> Vec<StructLayout> {
    vec![
        Frame::layout(),
        ChainStart::layout(),
        LightRecord::layout(),
        ObjectRecord::layout(),
        SeenWavelengths::layout(),
        Node::layout(),
        Triangle::layout(),
        DisplayWhite::layout(),
        Accumulation::layout(),
        ProbeRay::layout(),
        ProbeHit::layout(),
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
    let alone = |program: Program, entry_point| Specialisation {
        program: program.name,
        entry_point,
        constants: Vec::new(),
    };
    let mut all = vec![alone(ACCUMULATED, "accumulated"), alone(SKY, "sky_drawn")];
    for writes in Writes::all() {
        for kind in KINDS {
            for flags in 0..32 {
                let manner = DrawnHow {
                    has_texture: flags & 1 > 0,
                    is_scaled: flags & 1 > 0,
                    traces_lights: flags & 2 > 0,
                    has_bumps: flags & 8 > 0,
                    has_sky: flags & 4 > 0,
                    parts_wavelengths: flags & 16 > 0,
                    is_logarithmic: flags & 1 > 0,
                };
                let key = PipelineKey::new(writes, kind, Faces::Both, manner);
                all.extend(key.writes.entry_point().map(|entry_point| Specialisation {
                    program: key.program().name,
                    entry_point,
                    constants: key.constants(),
                }));
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
