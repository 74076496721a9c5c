//! Flux-carrying triangles on a map, against clipping texel by texel.

use nephroid::illumination::accumulator::{FluxAccumulator, FluxCount};
use nephroid::illumination::{Chart, Receiver};
use nephroid::light_pass::coverage::{CoverageReport, FluxTriangle, deposit_triangles};
use nephroid::light_pass::receiver_maps::ReceiverMaps;

use crate::bake::tiles;
use support::prelude::*;
use support::scenes::chart_of;

/// Counts of a triangle in most tests: enough for the counts to be as good as real numbers.
const FLUX: i64 = 1_000_000_000_000;

fn triangle(corners: [[f64; 2]; 3], flux: FluxCount) -> FluxTriangle {
    FluxTriangle {
        corners: corners.map(DVec2::from),
        flux,
        island: 0,
    }
}

fn grey(corners: [[f64; 2]; 3]) -> FluxTriangle {
    triangle(corners, [FLUX; 3])
}

/// A square of the map: u from `left` to `right`, v from 0 to 1.
fn strip(left: f64, right: f64) -> [[DVec2; 3]; 2] {
    let [a, b, c, d] = [[left, 0.0], [right, 0.0], [right, 1.0], [left, 1.0]].map(DVec2::from);
    [[a, b, c], [a, c, d]]
}

/// A chart of two triangles that fills its map.
pub(super) fn full_chart(size: (usize, usize)) -> Chart {
    chart_of(strip(0.0, 1.0).to_vec(), size, vec![1.0])
}

/// A chart of two islands: the left and the right third of the map.
fn gappy_chart((width, height): (usize, usize)) -> Chart {
    let is_covered = |texel: usize| {
        let column = (texel % width) as f64;
        3.0 * column < width as f64 || 3.0 * (column + 1.0) > 2.0 * width as f64
    };
    let texels = 0..width * height;
    Chart {
        corner_uvs: [strip(0.0, 1.0 / 3.0), strip(2.0 / 3.0, 1.0)].concat(),
        texel_areas_m2: texels
            .map(|texel| f64::from(u8::from(is_covered(texel))))
            .collect(),
        ..full_chart((width, height))
    }
}

/// Deposits triangles in calls of `per_call`. What the report says must be so, to the last count; no texel gets less than
/// nothing.
pub(super) fn deposit_on(
    chart: &Chart,
    triangles: &[FluxTriangle],
    per_call: usize,
) -> (FluxAccumulator, CoverageReport) {
    let mut maps = ReceiverMaps::new(1);
    maps.touch(Receiver::front(0), &|_| Some(Arc::new(chart.clone())));
    let map = maps.get_mut(Receiver::front(0)).expect("a map");
    let mut report = CoverageReport::default();
    for part in triangles.chunks(per_call) {
        report.merge(&deposit_triangles(part, map));
    }
    let flux = map.flux().into_owned();
    assert_eq!(sum(flux.texels().iter().copied()), report.deposited, "deposited");
    let CoverageReport {
        deposited,
        outside,
        non_finite,
    } = &report;
    let all: [i128; 3] =
        std::array::from_fn(|channel| deposited[channel] + outside[channel] + non_finite[channel]);
    assert_eq!(
        sum(triangles.iter().map(|triangle| triangle.flux)),
        all,
        "{report:?}"
    );
    assert!(outside.iter().all(|&count| count >= 0), "{report:?}");
    assert!(flux.texels().iter().flatten().all(|&count| count >= 0));
    (flux, report)
}

fn deposit(size: (usize, usize), triangles: &[FluxTriangle]) -> (FluxAccumulator, CoverageReport) {
    deposit_on(&full_chart(size), triangles, triangles.len())
}

pub(super) fn sum(counts: impl Iterator<Item = FluxCount>) -> [i128; 3] {
    counts.fold([0; 3], |sum, count| {
        std::array::from_fn(|channel| sum[channel] + i128::from(count[channel]))
    })
}

/// Sutherland and Hodgman: the part of a polygon where `distance` is not negative.
fn clip(polygon: &[DVec2], distance: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::new();
    for (index, &here) in polygon.iter().enumerate() {
        let next = polygon[(index + 1) % polygon.len()];
        let (d, e) = (distance(here), distance(next));
        if d >= 0.0 {
            kept.push(here);
        }
        if d * e < 0.0 {
            kept.push(here + (next - here) * (d / (d - e)));
        }
    }
    kept
}

fn area(polygon: &[DVec2]) -> f64 {
    let Some(&first) = polygon.first() else { return 0.0 };
    let twice: f64 = polygon
        .windows(2)
        .map(|pair| (pair[0] - first).perp_dot(pair[1] - first))
        .sum();
    0.5 * twice.abs()
}

