//! The surfaces of a .glb that have maps as Bevy shows them from above, lit by nothing but its `Lightmap`.
//!
//! Arguments: FILE.glb TEXTURES OUT HALF SIDE. TEXTURES: a folder beside the .glb, made by
//! `nephroid export --format ktx2 --units lux/pi`. OUT: R, G, B and A as 32-bit floats [cd/m²] of SIDE x SIDE
//! pixels, which show |x|, |z| < HALF [m], row 0 at the least z.

use std::path::{Path, PathBuf};

use bevy::app::ScheduleRunnerPlugin;
use bevy::asset::UntypedAssetLoadFailedEvent;
use bevy::camera::{Exposure, Hdr, RenderTarget, ScalingMode};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::window::ExitCondition;
use bevy::world_serialization::WorldInstanceReady;
use serde_json::Value;

/// After so many frames everything that is loaded is in the picture.
const FRAMES: u32 = 30;

#[derive(Resource)]
struct Job {
    textures: String,
    index: Value,
    target: Handle<Image>,
    out: PathBuf,
}

fn main() -> AppExit {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, textures, out, half_m, side]: [String; 5] = arguments.try_into().expect("five arguments");
    let half_m: f32 = half_m.parse().expect("HALF: a number");
    let side: u32 = side.parse().expect("SIDE: a number");
    let file = Path::new(&file);
    let folder = file.parent().expect("FILE.glb: in a folder");
    let index = std::fs::read(folder.join(&textures).join("index.json")).expect("index.json: readable");
    let index = serde_json::from_slice(&index).expect("index.json: JSON");

    let mut app = App::new();
    let no_window = WindowPlugin {
        primary_window: None,
        exit_condition: ExitCondition::DontExit,
        ..default()
    };
    let assets = AssetPlugin {
        file_path: folder.to_string_lossy().into(),
        ..default()
    };
    app.add_plugins(DefaultPlugins.set(no_window).set(assets))
        .add_plugins(ScheduleRunnerPlugin::default())
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Update, (fail, take));

    let world = app.world_mut();
    let mut target = Image::new_target_texture(side, side, TextureFormat::Rgba32Float, None);
    target.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    let target = world.resource_mut::<Assets<Image>>().add(target);
    world.spawn((
        Camera3d::default(),
        Projection::Orthographic(OrthographicProjection {
            scaling_mode: ScalingMode::Fixed {
                width: 2.0 * half_m,
                height: 2.0 * half_m,
            },
            ..OrthographicProjection::default_3d()
        }),
        Transform::from_xyz(0.0, 100.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z),
        RenderTarget::Image(target.clone().into()),
        Exposure::default(),
        Hdr,
        Msaa::Off,
        Tonemapping::None,
    ));
    let name = file.file_name().expect("FILE.glb: a file").to_string_lossy();
    let scene = GltfAssetLabel::Scene(0).from_asset(name.into_owned());
    let scene = world.resource::<AssetServer>().load(scene);
    world.spawn(WorldAssetRoot(scene)).observe(light_up);
    world.insert_resource(Job {
        textures,
        index,
        target,
        out: out.into(),
    });
    app.run()
}

/// Gives each surface its map, as `engines.md` says.
fn light_up(
    _: On<WorldInstanceReady>,
    job: Res<Job>,
    assets: Res<AssetServer>,
    nodes: Query<(&Name, &Children)>,
    parts: Query<(&Mesh3d, &MeshMaterial3d<StandardMaterial>)>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    let stops = job.index["exposure_stops"].as_f64().expect("stops") as f32;
    for texture in job.index["textures"].as_array().expect("textures") {
        let file = texture["file"].as_str().expect("a file");
        for map in texture["maps"].as_array().expect("maps") {
            let is_surface = |(name, _): &(&Name, &Children)| map["surface"] == name.as_str();
            let (_, children) = nodes.iter().find(is_surface).expect("a node");
            let primitive = map["primitive"].as_u64().expect("a number") as usize;
            let mut primitives = children.iter().filter(|child| parts.contains(*child));
            let part = primitives.nth(primitive).expect("a primitive");
            let (mesh, material) = parts.get(part).expect("a mesh");
            if map["uv_set"] == "TEXCOORD_0" {
                let mut mesh = meshes.get_mut(mesh).expect("a mesh");
                let uvs = mesh.attribute(Mesh::ATTRIBUTE_UV_0).expect("TEXCOORD_0");
                let uvs = uvs.clone();
                mesh.insert_attribute(Mesh::ATTRIBUTE_UV_1, uvs);
            }
            let mut material = materials.get_mut(material).expect("a material");
            material.lightmap_exposure = (-stops).exp2();
            commands.entity(part).insert(Lightmap {
                image: assets.load(format!("{}/{file}", job.textures)),
                ..default()
            });
        }
    }
}

/// Ends where a file does not load.
fn fail(mut failures: MessageReader<UntypedAssetLoadFailedEvent>, mut exit: MessageWriter<AppExit>) {
    for failure in failures.read() {
        eprintln!("{}: {}", failure.path, failure.error);
        exit.write(AppExit::error());
    }
}

/// Asks for the picture when the maps are there.
fn take(
    maps: Query<&Lightmap>,
    without: Query<Entity, (With<Mesh3d>, Without<Lightmap>)>,
    assets: Res<AssetServer>,
    job: Res<Job>,
    mut frames: Local<u32>,
    mut commands: Commands,
) {
    if maps.is_empty() || !maps.iter().all(|map| assets.is_loaded(&map.image)) {
        return;
    }
    for part in &without {
        commands.entity(part).insert(Visibility::Hidden);
    }
    *frames += 1;
    if *frames == FRAMES {
        let picture = Readback::texture(job.target.clone());
        commands.spawn(picture).observe(write);
    }
}

/// Undoes the camera's exposure, keeps the picture and ends.
fn write(picture: On<ReadbackComplete>, job: Res<Job>, mut exit: MessageWriter<AppExit>) {
    let exposure = Exposure::default().exposure();
    let (values, _) = picture.data.as_chunks();
    let values = values.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let luminance: Vec<u8> = values
        .flat_map(|value| (value / exposure).to_le_bytes())
        .collect();
    std::fs::write(&job.out, luminance).expect("OUT: writable");
    exit.write(AppExit::Success);
}
