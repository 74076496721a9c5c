//! Deposits on maps in tiles, against the same map row by row.

use std::sync::Arc;

use glam::DVec2;
use nephroid::illumination::Chart;
use nephroid::illumination::accumulator::FluxCount;
use nephroid::illumination::lookup::{bilinear, in_chart};
use nephroid::illumination::tiles::{self, SIDE, TileLayout};
use nephroid::light_pass::wavefront::coverage::{CoverageReport, FluxTriangle};

use crate::bake::coverage::{deposit_on, full_chart, sum};

/// Tiles of which none is square but the first.
pub(super) const SIZE: (usize, usize) = (5 * SIDE + 32, 3 * SIDE + 48);

pub(super) fn chart(layout: Option<TileLayout>) -> Chart {
    let areas = |layout: &TileLayout| {
        let tiles = layout.tiles();
        tiles
            .flat_map(|tile| vec![f64::from(1_u32 << (2 * tile.level)); tile.texels.len()])
            .collect()
    };
    Chart {
        texel_areas_m2: layout.as_ref().map_or(vec![1.0], areas),
        layout: layout.map(Arc::new),
        ..full_chart(SIZE)
    }
}

fn layout_of(level: impl Fn(usize) -> u8) -> TileLayout {
    let (columns, rows) = tiles::tile_counts(SIZE.0, SIZE.1);
    let levels: Vec<u8> = (0..columns * rows).map(level).collect();
    TileLayout::new(SIZE, &levels, &levels)
}

pub(super) fn mixed() -> TileLayout {
    layout_of(|tile| (tile * 9 % 7) as u8)
}

/// Numbers from 0 to 1, always the same.
fn numbers() -> impl Iterator<Item = f64> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    std::iter::from_fn(move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        Some((state >> 11) as f64 / (1_u64 << 53) as f64)
    })
}

/// Small and large ones, slivers, some past the borders, some with a corner on the border of a tile.
fn triangles(count: usize) -> Vec<FluxTriangle> {
    let mut numbers = numbers();
    let mut next = || numbers.next().expect("no end");
    let size = DVec2::new(SIZE.0 as f64, SIZE.1 as f64);
    (0..count)
        .map(|index| {
            let middle = DVec2::new(next(), next()) * (size + 40.0) - 20.0;
            let extent = [0.3, 3.0, 30.0, 150.0][index % 4];
            let mut corner = || middle + (DVec2::new(next(), next()) - 0.5) * extent;
            let mut corners = [corner(), corner(), corner()];
            match index % 7 {
                0 => corners[1] = corners[0] + (corners[2] - corners[0]) * 0.4,
                1 => corners[2] = (corners[2] / SIDE as f64).round() * SIDE as f64,
                _ => {}
            }
            let flux = (next() * 1e12) as i64;
            FluxTriangle {
                corners,
                flux: [flux, flux / 3, if index % 2 == 0 { flux } else { 7 }],
                island: 0,
            }
        })
        .collect()
}

fn deposited(layout: Option<TileLayout>, triangles: &[FluxTriangle]) -> (Vec<FluxCount>, CoverageReport) {
    let (flux, report) = deposit_on(&chart(layout), triangles, triangles.len());
    (flux.texels().to_vec(), report)
}

#[test]
fn places_of_texels_agree() {
    let layout = mixed();
    let mut seen = vec![0; layout.texel_count()];
    for row in 0..SIZE.1 {
        let texels: Vec<usize> = layout.row_texels(row).collect();
        assert_eq!(texels.len(), SIZE.0);
        for (column, texel) in texels.into_iter().enumerate() {
            assert_eq!(texel, layout.texel(column, row));
            seen[texel] += 1;
        }
    }
    for tile in layout.tiles() {
        let texels = 1 << (2 * tile.level);
        assert!(seen[tile.texels].iter().all(|&count| count == texels));
    }
    let levels: Vec<u8> = layout.tiles().map(|tile| tile.level).collect();
    assert!((0..=4).all(|level| levels.contains(&level)), "{levels:?}");
}

#[test]
fn the_finest_tiles_hold_what_a_map_holds() {
    let triangles = triangles(4_000);
    let layout = layout_of(|_| 0);
    let (dense, dense_report) = deposited(None, &triangles);
    let (tiled, report) = deposited(Some(layout.clone()), &triangles);
    let tiled = layout.dense(&tiled);
    // Each triangle is rounded in other places; its largest share takes at most a count for each of its texels.
    let pairs = dense.as_flattened().iter().zip(tiled.as_flattened());
    let worst = pairs.map(|(a, b)| (a - b).abs()).max().expect("texels");
    assert!(worst > 0, "rounding is all the same: not in tiles?");
    assert!(worst < 20_000, "{worst} counts of {}", 1e12);
    // What rounding down leaves of triangles that cross the map's border counts as outside: 10⁻⁹ of them at most.
    let all = sum(triangles.iter().map(|triangle| triangle.flux))[0];
    let off = dense_report.deposited[0] - report.deposited[0];
    assert!(off.abs() < all / 1_000_000_000, "{off} of {all}");
}

