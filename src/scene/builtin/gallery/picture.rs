//! A block of clear plastic whose front is ground so that the light of a lamp behind it draws a butterfly.
//!
//! Light must be moved within the block's square so that its density becomes that of the picture: if light of x goes to
//! x + ∇φ, then det(1 + D²φ)·target(x + ∇φ) = 1, a Monge–Ampère equation. It is solved by a sequence of Poisson
//! equations (Benamou, Froese and Oberman, 2010), whose solutions are sums of cosines. The height of the glass is
//! proportional to φ.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::scene::Mesh;
use crate::scene::builtin::shapes;

/// Grid cells per side of the square.
const CELLS: usize = 64;
/// Number of iterations, each of which solves a Poisson equation.
const ROUNDS: usize = 60;
/// Quads per side of the front.
const QUADS: u32 = 96;
/// Density of light on a line relative to the background.
const CONTRAST: f64 = 14.0;
/// Half-width of a line, relative to the square's side.
const LINE: f64 = 0.011;

/// Values at cell centres, or coefficients of cosines, row by row.
type Grid = Vec<f64>;

/// Geometry of the block and its projection.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Centre of its flat back [m].
    pub centre: DVec3,
    /// Unit, direction of the light through it.
    pub forward: DVec3,
    /// Side and mean thickness [m].
    pub side_m: f64,
    pub thickness_m: f64,
    /// Distances from the light to the block and from the block to the picture [m].
    pub from_lamp_m: f64,
    pub to_picture_m: f64,
    pub ior: f64,
}

impl Block {
    /// Unit axes: to the right as seen from the light, and up.
    pub fn axes(&self) -> [DVec3; 2] {
        let right = self.forward.cross(DVec3::Y).normalize();
        [right, right.cross(self.forward)]
    }

    /// Closed mesh of the block.
    pub fn mesh(&self) -> Mesh {
        let magnified = (self.from_lamp_m + self.to_picture_m) / self.from_lamp_m;
        // A thin prism deflects light by (n − 1) times its slope.
        let height_m = magnified * self.side_m / (self.to_picture_m * (self.ior - 1.0)) * self.side_m;
        let factors = potential(&butterfly());
        let [right, up] = self.axes();
        let at = |u: f64, v: f64, out: f64| {
            self.centre
                + right * ((u - 0.5) * self.side_m)
                + up * ((v - 0.5) * self.side_m)
                + self.forward * out
        };
        let front = |u: f64, v: f64| {
            let (height, slope) = cosine_sum(&factors, DVec2::new(u, v));
            let slope = slope * (height_m / self.side_m);
            let normal = self.forward - right * slope.x - up * slope.y;
            (at(u, v, self.thickness_m + height_m * height), normal.normalize())
        };
        let mut mesh = shapes::sheet(QUADS, QUADS, front);
        shapes::append(
            &mut mesh,
            &shapes::sheet(QUADS, QUADS, |u, v| (at(u, v, 0.0), -self.forward)),
        );
        // Sides along u at v = 0 and 1, and along v at u = 0 and 1.
        for (outward, is_along_u, end) in [
            (-up, true, 0.0),
            (up, true, 1.0),
            (-right, false, 0.0),
            (right, false, 1.0),
        ] {
            let side = shapes::sheet(QUADS, 1, |s, out| {
                let (u, v) = if is_along_u { (s, end) } else { (end, s) };
                let position = if out == 0.0 { at(u, v, 0.0) } else { front(u, v).0 };
                (position, outward)
            });
            shapes::append(&mut mesh, &side);
        }
        mesh
    }
}

/// Density of the picture, with mean 1: the curve of T. H. Fay (1989) as a bright line.
fn butterfly() -> Grid {
    let points: Vec<DVec2> = (0..900)
        .map(|step| {
            let angle = TAU * f64::from(step) / 900.0;
            let radius = angle.sin().exp() - 2.0 * (4.0 * angle).cos();
            DVec2::new(0.5, 0.42) + DVec2::from_angle(angle) * (0.1 * radius)
        })
        .collect();
    let brightness = |index: usize| {
        let place = middle(index);
        let nearest = points
            .iter()
            .map(|point| point.distance_squared(place))
            .fold(1.0, f64::min);
        1.0 + (CONTRAST - 1.0) * (-0.5 * nearest / (LINE * LINE)).exp()
    };
    let grid: Grid = (0..CELLS * CELLS).map(brightness).collect();
    let mean = grid.iter().sum::<f64>() / grid.len() as f64;
    grid.iter().map(|value| value / mean).collect()
}

fn middle(index: usize) -> DVec2 {
    DVec2::new((index % CELLS) as f64 + 0.5, (index / CELLS) as f64 + 0.5) / CELLS as f64
}

/// Value of a grid at a point, interpolated bilinearly between cell centres.
fn look_up(grid: &[f64], place: DVec2) -> f64 {
    let last = (CELLS - 1) as f64;
    let at = (place * CELLS as f64 - 0.5).clamp(DVec2::ZERO, DVec2::splat(last));
    let (x, y) = (at.x.min(last - 1.0) as usize, at.y.min(last - 1.0) as usize);
    let (fx, fy) = (at.x - x as f64, at.y - y as f64);
    let row = |y: usize| grid[y * CELLS + x] * (1.0 - fx) + grid[y * CELLS + x + 1] * fx;
    row(y) * (1.0 - fy) + row(y + 1) * fy
}

