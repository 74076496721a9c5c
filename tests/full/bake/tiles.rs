//! Flux on maps in tiles, against the same map row by row: deposits and smoothing.

use nephroid::illumination::accumulator::{FluxAccumulator, FluxCount};
use nephroid::illumination::lookup::{bilinear, in_chart};
use nephroid::illumination::smoothing::smooth;
use nephroid::illumination::tiles::{SIDE, TileLayout};
use nephroid::illumination::{Chart, tiles};
use nephroid::light_pass::coverage::{CoverageReport, FluxTriangle};

use crate::bake::coverage::{deposit_on, full_chart, sum};
use support::laws::scenes::random;
use support::prelude::*;

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

/// Small and large ones, slivers, some past the borders, some with a corner on the border of a tile.
fn triangles(count: usize) -> Vec<FluxTriangle> {
    let mut next = random(1);
    let size = dvec2(SIZE.0 as f64, SIZE.1 as f64);
    (0..count)
        .map(|index| {
            let middle = dvec2(next(), next()) * (size + 40.0) - 20.0;
            let extent = [0.3, 3.0, 30.0, 150.0][index % 4];
            let mut corner = || middle + (dvec2(next(), next()) - 0.5) * extent;
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
    let size = dvec2(SIZE.0 as f64, SIZE.1 as f64);
    let mut next = random(1);
    let mut alike = 0;
    for _ in 0..2_000 {
        let uv = dvec2(next(), next());
        let found = in_chart(&tiled, &slope, uv);
        let at = uv * size;
        // A neighbour that is coarser has one value for all of its texel, and beyond the map the border goes on.
        let levels = [-64.0, 0.0, 64.0].map(|y| {
            [-64.0, 0.0, 64.0].map(|x| {
                let place = (at + dvec2(x, y)).clamp(DVec2::ZERO, size - 1.0);
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
    let uv = dvec2(0.31, 0.77);
    let plain = bilinear(&values, SIZE.0, SIZE.1, uv);
    assert_eq!(in_chart(&chart(None), &values, uv).to_array(), plain.to_array());
}

fn sums(flux: &FluxAccumulator) -> [i64; 3] {
    flux.texels().iter().fold([0; 3], |sum, texel| {
        std::array::from_fn(|channel| sum[channel] + texel[channel])
    })
}

fn speckled(width: usize, height: usize) -> FluxAccumulator {
    let mut flux = FluxAccumulator::new(width, height);
    for (index, texel) in flux.texels_mut().iter_mut().enumerate() {
        let speckle = (index as i64).wrapping_mul(0x9e37_79b9_7f4a_7c15_u64 as i64);
        *texel = [
            (speckle >> 20) & 0xff_ffff,
            speckle & 7,
            i64::from(index % 97 == 5) << 50,
        ];
    }
    flux
}

#[test]
fn no_count_is_lost() {
    for (width, height) in [(1, 1), (1, 9), (7, 1), (64, 48), (5, 200)] {
        for spread in [0.01, 0.3, 1.0, 2.5, 17.0, 400.0, 1e12, f64::INFINITY] {
            let mut flux = speckled(width, height);
            let before = sums(&flux);
            smooth(&mut flux, None, spread);
            assert_eq!(sums(&flux), before, "{width} × {height}, {spread}");
            assert!(flux.texels().iter().flatten().all(|&count| count >= 0));
        }
    }
}

/// Tiles of any level are smoothed as the map of one size that they stand for, texel by texel.
#[test]
fn tiles_are_smoothed_as_one_map() {
    let (width, height) = (256, 128);
    let levels = [0, 2, 6, 0, 3, 0, 1, 5];
    let layout = TileLayout::new((width, height), &levels, &levels);
    // Even within the coarsest tile, as tiles say that they are.
    let density = |column: usize, row: usize| 1_i64 << (20 + 4 * (layout.tile_at(column, row) % 3));
    let mut even = FluxAccumulator::new(width, height);
    let mut tiled = FluxAccumulator::new(layout.texel_count(), 1);
    for index in 0..width * height {
        let (column, row) = (index % width, index / width);
        let counts = [density(column, row); 3];
        even.texels_mut()[index] = counts;
        let sum = &mut tiled.texels_mut()[layout.texel(column, row)];
        *sum = std::array::from_fn(|channel| sum[channel] + counts[channel]);
    }
    let total = sums(&even);
    for spread in [0.4, 3.0, 5.0, 20.0] {
        let (mut even, mut tiled) = (even.clone(), tiled.clone());
        smooth(&mut even, None, spread);
        smooth(&mut tiled, Some(&layout), spread);
        assert_eq!(sums(&tiled), total);
        let mut under = FluxAccumulator::new(layout.texel_count(), 1);
        for (index, counts) in even.texels().iter().enumerate() {
            let sum = &mut under.texels_mut()[layout.texel(index % width, index / width)];
            *sum = std::array::from_fn(|channel| sum[channel] + counts[channel]);
        }
        for (a, b) in tiled.texels().iter().zip(under.texels()) {
            assert!(
                (a[0] - b[0]).abs() <= b[0] / 1000 + 1_000_000,
                "{a:?} {b:?} at {spread}"
            );
        }
    }
}

#[test]
fn points_spread_by_the_variance() {
    let (width, height) = (128, 112);
    // The last two go by way of a coarser map, in which places are rounded: the mean of points at all of them.
    for (spread, places) in [(0.2, 1), (0.5, 1), (1.0, 1), (3.0, 1), (4.5, 4), (9.0, 4)] {
        let [mut x, mut y, mut xx, mut yy, mut peak] = [0.0; 5];
        for place in 0..places {
            let (across, down) = (64 + place, 56 + place);
            let mut flux = FluxAccumulator::new(width, height);
            flux.texels_mut()[down * width + across] = [1 << 50; 3];
            smooth(&mut flux, None, spread);
            for (index, texel) in flux.texels().iter().enumerate() {
                let column = (index % width) as f64 - across as f64;
                let row = (index / width) as f64 - down as f64;
                let share = texel[1] as f64 / (1_i64 << 50) as f64 / places as f64;
                x += share * column;
                y += share * row;
                xx += share * column * column;
                yy += share * row * row;
                peak += if column == 0.0 && row == 0.0 { share } else { 0.0 };
            }
        }
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
        // Of a gaussian, 0.11 % of the variance lies beyond four spreads.
        for variance in [xx, yy] {
            assert!(
                (variance / (spread * spread) - 1.0).abs() < 2e-3,
                "{variance} at {spread}"
            );
        }
        let gaussian = 1.0 / (TAU * spread * spread);
        assert!(
            spread < 3.0 || (peak / gaussian - 1.0).abs() < if places == 1 { 0.04 } else { 0.06 },
            "{peak} {gaussian}"
        );
    }
}
