//! `cargo bench --bench deposit`: CPU time per triangle of the deposit with exact area coverage, by the triangles' area.
#![allow(clippy::print_stdout)]

use std::sync::Arc;
use std::time::Instant;

use cpu_time::ProcessTime;
use glam::DVec2;
use nephroid::illumination::{Chart, Receiver, UvSet};
use nephroid::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use nephroid::light_pass::wavefront::coverage::{FluxTriangle, deposit_triangles};

const SIDE: usize = 256;
const TRIANGLES: usize = 200_000;
const RUNS: usize = 5;

/// A pseudo-random number in [0, 1) for an index.
fn hash(index: usize) -> f64 {
    let mut x = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// Triangles of one area [texel²] and many shapes, in an order that moves across the map row by row.
fn triangles(area: f64, grey: bool) -> Vec<FluxTriangle> {
    let across = (TRIANGLES as f64).sqrt() as usize;
    (0..TRIANGLES)
        .map(|index| {
            let random = |k| hash(20 * index + k);
            let place = DVec2::new(
                (index % across) as f64 + random(0),
                (index / across) as f64 + random(1),
            );
            let centre = place * (SIDE as f64 / across as f64);
            let turn = DVec2::from_angle(std::f64::consts::TAU * random(2));
            // Base and height of one to three times each other.
            let base = (2.0 * area * 3f64.powf(2.0 * random(3) - 1.0)).sqrt();
            let top = DVec2::new(base * random(4), 2.0 * area / base);
            let corners = [DVec2::ZERO, DVec2::new(base, 0.0), top]
                .map(|corner| centre + turn.rotate(corner - 0.5 * top));
            let flux = [5, 6, 7].map(|k| (1e12 * random(if grey { 5 } else { k })) as i64);
            FluxTriangle {
                corners,
                flux,
                island: 0,
            }
        })
        .collect()
}

fn chart() -> Chart {
    let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from);
    Chart {
        receiver: Receiver::front(0),
        uv_set: UvSet::Generated,
        corner_uvs: vec![[a, b, c], [a, c, d]],
        width: SIDE,
        height: SIDE,
        texel_areas_m2: vec![1.0],
        layout: None,
        beyond: Vec::new(),
        joints: Vec::new(),
    }
}

/// Medians over the runs of CPU and wall time per triangle [ns].
fn measure(triangles: &[FluxTriangle], map: &mut ReceiverMap) -> [f64; 2] {
    let mut times: [Vec<f64>; 2] = Default::default();
    for _ in 0..RUNS {
        let (cpu, wall) = (ProcessTime::now(), Instant::now());
        deposit_triangles(triangles, map);
        let per_triangle = 1e9 / triangles.len() as f64;
        times[0].push(cpu.elapsed().as_secs_f64() * per_triangle);
        times[1].push(wall.elapsed().as_secs_f64() * per_triangle);
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[RUNS / 2]
    })
}

fn main() {
    let mut maps = ReceiverMaps::new(1);
    maps.touch(Receiver::front(0), &|_| Some(Arc::new(chart())));
    let map = maps.get_mut(Receiver::front(0)).expect("a map");
    println!("texels colour  threads  CPU ns  wall ns");
    for grey in [true, false] {
        for area in [0.3, 2.0, 10.0, 50.0] {
            let triangles = triangles(area, grey);
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let [cpu, wall] = pool.expect("threads").install(|| measure(&triangles, map));
                let colour = if grey { "grey" } else { "rgb" };
                println!("{area:6} {colour:>6} {threads:8} {cpu:7.1} {wall:8.1}");
            }
        }
    }
}
