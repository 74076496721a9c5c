//! Scenes that estimators find hard, against brute force on the same meshes; and brute force itself.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nephroid::export::manifest::SceneSummary;
use nephroid::export::pfm;
use nephroid::illumination::compare::{Agreement, relative_rmse};
use nephroid::illumination::map::estimated_relative_rmse;
use nephroid::illumination::{Layer, parametrise};
use nephroid::study::agreement::{caustic_luminance, pair_maps};
use serde::{Deserialize, Serialize};

use support::hard_scenes::{self, Shading, TinyBall};
use support::laws::law::deposited_w;
use support::laws::{Baked, Table};
use support::prelude::*;
use support::project_file;
use support::tools::{bake, brute, builtin_scene, energy_fault, map_of, settings, to};

/// Texels of all maps across and down.
const SIDE: usize = 64;

/// Relative RMSE that all these scenes should come down to.
const AIM: f64 = 0.02;

/// Largest noise of a reference.
const LARGEST_NOISE: f64 = 0.007;

const FOLDER: &str = "tests/goldens/brute_force";
const INDEX: &str = "index.json";

/// Scenes, with the rays that bring the noise of their references below [`LARGEST_NOISE`].
fn hard() -> Vec<(f64, Scene)> {
    let tilted = hard_scenes::with_tilted_floor;
    let cut = hard_scenes::with_cut_floor;
    let mut all = vec![
        (8e6, hard_scenes::ring_with_blocker()),
        (28e6, hard_scenes::ball_with_blocker()),
        (120e6, hard_scenes::torus(parts::mirror())),
        (6e6, hard_scenes::torus(parts::dielectric("glass", 1.5))),
        (30e6, hard_scenes::grazing_pool()),
        (30e6, hard_scenes::mirror_bowl()),
        (5e6, hard_scenes::glass_bowl()),
        (5e6, hard_scenes::cut_glass()),
        (4e6, hard_scenes::tiny_ball(TinyBall::Ball)),
        (2e6, hard_scenes::tiny_ball(TinyBall::Mirror)),
        (5e6, hard_scenes::balls_in_series()),
        (6e6, hard_scenes::ball_in_a_room()),
        (4e6, tilted(hard_scenes::ball())),
        (6e6, cut(hard_scenes::ball())),
        (20e6, tilted(hard_scenes::grazing_pool())),
        (50e6, cut(hard_scenes::grazing_pool())),
    ];
    for segments in [64, 256, 1024] {
        for shading in [Shading::Smooth, Shading::Flat] {
            all.push((8e6, hard_scenes::ring(segments, shading)));
        }
    }
    all
}

pub fn fill(t: &mut Table) {
    if std::env::var_os("NEPHROID_WRITE_REFERENCES").is_some() {
        write_references();
    }
    t.case("shadow-two-texels-off")
        .check("is noticed", moved_shadow_is_noticed);
    t.case("brute-force")
        .check("noise falls faster than that of random rays", noise_falls)
        .check(
            "neither threads nor half sets leave a trace",
            threads_leave_no_trace,
        );
    for (name, file, rays) in [("ring", "S1", 1_000_000), ("mirror", "S5", 800_000)] {
        t.case(format!("brute-force-{name}"))
            .check("agrees with the independent solver within its noise", move || {
                agrees(name, file, rays)
            });
    }
    for (_, scene) in hard() {
        let name = scene.name.replace('_', "-");
        let copy = scene.clone();
        t.case(&name)
            .check("bundles and photons come as close as asked", move || {
                auto_comes_close(&copy)
            });
        t.case(format!("{name}-by-splats"))
            .splat(scene.clone(), 2e3, SIDE)
            .must("something arrives", |bake| deposited_w(bake) > 0.0);
        t.case(format!("{name}-reference"))
            .check("few rays of today's tracer see the same light", move || {
                few_rays_agree(&scene)
            });
    }
    t.case("shadow-edges-of-a-ring-with-blocker")
        .bake(hard_scenes::ring_with_blocker(), 0.01, SIDE)
        .measure("texels off by more than one", 0.0, displaced_on_floor);
    t.case("tiny-ball-and-mirror-by-splats")
        .splat(hard_scenes::tiny_ball(TinyBall::Both), 2e3, SIDE)
        .must("something arrives", |bake| deposited_w(bake) > 0.0);
}