/// The part of a triangle in a texel, of its whole area.
fn share(corners: [DVec2; 3], column: usize, row: usize) -> f64 {
    // Relative to the texel, so that the cuts are as exact as can be.
    let corner = dvec2(column as f64, row as f64);
    let mut part: Vec<DVec2> = corners.iter().map(|point| point - corner).collect();
    part = clip(&part, |point| point.x);
    part = clip(&part, |point| 1.0 - point.x);
    part = clip(&part, |point| point.y);
    part = clip(&part, |point| 1.0 - point.y);
    area(&part) / area(&corners)
}

/// Fails unless a map is that of one triangle.
#[track_caller]
fn check_against_reference(size: (usize, usize), triangle: FluxTriangle, tolerance: f64) {
    let (flux, _) = deposit(size, &[triangle]);
    for (texel, got) in flux.texels().iter().enumerate() {
        let share = share(triangle.corners, texel % size.0, texel / size.0);
        for (flux, &got) in triangle.flux.iter().zip(got) {
            let expected = *flux as f64 * share;
            let error = (got as f64 - expected).abs();
            assert!(
                error <= tolerance * *flux as f64 + 1.0,
                "texel {texel} of {size:?}: {got} instead of {expected} in {triangle:?}"
            );
        }
    }
}

fn point(low: f64, high: f64) -> impl Strategy<Value = [f64; 2]> {
    [low..high, low..high]
}

/// Triangles of every kind on a map of 17×15, and the tolerance of their shares.
fn any_triangle() -> impl Strategy<Value = ([[f64; 2]; 3], f64)> {
    let corners = || prop::array::uniform3(point(-1.0, 1.0));
    let scaled = |corners: [[f64; 2]; 3], at: [f64; 2], size: f64| {
        corners.map(|[x, y]| [at[0] + 10f64.powf(size) * x, at[1] + 10f64.powf(size) * y])
    };
    let small = (point(-1.0, 18.0), corners(), -4.0..1.0);
    let large = (corners(), 2.0..6.0);
    // Upright and level sides, their corner on a texel's or hardly beside.
    let right = (
        [0..17i32, 0..15i32],
        point(-1.0, 1.0),
        point(-1.0, 1.0),
        -3.0..0.5,
        -14.0..0.0,
    );
    let right = right.prop_map(|(at, off, far, size, beside)| {
        let (size, beside) = (10f64.powf(size), 10f64.powf(beside));
        let corner = [0, 1].map(|axis| f64::from(at[axis]) + size * beside * off[axis]);
        let far = far.map(|way: f64| way + 0.05 * way.signum());
        let [x, y] = [0, 1].map(|axis| corner[axis] + size * far[axis]);
        let third = if off[0] > 0.0 { [x, corner[1]] } else { [x, y] };
        ([corner, third, [corner[0], y]], 1e-9)
    });
    let on_borders = prop::array::uniform3([-2..18i32, -2..16i32])
        .prop_map(|corners| corners.map(|corner| corner.map(f64::from)));
    let sliver = (point(-2.0, 10.0), point(11.0, 19.0), 0.0..1.0, -7.0..-1.0_f64);
    prop_oneof![
        prop::array::uniform3(point(-4.0, 20.0)).prop_map(|corners| (corners, 1e-9)),
        small.prop_map(move |(at, corners, size)| (scaled(corners, at, size), 1e-9)),
        large.prop_map(move |(corners, size)| (scaled(corners, [4.0; 2], size), 1e-9)),
        right,
        on_borders.prop_filter_map("a triangle without area", |corners| {
            let [a, b, c] = corners.map(DVec2::from);
            ((b - a).perp_dot(c - a) != 0.0).then_some((corners, 1e-9))
        }),
        sliver.prop_map(|(a, b, along, height)| {
            let (from, to, height) = (DVec2::from(a), DVec2::from(b), 10f64.powf(height));
            let c = from.lerp(to, along) + (to - from).perp().normalize() * height;
            // Below a height of 1e-6 they are lines: off by as much where they lie along a border.
            ([a, b, c.into()], if height < 2e-6 { 1e-4 } else { 1e-9 })
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::with_cases(2400) })]

    #[test]
    fn triangles_cover_what_is_clipped((corners, tolerance) in any_triangle()) {
        check_against_reference((17, 15), grey(corners), tolerance);
    }

    #[test]
    fn every_count_is_kept(
        corners in prop::array::uniform3(point(-2.0, 12.0)),
        flux in prop::array::uniform3(prop_oneof![0..40i64, 0..(1i64 << 40), 0..(1i64 << 62)]),
    ) {
        // The sums are checked with every deposit; the counts here are coarse, or more than a double resolves.
        check_against_reference((10, 10), triangle(corners, flux), 1e-9);
    }

    #[test]
    fn any_numbers_are_survived(
        corners in prop::array::uniform3([any::<f64>(), any::<f64>()]),
        inside in point(0.0, 8.0),
    ) {
        let [a, b, _] = corners;
        let across = grey([[0.0, b[0]], [a[1], 8.0], inside]);
        deposit((8, 8), &[grey(corners), grey([a, b, inside]), across, grey([a, inside, inside])]);
    }
}

