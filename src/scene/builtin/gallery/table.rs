//! The table in the sun and what stands on it: wine glass, tumbler, ring, mirror.

use glam::DVec3;

use super::{glassware, patterns, room};
use crate::optics::LinearSrgb;
use crate::scene::builtin::cut_glass::CutGlass;
use crate::scene::builtin::reference::cylinder;
use crate::scene::builtin::{parts, shapes};
use crate::scene::{Material, Scene, Volume};

/// Height of the table top [m].
const TOP_M: f64 = 0.75;
/// Bounds of the table top [m].
const X: [f64; 2] = [-1.2, 1.2];
const Z: [f64; 2] = [-0.4, 0.8];
/// Thickness of the table top [m].
const THICK_M: f64 = 0.06;

/// Positions of the objects on it [m].
pub const WINE_GLASS: DVec3 = DVec3::new(0.4, TOP_M, 0.42);
pub const TUMBLER: DVec3 = DVec3::new(0.74, TOP_M, 0.08);
pub const RING: DVec3 = DVec3::new(-0.3, TOP_M + 0.001, 0.52);
pub const MIRROR: DVec3 = DVec3::new(-0.45, TOP_M + 0.19, -0.24);

pub fn add(scene: &mut Scene) {
    add_table(scene);
    add_wine_glass(scene);
    let tumbler = shapes::moved(TUMBLER_CUT.mesh(), TUMBLER);
    parts::add(scene, "tumbler", tumbler, parts::dielectric("lead glass", 1.56));
    let gold = Material {
        name: "gold".into(),
        base_colour: LinearSrgb::new(1.0, 0.82, 0.5),
        ..parts::mirror()
    };
    parts::add(scene, "ring", cylinder(RING, 0.16, 0.06), gold);
    add_mirror(scene);
}

fn add_table(scene: &mut Scene) {
    let walnut = patterns::add(scene, "walnut", 1.1, |place| {
        patterns::wood(
            place,
            6,
            [DVec3::new(42.0, 28.0, 21.0), DVec3::new(106.0, 74.0, 52.0)],
        )
    });
    let top = room::in_metres(shapes::floor(X, Z, TOP_M));
    parts::add_with(scene, "table top", top, walnut);
    let (x, z) = (0.5 * (X[0] + X[1]), 0.5 * (Z[0] + Z[1]));
    let (half_x, half_z) = (DVec3::X * (0.5 * (X[1] - X[0])), DVec3::Z * (0.5 * (Z[1] - Z[0])));
    let half_y = DVec3::Y * (0.5 * THICK_M);
    let middle = DVec3::new(x, TOP_M - 0.5 * THICK_M, z);
    let edges = [
        ("front", half_z, half_x, half_y),
        ("back", -half_z, -half_x, half_y),
        ("right", half_x, -half_z, half_y),
        ("left", -half_x, half_z, half_y),
        ("underside", -half_y, half_x, half_z),
    ];
    room::add_faces(scene, ("table", walnut), middle, &edges);
    let inset = DVec3::new(0.09, 0.0, 0.09);
    let leg = DVec3::new(0.07, 0.0, 0.07);
    for (index, (x, z)) in [(X[0], Z[0]), (X[1], Z[0]), (X[0], Z[1]), (X[1], Z[1])]
        .into_iter()
        .enumerate()
    {
        let corner = DVec3::new(x, 0.0, z);
        let inwards = (middle.with_y(0.0) - corner).signum() * DVec3::new(1.0, 0.0, 1.0);
        let foot = corner + inwards * inset;
        let legs = shapes::cuboid(foot - 0.5 * leg, foot + 0.5 * leg + DVec3::Y * (TOP_M - THICK_M));
        parts::add(
            scene,
            &format!("table leg {}", index + 1),
            legs,
            parts::matte("dark walnut", LinearSrgb::new(0.13, 0.066, 0.036)),
        );
    }
}

fn add_wine_glass(scene: &mut Scene) {
    let outline = glassware::turned(&[&glassware::WINE_GLASS_M], [96, 14]);
    parts::add(
        scene,
        "wine glass",
        shapes::moved(outline, WINE_GLASS),
        parts::dielectric("glass", 1.52),
    );
    let wine = Material {
        volume: Some(Volume {
            attenuation_distance_m: 0.05,
            attenuation_colour: LinearSrgb::new(0.85, 0.16, 0.12),
        }),
        ..parts::dielectric("wine", 1.345)
    };
    let body = glassware::turned(&glassware::WINE_M, [96, 14]);
    parts::add(scene, "wine", shapes::moved(body, WINE_GLASS), wine);
}

/// 12 cm high, with three rows of nine facets.
const TUMBLER_CUT: CutGlass = CutGlass {
    corners: 9,
    rings_m: &[[0.042, 0.0], [0.049, 0.034], [0.049, 0.076], [0.052, 0.118]],
    inside_m: 0.0465,
    depth_m: 0.1,
    squareness: 5.0,
};

/// Upright, oriented so that the overview camera sees the ring in it.
fn add_mirror(scene: &mut Scene) {
    let (turn, up) = (DVec3::new(0.965, 0.0, -0.264).normalize(), DVec3::Y);
    let (right, up, normal) = (turn * 0.22, up * 0.18, turn.cross(up));
    parts::add(
        scene,
        "standing mirror",
        shapes::rectangle(MIRROR, right, up),
        parts::mirror(),
    );
    let board = shapes::rectangle(MIRROR - normal * 0.006, right * 1.06, up * 1.07);
    parts::add(
        scene,
        "mirror board",
        board,
        parts::matte("board", LinearSrgb::new(0.07, 0.045, 0.03)),
    );
}