/// φ, as coefficients of cosines.
fn potential(target: &Grid) -> Grid {
    let waves = cosines();
    let mut factors = vec![0.0; CELLS * CELLS];
    for _ in 0..ROUNDS {
        let phi = evaluated(&factors, &waves);
        let laplacian: Grid = (0..CELLS * CELLS)
            .map(|index| wanted_laplacian(&phi, target, index))
            .collect();
        factors = analysed(&laplacian, &waves);
        for (index, factor) in factors.iter_mut().enumerate() {
            let (m, n) = ((index % CELLS) as f64, (index / CELLS) as f64);
            // Eigenvalue of the finite differences below, not of the continuous Laplacian.
            let eigenvalue =
                |wave: f64| (2.0 - 2.0 * (PI * wave / CELLS as f64).cos()) * (CELLS * CELLS) as f64;
            *factor = if index == 0 {
                0.0
            } else {
                -*factor / (eigenvalue(m) + eigenvalue(n))
            };
        }
    }
    factors
}

/// Δφ in a cell, from the second derivatives and the gradient of the previous iteration.
fn wanted_laplacian(phi: &[f64], target: &[f64], index: usize) -> f64 {
    let (column, row) = (index % CELLS, index / CELLS);
    // Mirrored at the border.
    let at = |dx: isize, dy: isize| {
        let within = |cell: usize, step: isize| cell.saturating_add_signed(step).min(CELLS - 1);
        phi[within(row, dy) * CELLS + within(column, dx)]
    };
    let (here, cells) = (at(0, 0), CELLS as f64);
    let xx = (at(1, 0) - 2.0 * here + at(-1, 0)) * cells * cells;
    let yy = (at(0, 1) - 2.0 * here + at(0, -1)) * cells * cells;
    let xy = (at(1, 1) - at(-1, 1) - at(1, -1) + at(-1, -1)) * 0.25 * cells * cells;
    let gradient = DVec2::new(at(1, 0) - at(-1, 0), at(0, 1) - at(0, -1)) * (0.5 * cells);
    let density = look_up(target, middle(index) + gradient);
    let squares = (1.0 + xx).powi(2) + (1.0 + yy).powi(2) + 2.0 * xy * xy;
    (squares + 2.0 / density).sqrt() - 2.0
}

/// cos(π m x) for each wave m (row) and cell centre x (column).
fn cosines() -> Grid {
    let value =
        |index: usize| (PI * (index / CELLS) as f64 * ((index % CELLS) as f64 + 0.5) / CELLS as f64).cos();
    (0..CELLS * CELLS).map(value).collect()
}

/// Product of two matrices.
fn product(a: &[f64], b: &[f64]) -> Grid {
    let mut result = vec![0.0; CELLS * CELLS];
    for (sums, row) in result.chunks_mut(CELLS).zip(a.chunks(CELLS)) {
        for (factor, other) in row.iter().zip(b.chunks(CELLS)) {
            sums.iter_mut()
                .zip(other)
                .for_each(|(sum, value)| *sum += factor * value);
        }
    }
    result
}

fn transposed(a: &[f64]) -> Grid {
    (0..CELLS * CELLS)
        .map(|index| a[index % CELLS * CELLS + index / CELLS])
        .collect()
}

/// Values of a cosine sum at the cell centres.
fn evaluated(factors: &[f64], waves: &[f64]) -> Grid {
    product(&transposed(waves), &product(factors, waves))
}

/// Coefficients of the cosine sum with these values.
fn analysed(values: &[f64], waves: &[f64]) -> Grid {
    let mut factors = product(&product(waves, values), &transposed(waves));
    let share = |wave: usize| if wave == 0 { 1.0 } else { 2.0 } / CELLS as f64;
    for (index, factor) in factors.iter_mut().enumerate() {
        *factor *= share(index % CELLS) * share(index / CELLS);
    }
    factors
}

/// Value and gradient of a cosine sum at any point of the square.
fn cosine_sum(factors: &[f64], place: DVec2) -> (f64, DVec2) {
    let table = |x: f64| -> Vec<(f64, f64)> {
        let wave = |m: usize| {
            let frequency = PI * m as f64;
            let (sine, cosine) = (frequency * x).sin_cos();
            (cosine, -frequency * sine)
        };
        (0..CELLS).map(wave).collect()
    };
    let (x, y) = (table(place.x), table(place.y));
    let (mut value, mut gradient) = (0.0, DVec2::ZERO);
    for (row, (cosine_y, slope_y)) in factors.chunks(CELLS).zip(y) {
        let (mut sum, mut slope) = (0.0, 0.0);
        for (factor, (cosine_x, slope_x)) in row.iter().zip(&x) {
            sum += factor * cosine_x;
            slope += factor * slope_x;
        }
        value += sum * cosine_y;
        gradient += DVec2::new(slope * cosine_y, sum * slope_y);
    }
    (value, gradient)
}