#[test]
fn a_point_is_in_its_texel() {
    for (at, texel) in [
        ([3.5, 2.25], Some((3, 2))),
        ([3.0, 2.0], Some((3, 2))),
        ([8.0, 6.0], Some((7, 5))),
        ([8.1, 3.0], None),
    ] {
        let (flux, report) = deposit((8, 6), &[grey([at; 3])]);
        match texel {
            Some((column, row)) => assert_eq!(flux.texels()[row * 8 + column], [FLUX; 3], "{at:?}"),
            None => assert_eq!(report.outside, [i128::from(FLUX); 3]),
        }
    }
}

#[test]
fn a_line_carries_a_tent() {
    // Its middle corner projects onto x = 3, y = 1.5: half the flux lies before it.
    let level = [[1.0, 1.5], [5.0, 1.5], [3.0, 1.5]];
    let upright = level.map(|[x, y]| [y, x]);
    for corners in [level, upright] {
        let (flux, _) = deposit((8, 8), &[grey(corners)]);
        for (place, expected) in [0.0, 0.125, 0.375, 0.375, 0.125, 0.0].into_iter().enumerate() {
            let texel = if corners == level {
                8 + place
            } else {
                8 * place + 1
            };
            assert_eq!(flux.texels()[texel][1], (expected * FLUX as f64) as i64);
        }
    }
}

#[test]
fn beside_the_map_and_nowhere_is_booked() {
    let all = [i128::from(FLUX); 3];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (_, report) = deposit((4, 4), &[grey([[1.0, 1.0], [2.0, bad], [2.0, 3.0]])]);
        assert_eq!(report.non_finite, all);
    }
    for (dx, dy) in [(-20.0, 0.0), (20.0, 0.0), (0.0, -20.0), (0.0, 20.0), (6.0, 6.0)] {
        let corners = [[1.0 + dx, 1.0 + dy], [4.0 + dx, 1.5 + dy], [2.0 + dx, 4.0 + dy]];
        let (_, report) = deposit((6, 6), &[grey(corners)]);
        assert_eq!(report.outside, all);
        let in_tiles = tiles::chart(Some(tiles::mixed()));
        let flux = [FLUX, FLUX / 3, 7];
        let far = triangle(corners.map(|[x, y]| [x + 1e4 * dx, y + 1e4 * dy]), flux);
        let mut nowhere = far;
        nowhere.corners[1].x = f64::NAN;
        let (_, report) = deposit_on(&in_tiles, &[far, nowhere, far], 3);
        let once = flux.map(i128::from);
        let twice = once.map(|count| 2 * count);
        assert_eq!((report.outside, report.non_finite), (twice, once), "in tiles");
    }
}

/// Flux of each column of a map.
fn columns(flux: &FluxAccumulator) -> Vec<i64> {
    let mut sums = vec![0; flux.width()];
    for row in flux.texels().chunks(flux.width()) {
        for (sum, texel) in sums.iter_mut().zip(row) {
            *sum += texel[0];
        }
    }
    sums
}

fn on_gaps(triangle: FluxTriangle) -> (FluxAccumulator, CoverageReport) {
    deposit_on(&gappy_chart((12, 12)), &[triangle], 1)
}

#[test]
fn an_island_takes_what_falls_on_it() {
    // Columns 0..4 and 8..12 are covered, by islands 0 and 1.
    let (flux, report) = on_gaps(grey([[2.0, 3.0], [6.0, 3.0], [4.0, 9.0]]));
    let sums = columns(&flux);
    assert!(sums[4..].iter().all(|&sum| sum == 0), "{sums:?}");
    assert!(
        (report.deposited[0] - report.outside[0]).abs() <= 20,
        "{report:?}"
    );

    let mut on_other = grey([[1.0, 1.0], [11.0, 1.0], [10.0, 9.0]]);
    on_other.island = 1;
    let (flux, report) = on_gaps(on_other);
    let sums = columns(&flux);
    assert!(sums[..8].iter().all(|&sum| sum == 0), "{sums:?}");
    assert!(report.deposited[0] > 0 && report.outside[0] > 0, "{report:?}");
}
