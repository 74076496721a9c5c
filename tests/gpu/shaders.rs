//! Every shader is valid, and lays out its structs as Rust does.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use naga::ShaderStage;
use naga::back::pipeline_constants::process_overrides;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use nephroid::eye_pass::renderer::{programs, shared_structs, specialisations};

fn modules() -> Vec<(String, naga::Module)> {
    let programs = programs();
    assert!(!programs.is_empty(), "there are shaders to validate");
    let parse = |program: &nephroid::gpu::shader::Program| {
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

#[test]
fn every_program_is_valid_without_any_optional_capability() {
    for (name, module) in modules() {
        validator()
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {error:?}"));
        assert!(!module.entry_points.is_empty(), "{name} draws something");
    }
}

/// As devices get them: the overrides replaced by their values.
#[test]
fn every_specialisation_is_valid_without_any_optional_capability() {
    let modules: BTreeMap<String, naga::Module> = modules().into_iter().collect();
    for found in specialisations() {
        let module = &modules[found.program];
        let info = validator().validate(module).expect("tested above");
        let constants = found.constants.iter();
        let constants = constants
            .map(|(name, value)| ((*name).to_owned(), *value))
            .collect();
        let entry_point = Some((ShaderStage::Fragment, found.entry_point));
        let (resolved, _) = process_overrides(module, &info, entry_point, &constants)
            .unwrap_or_else(|error| panic!("{found:?}: {error}"));
        assert_eq!(resolved.entry_points.len(), 1, "{found:?}");
        validator()
            .validate_resolved_overrides(&resolved)
            .unwrap_or_else(|error| panic!("{found:?}: {error:?}"));
    }
}

#[test]
fn every_override_and_every_fragment_stage_is_specialised() {
    for (name, module) in modules() {
        let overrides = module.overrides.iter();
        let overrides: BTreeSet<&str> = overrides.filter_map(|(_, found)| found.name.as_deref()).collect();
        let all = specialisations();
        let of_program: Vec<_> = all.iter().filter(|found| found.program == name).collect();
        for found in &of_program {
            let given: BTreeSet<&str> = found.constants.iter().map(|(name, _)| *name).collect();
            assert_eq!(given, overrides, "{found:?}");
        }
        let stages = module.entry_points.iter();
        let stages = stages.filter(|stage| stage.stage == ShaderStage::Fragment);
        let stages: BTreeSet<&str> = stages.map(|stage| stage.name.as_str()).collect();
        let used: BTreeSet<&str> = of_program.iter().map(|found| found.entry_point).collect();
        assert_eq!(stages, used, "{name}");
        // A question that has one answer needs no override.
        for wanted in overrides {
            let values = of_program.iter().flat_map(|found| &found.constants);
            let values = values.filter(|(name, _)| *name == wanted);
            let values: BTreeSet<String> = values.map(|(_, value)| value.to_string()).collect();
            assert!(values.len() > 1, "{name}: {wanted} is always {values:?}");
        }
    }
}

#[test]
fn every_shader_file_is_part_of_a_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut files = BTreeSet::new();
    for folder in std::fs::read_dir(&root).expect("there are shaders") {
        let folder = folder.expect("readable").path();
        for file in std::fs::read_dir(&folder).expect("shaders/ holds folders only") {
            let path = file.expect("readable").path();
            let name = path.strip_prefix(&root).expect("below it").with_extension("");
            files.insert(name.to_string_lossy().into_owned());
        }
    }
    let used: BTreeSet<String> = programs()
        .iter()
        .flat_map(|program| program.sources)
        .map(|source| source.name.to_owned())
        .collect();
    assert!(!files.is_empty());
    assert_eq!(files, used);
}

/// Names of the structs in a module's buffers, those within arrays and other structs included.
fn shared_in(module: &naga::Module) -> BTreeSet<String> {
    let uniforms = module.global_variables.iter().filter(|(_, variable)| {
        matches!(
            variable.space,
            naga::AddressSpace::Uniform | naga::AddressSpace::Storage { .. }
        )
    });
    let mut pending: Vec<_> = uniforms.map(|(_, variable)| variable.ty).collect();
    let mut names = BTreeSet::new();
    while let Some(handle) = pending.pop() {
        let ty = &module.types[handle];
        match &ty.inner {
            naga::TypeInner::Struct { members, .. } => {
                names.insert(ty.name.clone().expect("structs have names"));
                pending.extend(members.iter().map(|member| member.ty));
            }
            naga::TypeInner::Array { base, .. } => pending.push(*base),
            _ => {}
        }
    }
    names
}

#[test]
fn structs_lie_the_same_in_rust_and_in_the_shaders() {
    let mut found = BTreeMap::new();
    for (program, module) in modules() {
        for (_, ty) in module.types.iter() {
            let naga::TypeInner::Struct { members, span } = &ty.inner else {
                continue;
            };
            let name = ty.name.clone().unwrap_or_default();
            if shared_in(&module).contains(&name) {
                let fields: Vec<_> = members
                    .iter()
                    .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
                    .collect();
                found.insert(name, (program.clone(), *span as usize, fields));
            }
        }
    }
    let shared = shared_structs();
    let names: BTreeSet<&str> = shared.iter().map(|layout| layout.name).collect();
    assert!(!names.is_empty());
    assert_eq!(
        names,
        found.keys().map(String::as_str).collect(),
        "every struct of a buffer is declared on both sides"
    );
    for layout in shared {
        let (program, size, fields) = &found[layout.name];
        let ours: Vec<_> = layout
            .fields
            .iter()
            .map(|field| (field.name.to_owned(), field.offset))
            .collect();
        assert_eq!(
            (&ours, layout.size),
            (fields, *size),
            "{} in {program}",
            layout.name
        );
    }
}

#[test]
fn vertex_inputs_match_the_vertex_buffers() {
    let buffers = nephroid::eye_pass::renderer::vertex_attributes();
    let (_, surface) = modules()
        .into_iter()
        .find(|(name, _)| name == "surface")
        .expect("surfaces are drawn");
    let vertex = surface
        .entry_points
        .iter()
        .find(|entry| entry.stage == ShaderStage::Vertex);
    let arguments = &vertex.expect("it has a vertex stage").function.arguments;
    let naga::TypeInner::Struct { members, .. } = &surface.types[arguments[0].ty].inner else {
        panic!("corners come as a struct");
    };
    let mut inputs = Vec::new();
    for member in members {
        let Some(naga::Binding::Location { location, .. }) = member.binding else {
            panic!("{member:?}")
        };
        let naga::TypeInner::Vector { size, .. } = surface.types[member.ty].inner else {
            panic!("{member:?}")
        };
        inputs.push((location, 4 * size as u64));
    }
    let attributes: Vec<_> = buffers
        .iter()
        .map(|attribute| (attribute.shader_location, attribute.format.size()))
        .collect();
    assert_eq!(inputs, attributes);
}