/// Relative RMSE over all maps and by area, without the reference's noise.
fn distance(scene: &Scene, baked: &[IlluminationMap]) -> f64 {
    let (maps, noise) = stored(scene);
    assert!(noise <= LARGEST_NOISE, "{noise}");
    let pairs = pair_maps(baked, &maps).expect("maps of one size");
    let rmse = Agreement::of(&pairs)
        .expect("a reference with light")
        .relative_rmse;
    (rmse * rmse - noise * noise).max(0.0).sqrt()
}

fn auto_comes_close(scene: &Scene) {
    let result = bake(scene.clone(), &to(AIM, SIDE));
    let error = distance(scene, &result.maps);
    let estimate = result.estimated_relative_rmse.expect("an estimate");
    // The light of cut glass is a few bright facets, whose photons tell little.
    let most = if scene.name == "cut_glass" { 1.5 * AIM } else { AIM };
    assert!(error <= most, "{}: {error}, estimated {estimate}", scene.name);
    assert!(
        (0.5..=2.0).contains(&(error / estimate)),
        "{}: {error}, estimated {estimate}",
        scene.name
    );
}

/// Texels that are brighter or darker than everything within one texel of them is in the reference, by more than 5 %
/// and a fiftieth of the mean: light or shadow that lies farther from its place than a texel.
fn displaced_texels(image: &[f64], reference: &[f64]) -> usize {
    let mean = reference.iter().sum::<f64>() / reference.len() as f64;
    let displaced = |texel: usize| {
        let (column, row) = (texel % SIDE, texel / SIDE);
        let near = |centre: usize| centre.saturating_sub(1)..(centre + 2).min(SIDE);
        let texels = near(row).flat_map(|row| near(column).map(move |column| row * SIDE + column));
        let (low, high) = texels.fold((f64::INFINITY, 0.0_f64), |(low, high), texel| {
            (low.min(reference[texel]), high.max(reference[texel]))
        });
        let slack = 0.02 * mean;
        image[texel] < 0.95 * low - slack || image[texel] > 1.05 * high + slack
    };
    (0..image.len()).filter(|&texel| displaced(texel)).count()
}

fn displaced_on_floor(bake: &Baked) -> f64 {
    let (maps, _) = stored(&bake.scene);
    let is_floor = |map: &&IlluminationMap| bake.scene.objects[map.chart.object()].name == "floor";
    let [image, reference] = [&bake.result.maps, &maps]
        .map(|maps| caustic_luminance(maps.iter().find(is_floor).expect("a lit floor")));
    displaced_texels(&image, &reference) as f64
}

fn moved_shadow_is_noticed() {
    let image = caustic_luminance(&stored(&hard_scenes::ring_with_blocker()).0[0]);
    assert_eq!(displaced_texels(&image, &image), 0);
    let mut moved = image.clone();
    moved.rotate_right(2);
    assert!(displaced_texels(&moved, &image) > 20);
}

fn few_rays_agree(scene: &Scene) {
    let (maps, noise) = stored(scene);
    assert!(noise <= LARGEST_NOISE, "{noise}");
    let few = brute(scene, &settings(1.0, SIDE), 60_000).maps;
    let agreement = Agreement::of(&pair_maps(&few, &maps).expect("maps of one size")).expect("light");
    let of_noise = agreement.relative_rmse / estimated_relative_rmse(&few).expect("light");
    assert!(
        (0.6..1.5).contains(&of_noise),
        "{}: {agreement:?}, {of_noise}",
        scene.name
    );
    assert!(
        (agreement.flux_ratio - 1.0).abs() < 0.02,
        "{}: {agreement:?}",
        scene.name
    );
}

fn agrees(name: &str, file: &str, rays: u64) {
    let scene = builtin_scene(name);
    let result = brute(&scene, &settings(1.0, 64), rays);
    assert_eq!(energy_fault(&result), None, "{name}");
    let map = map_of(&result, &scene, "floor");
    // 64 × 64 means of a 256 × 256 map.
    let mut means = vec![0.0; 64 * 64];
    for (index, value) in support::reference_map(file).iter().enumerate() {
        means[index / 256 / 4 * 64 + index % 256 / 4] += value / 16.0;
    }
    let rmse = relative_rmse(&caustic_luminance(map), &means).expect("light");
    let noise = map.estimated_relative_rmse.expect("a noise");
    assert!(
        noise < 0.03 && (0.8..1.25).contains(&(rmse / noise)),
        "{name}: off by {rmse}, noise {noise}"
    );
}

