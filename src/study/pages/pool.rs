//! Plates 7 and 8: a pool, its waves as a mesh and as bumps of a single polygon.

use std::sync::Arc;

use glam::DVec3;

use super::{Bench, percent, pictures, scene_and_truth, verdict, wavefront};
use crate::error::Result;
use crate::scene::builtin::{parts, pool};
use crate::scene::{Camera, Scene};
use crate::study::page::{Cell, Page, Table};

/// [1/sr].
const DENSITY_PER_SR: f64 = 4e4;

/// Meshes of water: quads across and down; the built-in one has 512.
const QUADS: [u32; 4] = [16, 32, 64, 128];

/// Maps of the mesh and of the bumps differ by less than this: the waves' height moves light that their slope bends.
const ALIKE: f64 = 0.5;

/// Errors of water with fewer quads are so many times as large at least.
const AMPLIFIED: f64 = 2.0;

/// Index of water.
const WATER: f64 = 1.333;

const COLUMNS: [(&str, &str); 6] = [
    ("water", "water"),
    ("triangles", "triangles"),
    ("rays", "rays"),
    ("cpu_s", "CPU s"),
    ("relative_rmse", "error"),
    ("ard", "ARD"),
];

pub(super) fn page(bench: &Bench) -> Result<Page> {
    let (scene, truth) = scene_and_truth("pool")?;
    let settings = bench.at(wavefront(DENSITY_PER_SR), bench.side());
    let mut waters: Vec<(String, Arc<Scene>)> = vec![
        ("mesh of 512 × 512 quads".into(), Arc::clone(&scene)),
        ("one polygon with bumps".into(), super::scene("pool-bump")?),
    ];
    for &quads in bench.some(&QUADS, 1) {
        waters.push((
            format!("mesh of {quads} × {quads} quads"),
            Arc::new(with_quads(&scene, quads)),
        ));
    }
    let mut table = Table::new(&COLUMNS);
    let (mut errors, mut plates) = (Vec::new(), Vec::new());
    for (name, scene) in &waters {
        let measured = bench.measure(scene, &settings, &truth)?;
        errors.push(measured.agreement.relative_rmse);
        table.rows.push(vec![
            name.clone().into(),
            Cell::Count(scene.triangle_count() as u64),
            measured.rays(),
            measured.cpu_s().into(),
            measured.rmse(),
            measured.ard(),
        ]);
        if plates.is_empty() {
            for (file, caption, position) in [
                ("plate7-above", "from above", DVec3::new(1.6, 2.6, 2.4)),
                (
                    "plate8-below",
                    "from below the surface",
                    DVec3::new(0.9, 0.7, 0.9),
                ),
            ] {
                let target = DVec3::new(0.0, 0.1, 0.0);
                let camera = Camera::look_at(caption, position, target, 55_f64.to_radians());
                let request = (file, format!("The pool {caption}."));
                plates.push(pictures::view(bench, request, scene, &measured.result.maps, camera)?.0);
            }
        }
    }
    Ok(Page {
        title: "Plates 7 and 8: the pool".into(),
        settings: format!(
            "`builtin:pool`, {DENSITY_PER_SR} rays/sr (the sun's by its reach), maps of {0} × {0} texels, wavefront, all against {1}, \
             which is of smooth displaced water.",
            bench.side(),
            truth.kind
        ),
        table,
        plots: Vec::new(),
        pictures: plates,
        findings: findings(&errors),
    })
}

/// The pool with a coarser mesh of the same waves.
fn with_quads(scene: &Scene, quads: u32) -> Scene {
    let mut coarse = scene.clone();
    coarse
        .objects
        .retain(|object| scene.materials[object.material].surface.is_receiver());
    let mesh = pool::water(DVec3::Y, [1.5; 2], [quads; 2], &pool::waves(pool::AMPLITUDE_M));
    parts::add(&mut coarse, "water", mesh, parts::dielectric("water", WATER));
    coarse
}

fn findings(errors: &[f64]) -> Vec<String> {
    let (mesh, bumps) = (errors[0], errors[1]);
    let mut findings = vec![format!(
        "The paper takes one polygon with bumps for the water. That differs from displaced water by {} here, of which {} is left with \
         the finest mesh: bumps bend the light where the flat surface is, not where the wave is. That bumps stand for waves {}.",
        percent(bumps),
        percent(mesh),
        verdict(bumps < ALIKE)
    )];
    if let Some(&coarse) = errors.get(2) {
        findings.push(format!(
            "Watt's remark, as the paper has it, that the caustic amplifies the patches of the surface {}: the coarsest mesh leaves {}, \
             {:.1} times the finest's.",
            verdict(coarse > AMPLIFIED * mesh),
            percent(coarse),
            coarse / mesh
        ));
    }
    findings
}
