//! The table, figures and plates of the paper (Collins 1994, *Adaptive Splatting for Specular to Diffuse Light
//! Transport*).

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::plot::Plot;
use super::references::Reference;
use super::sweep::{
    ARD, Against, Bench, CPU_S, Column, EYE_PASS_CPU_S, FLUX_RATIO, Group, RAYS, RELATIVE_RMSE, Sweep,
    Variant, column,
};
use super::table::Cell;
use crate::bake::Bake;
use crate::error::{Error, Result};
use crate::geometry::Ray;
use crate::light_pass::path::{PathLimits, PathTracer};
use crate::optics::LinearSrgb;
use crate::scene::builtin::{self, parts, pool, shapes};
use crate::scene::{Camera, LightKind, Mesh, Scene};
use crate::settings::{
    BakeSettings, ErrorMetric, Estimator, Footprint, ItemBufferKind, Kernel, KernelSampling, RayPlacement,
    Sigma,
};
use crate::transport::{MediumStack, Tracer};
use crate::units::Flux;

/// The paper's second densest lattice [1/sr].
const DENSITY_PER_SR: f64 = 79_577.5;

pub(super) type Method = (&'static str, fn(f64) -> BakeSettings);

/// Targets of bakes by the default estimator beside those of the paper's densities.
const AUTO_TARGETS: [f64; 3] = [0.02, 0.01, 0.005];

const AS_PAPER: Method = ("splat, as the paper", paper);
pub(super) const SPLAT: Method = ("splat", splat);

/// Explains "as the paper".
const AS_PAPER_NOTE: &str = "As the paper: jittered rays, a cube around the light, discs of the wavefront's area, point samples \
                             of a gaussian with σ = 1.";

/// The paper's own choices.
pub(super) fn paper(density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        footprint: Footprint::Disc,
        rays: RayPlacement::Jittered,
        item_buffer: ItemBufferKind::Cube,
        kernel_sampling: KernelSampling::Point,
        ..splat(density_per_sr)
    }
}

pub(super) fn splat(density_per_sr: f64) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        ..BakeSettings::splat()
    }
}

/// The default estimator, to a relative RMSE.
pub(super) fn auto(target: f64) -> BakeSettings {
    BakeSettings {
        max_error: Some(target),
        error_metric: ErrorMetric::Rmse,
        ..BakeSettings::of(Estimator::Auto)
    }
}

fn auto_name(target: f64) -> String {
    format!("auto to {} %", 100.0 * target)
}

/// A built-in scene, given its name on the command line.
pub(super) fn scene(name: &str) -> Result<Arc<Scene>> {
    let scene = builtin::build(name).map(Arc::new);
    scene.ok_or_else(|| Error::failure(name, "there is no built-in scene of that name", "report this"))
}

/// A built-in scene and its analytic map.
pub(super) fn scene_and_truth(name: &str) -> Result<(Arc<Scene>, Against)> {
    let scene = scene(name)?;
    match Reference::analytic(&scene)? {
        Some(reference) => Ok((scene, Against::Known(reference))),
        None => Err(Error::failure(name, "it has no analytic map", "report this")),
    }
}