fn noise_falls() {
    let scene = builtin_scene("ring");
    let noise = |rays| estimated_relative_rmse(&brute(&scene, &settings(1.0, 32), rays).maps).expect("light");
    let (few, many) = (noise(20_000), noise(320_000));
    assert!(
        many < few / 4.5,
        "{few} with 20 k rays, {many} with 16 times as many"
    );
}

fn threads_leave_no_trace() {
    let with = |threads, seed| {
        let settings = BakeSettings {
            threads,
            seed,
            ..settings(1.0, 16)
        };
        brute(&builtin_scene("ball"), &settings, 20_000).maps.remove(0)
    };
    let (one, three, other) = (with(1, 0), with(3, 0), with(3, 1));
    assert_eq!((&one.layers, &one.error), (&three.layers, &three.error));
    assert_ne!(one.layers, other.layers);
}

/// What the index says of one scene.
#[derive(Serialize, Deserialize)]
struct Entry {
    geometry_hash: String,
    rays: u64,
    noise: f64,
    /// File by surface.
    maps: BTreeMap<String, String>,
}

fn read_index() -> BTreeMap<String, Entry> {
    match std::fs::read(project_file(FOLDER).join(INDEX)) {
        Ok(bytes) => serde_json::from_slice(&bytes).expect("a sound index"),
        Err(_) => BTreeMap::new(),
    }
}

/// The stored entry of a scene, if it is of today's shape.
fn fitting(index: &mut BTreeMap<String, Entry>, scene: &Scene) -> Option<Entry> {
    let entry = index.remove(&scene.name)?;
    (entry.geometry_hash == SceneSummary::of(scene).geometry_hash).then_some(entry)
}

/// The stored maps of a scene, and their noise.
fn stored(scene: &Scene) -> (Vec<IlluminationMap>, f64) {
    let entry = fitting(&mut read_index(), scene).unwrap_or_else(|| {
        panic!(
            "no reference of {} as it is: make it by NEPHROID_WRITE_REFERENCES=1",
            scene.name
        )
    });
    let map = |(surface, file): (&String, &String)| read_map(scene, surface, file);
    (entry.maps.iter().map(map).collect(), entry.noise)
}

fn read_map(scene: &Scene, surface: &str, file: &str) -> IlluminationMap {
    let path: PathBuf = project_file(FOLDER).join(file);
    let bytes = std::fs::read(&path).expect("a map beside its index");
    let image = pfm::decode(&bytes, file).expect("a sound map");
    let grid = image.luminance("").expect("one channel");
    let mut names = scene.objects.iter().map(|object| object.name.as_str());
    let object = names
        .position(|name| name == surface)
        .expect("a surface of the scene");
    let chart = parametrise(object, scene.objects[object].mesh_in_scene()).expect("an area");
    IlluminationMap {
        chart: Arc::new(chart.chart(grid.width, grid.height)),
        layers: vec![Layer {
            kind: LayerKind::Caustic,
            irradiance: grid.values.iter().map(|value| [*value as f32; 3]).collect(),
        }],
        error: None,
        estimated_relative_rmse: None,
        estimated_visible: None,
    }
}

/// Makes the references that are missing, outdated or too noisy, in some 25 minutes of CPU time:
/// `NEPHROID_WRITE_REFERENCES=1 cargo test --test laws references`.
fn write_references() {
    for (reference_rays, scene) in hard() {
        let mut index = read_index();
        if fitting(&mut index, &scene).is_some_and(|entry| entry.noise <= LARGEST_NOISE) {
            continue;
        }
        let result = brute(&scene, &settings(1.0, SIDE), reference_rays as u64);
        let write = |map: &IlluminationMap| {
            let surface = scene.objects[map.chart.object()].name.clone();
            let file = format!("{}_{}.pfm", scene.name, surface.replace(' ', "_"));
            let mut bytes = format!("Pf\n{SIDE} {SIDE}\n-1.0\n").into_bytes();
            let values = caustic_luminance(map);
            bytes.extend(values.into_iter().flat_map(|value| (value as f32).to_le_bytes()));
            std::fs::write(project_file(FOLDER).join(&file), bytes).expect("a writable folder");
            (surface, file)
        };
        let entry = Entry {
            geometry_hash: SceneSummary::of(&scene).geometry_hash,
            rays: result.counts.rays,
            noise: estimated_relative_rmse(&result.maps).expect("light"),
            maps: result.maps.iter().map(write).collect(),
        };
        index.insert(scene.name.clone(), entry);
        let json = serde_json::to_vec_pretty(&index).expect("JSON");
        std::fs::write(project_file(FOLDER).join(INDEX), json).expect("a writable folder");
    }
}
