//! The shader modules of the eye pass, and the constants they share with Rust.

use super::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT};
use super::pipelines::{Faces, PipelineFlags, PipelineKey, RenderTarget};
use super::tone_mapping;
use super::uniforms::{
    Accumulation, ChainStart, DisplayWhite, Frame, LightRecord, MapTile, Node, ObjectRecord, ProbeHit,
    ProbeRay, SeenWavelengths, Triangle,
};
use crate::eye_pass::ToneMap;
use crate::gpu::layout::StructLayout;
use crate::gpu::shader::{Program, shader_source};
use crate::scene::SurfaceKind;

/// A program made of these sources, in this order.
macro_rules! program {
    ($name:literal: $($source:literal)+) => {
        Program {
            name: $name,
            sources: &[$(shader_source!($source)),+],
        }
    };
}

/// A program that traces chains. `$indices` supplies refractive indices, `$background` the radiance behind the scene.
macro_rules! chains {
    ($name:literal, $indices:literal, $background:literal) => {
        program! { $name:
            "shared/srgb" "shared/refraction" "shared/fresnel" "shared/traversal" "eye_pass/frame"
            "eye_pass/objects" "eye_pass/images" "eye_pass/bumps" "eye_pass/place" "eye_pass/mask" "eye_pass/start"
            "eye_pass/mixture" "eye_pass/lights" "eye_pass/corners" $indices "eye_pass/medium" "eye_pass/interaction"
            $background "eye_pass/chain" "eye_pass/traced"
        }
    };
}

/// Surfaces without reflections.
pub(super) const SURFACE: Program = program! { "surface":
    "shared/srgb" "shared/refraction" "shared/fresnel" "eye_pass/frame" "eye_pass/objects" "eye_pass/images"
    "eye_pass/bumps" "eye_pass/place" "eye_pass/mask" "eye_pass/surface" "eye_pass/own"
};

/// Surfaces that show a property instead of their radiance.
pub(super) const INSPECTED: Program = program! { "inspected":
    "shared/false_colours" "eye_pass/frame" "eye_pass/objects" "eye_pass/images" "eye_pass/place"
    "eye_pass/mask" "eye_pass/inspected"
};

/// Chains over a plain background.
pub(super) const TRACED: Program = chains!("traced", "eye_pass/one_index", "eye_pass/plain_background");

/// Chains in an environment.
pub(super) const TRACED_UNDER_SKY: Program =
    chains!("traced_under_sky", "eye_pass/one_index", "eye_pass/sky");

/// Chains that split into wavelengths at dispersive surfaces.
pub(super) const PARTED: Program = chains!("parted", "eye_pass/wavelengths", "eye_pass/plain_background");

/// The same in an environment.
pub(super) const PARTED_UNDER_SKY: Program =
    chains!("parted_under_sky", "eye_pass/wavelengths", "eye_pass/sky");

/// An environment behind all surfaces.
pub(super) const SKY: Program = program! { "sky":
    "eye_pass/frame" "eye_pass/sky" "eye_pass/sky_drawn"
};

/// Surfaces without reflections, with traced direct light.
pub(super) const UNDER_LIGHTS: Program = program! { "under_lights":
    "shared/srgb" "shared/refraction" "shared/fresnel" "shared/traversal" "eye_pass/frame"
    "eye_pass/objects" "eye_pass/images" "eye_pass/bumps" "eye_pass/place" "eye_pass/mask" "eye_pass/start"
    "eye_pass/mixture" "eye_pass/lights" "eye_pass/surface" "eye_pass/own_under_lights"
};

/// The traced image, composed into the frame.
pub(super) const COMPOSED: Program = program! { "composed":
    "eye_pass/frame" "eye_pass/objects" "eye_pass/images" "eye_pass/place" "eye_pass/mask" "eye_pass/composed"
};

/// Means of frames.
pub(super) const ACCUMULATED: Program = program! { "accumulated":
    "shared/cover" "eye_pass/accumulated"
};

/// Layers of light in the tiles of maps, for hosts that switch them.
pub(super) const SUMMED: Program = program! { "summed": "eye_pass/summed" };

/// Single rays, to compare the device's hits with the CPU's.
pub(super) const PROBE: Program = program! { "probe":
    "shared/traversal" "eye_pass/probe"
};

/// Radiance to display colour.
pub(super) const TONE_MAPPING: Program = program! { "tone_mapping":
    "shared/cover" "shared/srgb" "shared/tone_map" "eye_pass/tone_mapping"
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
        SUMMED,
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
        MapTile::layout(),
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
    [CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT]
        .iter()
        .flat_map(|layout| layout.attributes)
        .copied()
        .collect()
}

/// A fragment stage with values of its overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct Specialisation {
    pub program: &'static str,
    pub entry_point: &'static str,
    pub constants: Vec<(&'static str, f64)>,
}

/// Every specialisation that a pipeline can request, for the tests; some occur more than once.
pub fn specialisations() -> Vec<Specialisation> {
    const KINDS: [SurfaceKind; 6] = [
        SurfaceKind::Diffuse,
        SurfaceKind::Mirror,
        SurfaceKind::Dielectric,
        SurfaceKind::ThinWall,
        SurfaceKind::Mixed,
        SurfaceKind::Varied,
    ];
    let alone = |program: Program, entry_point| Specialisation {
        program: program.name,
        entry_point,
        constants: Vec::new(),
    };
    let mut all = vec![alone(ACCUMULATED, "accumulated"), alone(SKY, "sky_drawn")];
    for writes in RenderTarget::all() {
        for kind in KINDS {
            for flags in 0..64 {
                let draw_state = PipelineFlags {
                    has_texture: flags & 1 > 0,
                    is_scaled: flags & 1 > 0,
                    traces_lights: flags & 2 > 0,
                    has_bumps: flags & 8 > 0,
                    has_sky: flags & 4 > 0,
                    parts_wavelengths: flags & 16 > 0,
                    has_mask: flags & 32 > 0,
                    is_logarithmic: flags & 1 > 0,
                };
                let key = PipelineKey::new(writes, kind, Faces::Both, draw_state);
                all.extend(key.entry_point().map(|entry_point| Specialisation {
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