const fn error_against_rays(file: &'static str, by: &'static [&'static str]) -> Plot {
    Plot::new(file, ["rays", "relative_rmse"], by)
}

/// A glass object over a floor of half width `half_m`, below a lamp.
pub(super) fn over_a_floor(half_m: f64, (name, mesh): (&str, Mesh), lamp: DVec3) -> Arc<Scene> {
    let mut scene = parts::reference_scene(half_m);
    scene.name = name.into();
    parts::add(&mut scene, name, mesh, parts::dielectric("glass", 1.5));
    scene.lights.push(parts::point_light("light", lamp, Flux(100.0)));
    Arc::new(scene)
}

pub(super) fn table1(bench: &Bench) -> Result<Sweep> {
    /// Rays per steradian, light rays, light-pass seconds, eye-pass seconds (on a 486 at 66 MHz).
    const TABLE: [(f64, u64, f64, f64); 3] = [
        (7_957.7, 3_467, 11.57, 148.33),
        (79_577.5, 34_680, 53.27, 144.72),
        (795_774.7, 346_813, 379.22, 135.96),
    ];

    // The paper tabulates the time of the eye pass, too, so that each variant is also rendered.
    let (scene, against) = scene_and_truth("ring")?;
    let mut variants = Vec::new();
    let mut add = |labels: Vec<Cell>, settings: BakeSettings| {
        let file = format!("table1-{}", variants.len() + 1);
        let settings = bench.at(settings, bench.side());
        variants.push(Variant::new(labels, &scene, settings).seen(file, &scene.cameras[0]));
    };

    // Measured rows stand beside those of the paper. Bundles have no counterpart there.
    for &(density, rays, light_pass_s, eye_pass_s) in bench.some(&TABLE, 2) {
        let (name, settings) = AS_PAPER;
        let paper = [Cell::from(rays), light_pass_s.into(), eye_pass_s.into()];
        let labels = [density.into(), name.into()].into_iter().chain(paper);
        add(labels.collect(), settings(density));
    }
    for &target in bench.some(&AUTO_TARGETS, 2) {
        let name = auto_name(target).into();
        let labels = vec![Cell::Empty, name, Cell::Empty, Cell::Empty, Cell::Empty];
        add(labels, auto(target));
    }
    Ok(Sweep {
        note: format!(
            "`ring` in place of the paper's test scene, whose measures it does not give. {AS_PAPER_NOTE}"
        ),
        labels: &[
            "density_per_sr",
            "estimator",
            "paper_rays",
            "paper_light_pass_s",
            "paper_eye_pass_s",
        ],
        columns: &[RAYS, RELATIVE_RMSE, ARD, CPU_S, EYE_PASS_CPU_S],
        groups: vec![Group { against, variants }],
        ..Sweep::default()
    })
}

pub(super) fn rays(bench: &Bench) -> Result<Sweep> {
    const DENSITIES: [f64; 7] = [1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6];
    let (scene, against) = scene_and_truth("ring")?;
    let at_targets = bench.some(&AUTO_TARGETS, 2).iter().map(|&target| {
        let labels = vec!["auto".into(), Cell::Empty];
        Variant::new(labels, &scene, bench.at(auto(target), bench.side()))
    });
    let at_targets: Vec<Variant> = at_targets.collect();
    let variants = [AS_PAPER, SPLAT].into_iter().flat_map(|(name, settings)| {
        let densities = bench.some(&DENSITIES, 4).iter();
        let scene = &scene;
        densities.map(move |&density| {
            let settings = bench.at(settings(density), bench.side());
            Variant::new(vec![name.into(), density.into()], scene, settings)
        })
    });
    Ok(Sweep {
        note: format!("`ring`. {AS_PAPER_NOTE}"),
        labels: &["estimator", "density_per_sr"],
        columns: &[RAYS, CPU_S, RELATIVE_RMSE, ARD],
        groups: vec![Group {
            variants: variants.chain(at_targets).collect(),
            against,
        }],
        plots: const { &[error_against_rays("rays", &["estimator"])] },
        ..Sweep::default()
    })
}

pub(super) fn sigma(bench: &Bench) -> Result<Sweep> {
    const SIGMAS: [f64; 12] = [0.1, 0.3, 0.5, 1.0, 3.0, 0.2, 0.4, 0.7, 0.9, 1.4, 2.0, 5.0];
    /// σ is in squared lengths. In units of half the side of a square of the footprint's area, instead of the radius of
    /// its disc, the same kernel has a σ that is larger by this factor.
    const PER_HALF_SIDE: f64 = 4.0 / std::f64::consts::PI;

    // Jitter and point samples add noise that a wider kernel hides, so that sigma is varied with and without them.
    let (scene, against) = scene_and_truth("ring")?;
    let even = BakeSettings {
        rays: RayPlacement::Lattice,
        ..paper(DENSITY_PER_SR)
    };
    let mut variants = Vec::new();
    for (name, kernel) in [
        ("as the paper", paper(DENSITY_PER_SR)),
        ("as the paper, without jitter", even),
        ("ellipses, integrated", splat(DENSITY_PER_SR)),
    ] {
        for &sigma in bench.some(&SIGMAS, 5) {
            let labels = vec![name.into(), sigma.into(), (sigma * PER_HALF_SIDE).into()];
            let settings = BakeSettings {
                sigma: Sigma::Constant(sigma),
                ..bench.at(kernel.clone(), bench.side())
            };
            variants.push(Variant::new(labels, &scene, settings));
        }
    }
    Ok(Sweep {
        note: format!(
            "`ring`, {DENSITY_PER_SR} rays/sr. {AS_PAPER_NOTE} The paper writes the kernel as exp(−r²/2σ) without the unit of r. Here \
             r is 1 on the edge of the disc of the footprint's area; `sigma_half_sides` has r = 1 at half a side of the square of \
             that area."
        ),
        labels: &["kernel", "sigma", "sigma_half_sides"],
        columns: &[RELATIVE_RMSE, ARD],
        groups: vec![Group { against, variants }],
        plots: const { &[Plot::new("sigma", ["sigma", "relative_rmse"], &["kernel"])] },
        ..Sweep::default()
    })
}

pub(super) fn resolution(bench: &Bench) -> Result<Sweep> {
    let scene = scene("ring")?;
    let finer = auto(if bench.quick { 0.005 } else { 0.002 });
    let groups = bench.some(&[30, 100, 300], 2).iter().map(|&side| {
        let ways = [("splat", splat(DENSITY_PER_SR)), ("auto", auto(0.01))];
        let variants = ways.map(|(name, settings)| {
            let labels = vec![name.into(), (side as u64).into()];
            Variant::new(labels, &scene, bench.at(settings, side))
                .seen(format!("plate6-{side}-{name}"), &scene.cameras[0])
                .in_sheet("plate6-maps")
        });
        Group {
            against: Against::Bake(Arc::clone(&scene), Box::new(bench.at(finer.clone(), side))),
            variants: variants.into(),
        }
    });
    Ok(Sweep {
        note: format!(
            "`ring`, splats at {DENSITY_PER_SR} rays/sr and bundles to 1 %; each size against bundles to 0.2 % on a map of the same \
             size, so that the error is what rays and kernels leave, not what texels average."
        ),
        labels: &["estimator", "side_texels"],
        columns: &[RAYS, CPU_S, EYE_PASS_CPU_S, RELATIVE_RMSE, ARD],
        groups: groups.collect(),
        sheet_columns: 7,
        ..Sweep::default()
    })
}

const KERNELS: &[Column] = &[
    RELATIVE_RMSE,
    ARD,
    column("paper_rms", |m| {
        let square = |pair: &crate::illumination::compare::TexelPair| (pair.image - pair.reference).powi(2);
        m.pairs.iter().map(square).sum::<f64>().sqrt().into()
    }),
    column("paper_ard", |m| {
        let lit = m.pairs.iter().filter(|pair| pair.reference > 0.0);
        let sum: f64 = lit
            .map(|pair| (pair.image - pair.reference).abs() / pair.reference)
            .sum();
        Cell::Share(sum / m.pairs.len() as f64)
    }),
];

pub(super) fn kernels(bench: &Bench) -> Result<Sweep> {
    const SHAPES: [(&str, Kernel, Sigma); 7] = [
        ("box", Kernel::Box, Sigma::Constant(1.0)),
        ("disc", Kernel::Disc, Sigma::Constant(1.0)),
        ("cone", Kernel::Cone, Sigma::Constant(1.0)),
        ("gaussian 0.5", Kernel::Gaussian, Sigma::Constant(0.5)),
        ("gaussian 1", Kernel::Gaussian, Sigma::Constant(1.0)),
        ("gaussian 2", Kernel::Gaussian, Sigma::Constant(2.0)),
        ("gaussian adaptive", Kernel::Gaussian, Sigma::Adaptive),
    ];

    // Every shape is combined with every footprint, on jittered and on even rays: their errors are not independent.
    let (scene, against) = scene_and_truth("ring")?;
    let mut variants = Vec::new();
    for (placement, rays) in [
        ("jittered", RayPlacement::Jittered),
        ("even", RayPlacement::Lattice),
    ] {
        for (size, footprint) in [
            ("neighbours", Footprint::Disc),
            ("distance", Footprint::Distance),
            ("fixed", Footprint::Fixed),
        ] {
            for (shape, kernel, sigma) in SHAPES {
                let settings = BakeSettings {
                    rays,
                    footprint,
                    kernel,
                    sigma,
                    ..bench.at(paper(DENSITY_PER_SR), bench.side())
                };
                let labels = vec![placement.into(), shape.into(), size.into()];
                let variant = Variant::new(labels, &scene, settings);
                variants.push(variant.in_sheet(format!("kernels-{placement}-{size}")));
            }
        }
    }
    Ok(Sweep {
        note: format!(
            "`ring`, {DENSITY_PER_SR} rays/sr, point-sampled kernels, the cube. `paper_rms` is the paper's (5.1) [W/m²], which sums \
             without a mean, `paper_ard` its (5.2), which divides by every texel that is not black."
        ),
        labels: &["placement", "kernel", "size"],
        columns: KERNELS,
        groups: vec![Group { against, variants }],
        sheet_columns: 8,
        ..Sweep::default()
    })
}

pub(super) fn connectivity(bench: &Bench) -> Result<Sweep> {
    let (scene, against) = scene_and_truth("ring")?;
    let density = if bench.quick { 8e3 } else { DENSITY_PER_SR };
    let variant = |name: &str, hits: Option<u64>, settings: BakeSettings| Variant {
        estimate: hits.map(|_| nearest_hits as fn(&Variant, Bake) -> Bake),
        sheet: Some("connectivity".into()),
        ..Variant::new(
            vec![name.into(), hits.map_or(Cell::Empty, Cell::Count)],
            &scene,
            bench.at(settings, bench.side() / 2),
        )
    };
    let nearest = [4, 16, 64].map(|hits| variant("nearest hits", Some(hits), splat(density)));
    let areas = [(AS_PAPER.0, paper(density)), ("auto", auto(0.01))];
    let areas = areas.map(|(name, settings)| variant(name, None, settings));
    Ok(Sweep {
        note: format!(
            "`ring`, {density} rays/sr; bundles to 1 %. A density estimate sums the flux of the hits nearest to a texel's centre and divides by the \
             disc that holds them. {AS_PAPER_NOTE}"
        ),
        labels: &["estimate", "hits"],
        columns: &[RAYS, RELATIVE_RMSE, ARD],
        groups: vec![Group {
            against,
            variants: nearest.into_iter().chain(areas).collect(),
        }],
        sheet_columns: 3,
        ..Sweep::default()
    })
}

/// Replaces the irradiance of a bake by the density of the nearest hits, on the floor of a built-in scene.
fn nearest_hits(variant: &Variant, mut result: Bake) -> Bake {
    /// Half the side of the floor [m].
    const HALF_M: f64 = 1.0;
    let count = variant.labels[1].value().unwrap_or(1.0) as usize;
    let hits = hits(&variant.scene, variant.settings.density_per_sr);
    result.counts.rays = hits.len() as u64;
    for map in &mut result.maps {
        let (width, height) = (map.width(), map.height());
        let texel = |index: usize| {
            let at = |index: usize, side: usize| HALF_M * ((2 * index + 1) as f64 / side as f64 - 1.0);
            let centre = DVec2::new(at(index % width, width), at(index / width, height));
            let near = hits
                .iter()
                .map(|(place, flux_w)| (place.distance_squared(centre), *flux_w));
            let mut near: Vec<(f64, f64)> = near.collect();
            let last = count.min(near.len()).saturating_sub(1);
            near.select_nth_unstable_by(last, |a, b| a.0.total_cmp(&b.0));
            let flux_w: f64 = near[..=last].iter().map(|hit| hit.1).sum();
            [(flux_w / (std::f64::consts::PI * near[last].0)) as f32; 3]
        };
        for layer in &mut map.layers {
            layer.irradiance = (0..width * height).into_par_iter().map(texel).collect();
        }
    }
    result
}

/// Hits of the lamps' light on the floor: position [m] and flux [W]. Directions lie on a spiral of constant density.
fn hits(scene: &Arc<Scene>, density_per_sr: f64) -> Vec<(DVec2, f64)> {
    let tracer = Tracer::new(Arc::clone(scene));
    let limits = PathLimits::smooth(16, 1e-4);
    let mut paths = PathTracer::without_ledger(&tracer, limits);
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    let mut hits = Vec::new();
    for light in &scene.lights {
        let LightKind::Point { position, intensity } = light.kind else {
            continue;
        };
        let sphere_sr = 4.0 * std::f64::consts::PI;
        let count = (sphere_sr * density_per_sr).round();
        let flux_w = LinearSrgb::grey(intensity.0 * light.colour.luminance() * sphere_sr / count);
        for index in 0..count as u64 {
            let height = 1.0 - (2.0 * index as f64 + 1.0) / count;
            let turn = DVec2::from_angle(std::f64::consts::TAU * (index as f64 * golden).fract());
            let across = turn * (1.0 - height * height).sqrt();
            let ray = Ray {
                origin: position,
                direction: DVec3::new(across.x, height, across.y),
            };
            paths.trace(ray, flux_w, &MediumStack::default(), |arrival, _| {
                let place = DVec2::new(arrival.point.x, arrival.point.z);
                hits.push((place, arrival.flux_w.luminance()));
            });
        }
    }
    hits
}

pub(super) fn item_buffer(bench: &Bench) -> Result<Sweep> {
    // Both item buffers launch jittered rays at the same densities, so that only the cells differ.
    let mut groups = Vec::new();
    for &name in bench.some(&["ring", "ball"], 1) {
        let (scene, against) = scene_and_truth(name)?;
        let mut variants = Vec::new();
        for (kind, item_buffer) in [("equal", ItemBufferKind::Equal), ("cube", ItemBufferKind::Cube)] {
            for &density in bench.some(&[1e3, 1e4, 1e5, 1e6], 2) {
                let settings = BakeSettings {
                    item_buffer,
                    rays: RayPlacement::Jittered,
                    ..bench.at(splat(density), bench.side())
                };
                variants.push(Variant::new(
                    vec![name.into(), kind.into(), density.into()],
                    &scene,
                    settings,
                ));
            }
        }
        groups.push(Group { against, variants });
    }
    Ok(Sweep {
        note: "Splats of jittered rays. The cube's cells have equal areas on its faces, so that their solid angles differ by up to 5.2 \
               times; each ray carries the flux of its own cell's solid angle."
            .into(),
        labels: &["scene", "item_buffer", "density_per_sr"],
        columns: &[RAYS, FLUX_RATIO, RELATIVE_RMSE, ARD],
        groups,
        plots: const { &[error_against_rays("item-buffer", &["scene", "item_buffer"])] },
        ..Sweep::default()
    })
}

pub(super) fn pool_plates(bench: &Bench) -> Result<Sweep> {
    // The same waves as displacement, as bumps on one polygon, and as meshes of rising resolution.
    let (mesh, against) = scene_and_truth("pool")?;
    let waves = mesh.materials.iter().find_map(|material| material.waves.clone());
    let Some(waves) = waves else {
        return Ok(Sweep::default());
    };
    let mut waters = vec![
        ("sheet that waves lift and bend".to_string(), Arc::clone(&mesh)),
        ("one polygon with bumps".to_string(), scene("pool-bump")?),
    ];
    for &quads in bench.some(&[16, 32, 64, 128, 512], 1) {
        let mut coarse = Scene::clone(&mesh);
        coarse
            .objects
            .retain(|object| mesh.materials[object.material].surface.is_receiver());
        let water = pool::meshed(DVec3::Y, [1.5; 2], [quads; 2], &waves);
        parts::add(&mut coarse, "water", water, parts::dielectric("water", 1.333));
        waters.push((format!("mesh of {quads} × {quads} quads"), Arc::new(coarse)));
    }

    // All are compared with displaced water, whose light the plates show from above and from beneath.
    let mut variants: Vec<Variant> = Vec::new();
    for (name, scene) in &waters {
        let labels = vec![name.clone().into(), Cell::Count(scene.triangle_count() as u64)];
        variants.push(Variant::new(labels, scene, bench.at(auto(0.005), bench.side())));
    }
    let from = |file: &str, position: DVec3| {
        let target = DVec3::new(0.0, 0.1, 0.0);
        (
            file.to_string(),
            Camera::look_at(file, position, target, 55_f64.to_radians()),
        )
    };
    variants[0].views = vec![
        from("plate7-above", DVec3::new(1.6, 2.6, 2.4)),
        from("plate8-below", DVec3::new(0.9, 0.7, 0.9)),
    ];
    Ok(Sweep {
        note: "`pool`, bundles to 0.5 %, against smooth displaced water.".into(),
        labels: &["water", "triangles"],
        columns: &[RAYS, CPU_S, RELATIVE_RMSE, ARD],
        groups: vec![Group { against, variants }],
        ..Sweep::default()
    })
}

pub(super) fn complex(bench: &Bench) -> Result<Sweep> {
    /// Quads around and along the knot's tube; the second mesh has about as many triangles as the paper's object
    /// (3,958).
    const MESHES: [(u32, u32); 3] = [(11, 45), (22, 90), (44, 180)];
    let settings = bench.at(auto(if bench.quick { 0.05 } else { 0.01 }), bench.side());
    let knot = |(around, along)| over_a_floor(1.0, ("knot", tube(around, along)), DVec3::new(0.4, 2.4, 0.3));
    let mut variants = Vec::new();
    for &mesh in bench.some(&MESHES, 2) {
        let triangles = 2 * u64::from(mesh.0) * u64::from(mesh.1);
        let scene = knot(mesh);
        let variant = Variant::new(vec![triangles.into()], &scene, settings.clone()).in_sheet("complex-maps");
        variants.push(match mesh == MESHES[1] {
            true => variant.seen("plate9", &scene.cameras[0]),
            false => variant,
        });
    }
    let finest = knot(if bench.quick { MESHES[2] } else { (88, 360) });
    Ok(Sweep {
        note: "A trefoil knot of glass over a floor, bundles to 1 %, against the finest mesh: the error is that of the mesh.".into(),
        labels: &["triangles"],
        columns: &[RAYS, CPU_S, RELATIVE_RMSE, ARD],
        groups: vec![Group {
            against: Against::Bake(finest, Box::new(settings)),
            variants,
        }],
        plots: const { &[Plot::new("complex", ["triangles", "relative_rmse"], &[])] },
        sheet_columns: 4,
        ..Sweep::default()
    })
}

/// The tube of a trefoil knot.
fn tube(around: u32, along: u32) -> Mesh {
    const CENTRE: DVec3 = DVec3::new(0.0, 0.55, 0.0);
    // Radii [m] of the ring that it winds around, of its winding, of its tube.
    let [ring_m, winding_m, tube_m] = [0.32, 0.13, 0.075];
    let line = |t: f64| {
        let angle = std::f64::consts::TAU * t;
        let reach_m = ring_m + winding_m * (3.0 * angle).cos();
        let around = DVec2::from_angle(2.0 * angle) * reach_m;
        CENTRE + DVec3::new(around.x, winding_m * (3.0 * angle).sin(), around.y)
    };
    shapes::sheet(along, around, |u, v| {
        let (u, v) = (u.fract(), v.fract());
        let middle = line(u);
        let ahead = (line(u + 1e-5) - line(u - 1e-5)).normalize();
        let side = ahead.cross((middle - CENTRE).normalize()).normalize();
        let (sine, cosine) = (std::f64::consts::TAU * v).sin_cos();
        let normal = side.cross(ahead) * cosine + side * sine;
        (middle + tube_m * normal, normal)
    })
}
