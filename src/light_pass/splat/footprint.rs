//! The footprint of a ray: the area that it lights, from where its neighbours landed (section 3.2.1 of the paper).

use glam::{DVec2, DVec3};

use crate::light_pass::path::Arrival;
use crate::settings::Footprint;

/// A symmetric 2×2 matrix M in texel coordinates: the footprint is the ellipse dᵀM⁻¹d ≤ 1, of area π√det M texels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ellipse {
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
}

impl Ellipse {
    /// The outer product of a vector with itself.
    fn of_vector(v: DVec2) -> Self {
        Self {
            xx: v.x * v.x,
            xy: v.x * v.y,
            yy: v.y * v.y,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// Scales every radius by √factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            xx: self.xx * factor,
            xy: self.xy * factor,
            yy: self.yy * factor,
        }
    }

    /// With x and y exchanged.
    #[must_use]
    pub fn transposed(self) -> Self {
        Self {
            xx: self.yy,
            xy: self.xy,
            yy: self.xx,
        }
    }

    fn determinant(self) -> f64 {
        (self.xx * self.yy - self.xy * self.xy).max(0.0)
    }

    /// Area [texels].
    pub fn area_texels(self) -> f64 {
        std::f64::consts::PI * self.determinant().sqrt()
    }

    /// Adds a radius in quadrature in all directions, so that a line or a point keeps an inverse.
    pub fn at_least(self, radius_texels: f64) -> Self {
        let floor = radius_texels * radius_texels;
        Self {
            xx: self.xx + floor,
            xy: self.xy,
            yy: self.yy + floor,
        }
    }

    pub(crate) fn is_finite(self) -> bool {
        self.xx.is_finite() && self.xy.is_finite() && self.yy.is_finite()
    }
}

/// Arrivals of the neighbouring rays that took the same path to the same receiver.
#[derive(Clone, Copy, Debug, Default)]
pub struct Neighbours<'a> {
    /// One column before and after.
    pub across: [Option<&'a Arrival>; 2],
    /// One row before and after.
    pub down: [Option<&'a Arrival>; 2],
}

/// Local geometry of the receiver's map: rows of the linear map from metres to texels.
pub type TexelFromWorld = [DVec3; 2];

/// The footprint of an arrival that represents one lattice cell.
///
/// `unbent_area_m2` is the cell's area if its light were never deflected: the size for [`Footprint::Distance`], and the
/// fallback without neighbours. `fixed_area_m2` is the size for [`Footprint::Fixed`].
pub fn footprint(
    kind: Footprint,
    arrival: &Arrival,
    neighbours: &Neighbours,
    texel_from_world: &TexelFromWorld,
    unbent_area_m2: &dyn Fn() -> f64,
    fixed_area_m2: &dyn Fn() -> f64,
) -> Ellipse {
    // A disc on the surface is an ellipse on the map.
    let round = |area_m2: f64| {
        let [across, down] = texel_from_world;
        Ellipse {
            xx: across.length_squared(),
            xy: across.dot(*down),
            yy: down.length_squared(),
        }
        .scaled(area_m2 / std::f64::consts::PI)
    };

    // Neighbours give an ellipse or, for discs, its area alone.
    match kind {
        Footprint::Fixed => round(fixed_area_m2()),
        Footprint::Distance => round(unbent_area_m2()),
        Footprint::Ellipse => {
            spanned(arrival, neighbours, texel_from_world).unwrap_or_else(|| round(unbent_area_m2()))
        }
        Footprint::Disc => match spanned(arrival, neighbours, texel_from_world) {
            Some(ellipse) => {
                let [across, down] = texel_from_world;
                let texels_per_m2 = across.cross(*down).length();
                round(ellipse.area_texels() / texels_per_m2)
            }
            None => round(unbent_area_m2()),
        },
    }
}

/// The ellipse that the neighbours span. With J = [a b] the displacement per column and row of the lattice, the cell's
/// image has the area |det J|, and M = (aaᵀ + bbᵀ)/π is the ellipse of this area and shape. aaᵀ is the mean over the
/// steps forwards and backwards, which preserves the spread where the wavefront folds and the two cancel. A direction
/// without neighbours is as wide as the other; `None` without any.
fn spanned(arrival: &Arrival, neighbours: &Neighbours, texel_from_world: &TexelFromWorld) -> Option<Ellipse> {
    let spread = |steps: [Option<&Arrival>; 2]| {
        let mut sum = Ellipse::default();
        let mut count = 0.0;
        for step in steps.into_iter().flatten() {
            let d = step.point - arrival.point;
            let [across, down] = texel_from_world;
            sum = sum.plus(Ellipse::of_vector(DVec2::new(across.dot(d), down.dot(d))));
            count += 1.0;
        }
        (count > 0.0).then(|| sum.scaled(1.0 / count))
    };
    let ellipse = match (spread(neighbours.across), spread(neighbours.down)) {
        (Some(a), Some(b)) => a.plus(b),
        (Some(only), None) | (None, Some(only)) => {
            // As wide across the known direction as along it.
            let width = only.xx + only.yy;
            Ellipse {
                xx: width,
                xy: 0.0,
                yy: width,
            }
        }
        (None, None) => return None,
    };
    Some(ellipse.scaled(1.0 / std::f64::consts::PI))
}
