//! Every shader is valid, and lays out its structs as Rust does.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use naga::back::pipeline_constants::process_overrides;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Binding, Module, ShaderStage, TypeInner};
use nephroid::eye_pass::renderer::{programs, shared_structs, specialisations, vertex_attributes};

fn modules() -> BTreeMap<String, Module> {
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
                let field = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
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
            (*location, 4 * *size as u64)
        }
        _ => panic!("{member:?}"),
    };
    let buffers = vertex_attributes();
    let attributes = buffers
        .iter()
        .map(|found| (found.shader_location, found.format.size()));
    assert!(members.iter().map(input).eq(attributes));
}