#[test]
fn mixed_tiles_hold_sums_of_finer_texels() {
    let triangles = triangles(4_000);
    let layout = mixed();
    let (dense, _) = deposited(None, &triangles);
    let (tiled, _) = deposited(Some(layout.clone()), &triangles);
    let mut sums = vec![[0_i64; 3]; layout.texel_count()];
    for row in 0..SIZE.1 {
        for (column, texel) in layout.row_texels(row).enumerate() {
            for (sum, count) in sums[texel].iter_mut().zip(dense[row * SIZE.0 + column]) {
                *sum += count;
            }
        }
    }
    let mut pairs = tiled.as_flattened().iter().zip(sums.as_flattened());
    assert!(pairs.all(|(own, sum)| (own - sum).abs() < 100_000));
}

#[test]
fn triangles_within_leave_nothing_outside() {
    let size = DVec2::new(SIZE.0 as f64, SIZE.1 as f64);
    let inside = |triangle: &FluxTriangle| {
        let is_on = |corner: &DVec2| corner.cmpge(DVec2::ZERO).all() && corner.cmple(size).all();
        triangle.corners.iter().all(is_on)
    };
    let triangles: Vec<FluxTriangle> = triangles(4_000).into_iter().filter(inside).collect();
    assert!(triangles.len() > 2_000);
    let (_, report) = deposited(Some(mixed()), &triangles);
    assert_eq!(report.outside, [0; 3]);
}

#[test]
fn balanced_tiles_differ_by_one_level() {
    let columns = 9;
    let mut levels = vec![tiles::COARSEST; columns * 9];
    levels[4 * columns + 4] = 0;
    tiles::balance(&mut levels, columns);
    for (tile, level) in levels.iter().enumerate() {
        let distance = (tile % columns).abs_diff(4).max((tile / columns).abs_diff(4));
        assert_eq!(usize::from(*level), distance.min(4));
    }
}

/// A slope is the same slope in tiles of any level, a map of one value one value.
#[test]
fn look_ups_run_on_across_tiles() {
    let layout = layout_of(|tile| if tile % 6 < 4 { 2 } else { (tile * 9 % 7) as u8 });
    let place = |column: f64, row: f64| (2.0 * column + 3.0 * row) as f32;
    let mut slope = vec![[0.0; 3]; layout.texel_count()];
    for tile in layout.tiles() {
        let side = f64::from(1_u32 << tile.level);
        for (index, texel) in tile.texels.enumerate() {
            let (column, row) = (index % tile.size.0, index / tile.size.0);
            let column = tile.origin.0 as f64 + (column as f64 + 0.5) * side;
            let row = tile.origin.1 as f64 + (row as f64 + 0.5) * side;
            slope[texel] = [place(column, row), 5.0, 0.0];
        }
    }
    let tiled = chart(Some(layout.clone()));
    let size = DVec2::new(SIZE.0 as f64, SIZE.1 as f64);
    let mut numbers = numbers();
    let mut alike = 0;
    for _ in 0..2_000 {
        let uv = DVec2::new(numbers.next().expect("no end"), numbers.next().expect("no end"));
        let found = in_chart(&tiled, &slope, uv);
        let at = uv * size;
        // A neighbour that is coarser has one value for all of its texel, and beyond the map the border goes on.
        let levels = [-64.0, 0.0, 64.0].map(|y| {
            [-64.0, 0.0, 64.0].map(|x| {
                let place = (at + DVec2::new(x, y)).clamp(DVec2::ZERO, size - 1.0);
                layout.level_at(place.x as usize, place.y as usize)
            })
        });
        let levels = levels.as_flattened();
        let coarsest = levels.iter().copied().max().expect("nine");
        let off = (found.r - f64::from(place(at.x, at.y))).abs();
        assert!(off <= 5.0 * f64::from(1_u32 << coarsest), "{uv}: off by {off}");
        assert!((found.g - 5.0).abs() < 1e-9);
        let is_within = at.cmpge(DVec2::splat(65.0)).all() && at.cmplt(size - 65.0).all();
        if is_within && levels.iter().all(|&level| level == coarsest) {
            alike += 1;
            assert!(off < 1e-3, "{uv}: off by {off} within tiles of one level");
        }
    }
    assert!(alike > 0, "no place has tiles of one level around it");
    // Without tiles it is the plain look-up.
    let values = layout.dense(&slope);
    let uv = DVec2::new(0.31, 0.77);
    let plain = bilinear(&values, SIZE.0, SIZE.1, uv);
    assert_eq!(in_chart(&chart(None), &values, uv).to_array(), plain.to_array());
}
