//! The shader modules of the eye pass.

use crate::gpu::shader::{Program, shader_source};

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
            "eye_pass/mixture" "eye_pass/light_record" "eye_pass/relief" "eye_pass/facets" "eye_pass/lights" "eye_pass/corners"
            $indices "eye_pass/medium" "eye_pass/interaction"
            "eye_pass/lamps" "eye_pass/highlights" $background "eye_pass/chain" "eye_pass/traced"
        }
    };
}

/// Surfaces without reflections.
pub(super) const SURFACE: Program = program! { "surface":
    "shared/srgb" "shared/refraction" "shared/fresnel" "eye_pass/frame" "eye_pass/objects" "eye_pass/images"
    "eye_pass/bumps" "eye_pass/light_record" "eye_pass/relief" "eye_pass/place" "eye_pass/mask" "eye_pass/surface"
    "eye_pass/own"
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

/// Lamps in front of surfaces.
pub(super) const LAMPS: Program = program! { "lamps":
    "shared/srgb" "shared/refraction" "eye_pass/frame" "eye_pass/light_record" "eye_pass/lamps" "eye_pass/lamps_drawn"
};

/// Surfaces without reflections, with traced direct light.
pub(super) const UNDER_LIGHTS: Program = program! { "under_lights":
    "shared/srgb" "shared/refraction" "shared/fresnel" "shared/traversal" "eye_pass/frame"
    "eye_pass/objects" "eye_pass/images" "eye_pass/bumps" "eye_pass/place" "eye_pass/mask" "eye_pass/start"
    "eye_pass/mixture" "eye_pass/light_record" "eye_pass/relief" "eye_pass/facets" "eye_pass/lights" "eye_pass/surface"
    "eye_pass/own_under_lights"
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

#[cfg(test)]
mod tests {
    //! Every shader is valid and lays out its structs as Rust does.

    use std::collections::{BTreeMap, BTreeSet};
    use std::path::Path;

    use naga::back::pipeline_constants::process_overrides;
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    use naga::{AddressSpace, Binding, Module, ShaderStage, TypeInner};
    use strum::VariantArray;

    use super::*;
    use crate::eye_pass::ToneMap;
    use crate::eye_pass::renderer::geometry::{CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT};
    use crate::eye_pass::renderer::objects::Inspected;
    use crate::eye_pass::renderer::pipelines::{Faces, PipelineFlags, PipelineKey, RenderTarget};
    use crate::eye_pass::renderer::tone_mapping;
    use crate::eye_pass::renderer::uniforms::{
        Accumulation, ChainStart, DisplayWhite, Frame, LightRecord, MapTile, Node, ObjectRecord, ProbeHit,
        ProbeRay, SeenWavelengths, Triangle,
    };
    use crate::gpu::layout::StructLayout;
    use crate::scene::SurfaceKind;

    /// Everything that a pipeline can write.
    fn targets() -> impl Iterator<Item = RenderTarget> {
        let inspected = [
            Inspected::Irradiance,
            Inspected::Texels,
            Inspected::TexelDensity,
            Inspected::Normals,
            Inspected::Uv,
            Inspected::MapUv,
        ];
        let others = [
            RenderTarget::Own,
            RenderTarget::OwnUnderLights,
            RenderTarget::MapValue,
            RenderTarget::Depth,
            RenderTarget::Traced,
            RenderTarget::Composed,
        ];
        others.into_iter().chain(inspected.map(RenderTarget::Inspected))
    }

    /// Every shader module of the eye pass.
    fn programs() -> Vec<Program> {
        vec![
            SURFACE,
            UNDER_LIGHTS,
            INSPECTED,
            TRACED,
            TRACED_UNDER_SKY,
            PARTED,
            PARTED_UNDER_SKY,
            SKY,
            LAMPS,
            COMPOSED,
            ACCUMULATED,
            SUMMED,
            PROBE,
            TONE_MAPPING,
        ]
    }

    /// Every struct that the eye pass shares with its shaders.
    fn shared_structs() -> Vec<StructLayout> {
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

    /// Every attribute of the surface pass's vertex buffers.
    fn vertex_attributes() -> Vec<wgpu::VertexAttribute> {
        [CORNER_LAYOUT, MAP_UV_LAYOUT, OBJECT_LAYOUT]
            .iter()
            .flat_map(|layout| layout.attributes)
            .copied()
            .collect()
    }

    /// A fragment stage with values of its overrides.
    #[derive(Clone, Debug, PartialEq)]
    struct Specialisation {
        program: &'static str,
        entry_point: &'static str,
        constants: Vec<(&'static str, f64)>,
    }

    /// Every specialisation that a pipeline can request; some occur more than once.
    fn specialisations() -> Vec<Specialisation> {
        const KINDS: [SurfaceKind; 6] = [
            SurfaceKind::Diffuse,
            SurfaceKind::Mirror,
            SurfaceKind::Dielectric,
            SurfaceKind::ThinWall,
            SurfaceKind::Coated,
            SurfaceKind::Varied,
        ];
        let alone = |program: Program, entry_point| Specialisation {
            program: program.name,
            entry_point,
            constants: Vec::new(),
        };
        let mut all = vec![
            alone(ACCUMULATED, "accumulated"),
            alone(SKY, "sky_drawn"),
            alone(LAMPS, "lamp_drawn"),
        ];
        for writes in targets() {
            for kind in KINDS {
                for flags in 0..128 {
                    let draw_state = PipelineFlags {
                        has_texture: flags & 1 > 0,
                        is_scaled: flags & 1 > 0,
                        traces_lights: flags & 2 > 0,
                        has_bumps: flags & 8 > 0,
                        has_sky: flags & 4 > 0,
                        is_dispersive: flags & 16 > 0,
                        has_mask: flags & 32 > 0,
                        has_lobes: flags & 64 > 0,
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
        for &tone_map in ToneMap::VARIANTS {
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

    fn modules() -> BTreeMap<String, Module> {
        let programs = programs();
        assert!(!programs.is_empty(), "there are shaders to validate");
        let parse = |program: &Program| {
            let text = program.wgsl();
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|error| panic!("{}: {}", program.name, error.emit_to_string(&text)));
            (program.name.to_owned(), module)
        };
        programs.iter().map(parse).collect()
    }

    fn validator() -> Validator {
        Validator::new(ValidationFlags::all(), Capabilities::empty())
    }

    /// As they are written, and as devices get them: the overrides replaced by their values.
    #[test]
    fn every_program_and_specialisation_is_valid() {
        let modules = modules();
        let validate = |(name, module): (&String, &Module)| {
            assert!(!module.entry_points.is_empty(), "{name} draws something");
            let info = validator().validate(module);
            (
                name.clone(),
                info.unwrap_or_else(|error| panic!("{name}: {error:?}")),
            )
        };
        let infos: BTreeMap<String, _> = modules.iter().map(validate).collect();
        for found in specialisations() {
            let constants = found.constants.iter();
            let constants = constants.map(|(name, value)| ((*name).to_owned(), *value));
            let entry_point = Some((ShaderStage::Fragment, found.entry_point));
            let (module, info) = (&modules[found.program], &infos[found.program]);
            let (resolved, _) = process_overrides(module, info, entry_point, &constants.collect())
                .unwrap_or_else(|error| panic!("{found:?}: {error}"));
            assert_eq!(resolved.entry_points.len(), 1, "{found:?}");
            let is_valid = validator().validate_resolved_overrides(&resolved);
            is_valid.unwrap_or_else(|error| panic!("{found:?}: {error:?}"));
        }
    }

    #[test]
    fn every_override_and_fragment_is_specialised() {
        let all = specialisations();
        for (name, module) in modules() {
            let overrides = module.overrides.iter();
            let overrides: BTreeSet<_> = overrides.filter_map(|(_, found)| found.name.as_deref()).collect();
            let of_program = || all.iter().filter(|found| found.program == name);
            for found in of_program() {
                let given: BTreeSet<_> = found.constants.iter().map(|(name, _)| *name).collect();
                assert_eq!(given, overrides, "{found:?}");
            }
            let stages = module.entry_points.iter();
            let stages = stages.filter(|stage| stage.stage == ShaderStage::Fragment);
            let stages: BTreeSet<_> = stages.map(|stage| stage.name.as_str()).collect();
            assert_eq!(
                stages,
                of_program().map(|found| found.entry_point).collect(),
                "{name}"
            );
            // A question that has one answer needs no override.
            for wanted in overrides {
                let values = of_program().flat_map(|found| &found.constants);
                let values = values.filter(|(name, _)| *name == wanted);
                let values: BTreeSet<_> = values.map(|(_, value)| value.to_string()).collect();
                assert!(values.len() > 1, "{name}: {wanted} is always {values:?}");
            }
        }
    }

    #[test]
    fn every_shader_file_is_part_of_a_program() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let within = |folder: &Path| {
            let entries = std::fs::read_dir(folder).expect("shaders/ holds folders only");
            let paths = entries.map(|entry| entry.expect("readable").path());
            paths.collect::<Vec<_>>()
        };
        let files = within(&root).into_iter().flat_map(|folder| within(&folder));
        let name = |path: std::path::PathBuf| {
            let name = path.strip_prefix(&root).expect("below it").with_extension("");
            name.to_string_lossy().into_owned()
        };
        let files: BTreeSet<String> = files.map(name).collect();
        let programs = programs();
        let used = programs.iter().flat_map(|program| program.sources);
        assert!(!files.is_empty());
        assert_eq!(files, used.map(|source| source.name.to_owned()).collect());
    }

    /// Names of the structs in a module's buffers, those within arrays and other structs included.
    fn shared_in(module: &Module) -> BTreeSet<String> {
        let variables = module.global_variables.iter().map(|(_, variable)| variable);
        let is_shared =
            |space: AddressSpace| matches!(space, AddressSpace::Uniform | AddressSpace::Storage { .. });
        let shared = variables.filter(|variable| is_shared(variable.space));
        let mut pending: Vec<_> = shared.map(|variable| variable.ty).collect();
        let mut names = BTreeSet::new();
        while let Some(handle) = pending.pop() {
            let ty = &module.types[handle];
            match &ty.inner {
                TypeInner::Struct { members, .. } => {
                    names.insert(ty.name.clone().expect("structs have names"));
                    pending.extend(members.iter().map(|member| member.ty));
                }
                TypeInner::Array { base, .. } => pending.push(*base),
                _ => {}
            }
        }
        names
    }

    #[test]
    fn structs_lie_the_same_in_rust_and_shaders() {
        let mut found = BTreeMap::new();
        for module in modules().values() {
            let shared = shared_in(module);
            for (_, ty) in module.types.iter() {
                let name = ty.name.clone().unwrap_or_default();
                if let (TypeInner::Struct { members, span }, true) = (&ty.inner, shared.contains(&name)) {
                    let field =
                        |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
                    let fields: Vec<_> = members.iter().map(field).collect();
                    found.insert(name, (*span as usize, fields));
                }
            }
        }
        let ours: BTreeMap<_, _> = shared_structs()
            .iter()
            .map(|layout| {
                let fields = layout
                    .fields
                    .iter()
                    .map(|field| (field.name.to_owned(), field.offset));
                (layout.name.to_owned(), (layout.size, fields.collect()))
            })
            .collect();
        assert!(!ours.is_empty());
        assert_eq!(ours, found, "every struct of a buffer is declared on both sides");
    }

    #[test]
    fn vertex_inputs_match_the_vertex_buffers() {
        let surface = &modules()["surface"];
        let mut stages = surface.entry_points.iter();
        let vertex = stages.find(|entry| entry.stage == ShaderStage::Vertex);
        let arguments = &vertex.expect("it has a vertex stage").function.arguments;
        let TypeInner::Struct { members, .. } = &surface.types[arguments[0].ty].inner else {
            panic!("corners come as a struct");
        };
        let input = |member: &naga::StructMember| match (&member.binding, &surface.types[member.ty].inner) {
            (Some(Binding::Location { location, .. }), TypeInner::Vector { size, .. }) => {
                (*location, *size as usize)
            }
            _ => panic!("{member:?}"),
        };
        let buffers = vertex_attributes();
        let numbers = |format| match format {
            wgpu::VertexFormat::Float32x2 => 2,
            wgpu::VertexFormat::Float32x3 => 3,
            wgpu::VertexFormat::Float32x4 | wgpu::VertexFormat::Unorm16x4 => 4,
            other => panic!("{other:?}"),
        };
        let attributes = buffers
            .iter()
            .map(|found| (found.shader_location, numbers(found.format)));
        let mut attributes: Vec<(u32, usize)> = attributes.collect();
        attributes.sort_unstable();
        let mut inputs: Vec<(u32, usize)> = members.iter().map(input).collect();
        inputs.sort_unstable();
        assert_eq!(inputs, attributes);
    }
}
