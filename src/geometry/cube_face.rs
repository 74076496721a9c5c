//! The faces of a cube around a point, mapped from the unit square with equal solid angles or by plain projection.
//!
//! A face is the rectangle |x| ≤ 1, |y| ≤ 1 of the plane z = 1 as seen from the origin.

use glam::{DMat3, DVec2, DVec3};

/// Solid angle [sr] of one face: a sixth of the sphere.
pub const FACE_SOLID_ANGLE_SR: f64 = 2.0 * std::f64::consts::PI / 3.0;

/// Mapping from the unit square to a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceMapping {
    /// Equal areas map to equal solid angles; smooth within the face. The symmetric case of Ureña, Fajardo and King,
    /// "An Area-Preserving Parametrization for Spherical Rectangles", 2013.
    EqualSolidAngle,
    /// Equal areas map to equal areas of the face, as in the paper (eq. 4.1).
    Plain,
}

/// Rotation from the face's frame (x right, y down, z outwards) to the world axes: columns are the face's x, y and z.
pub fn axes_from_face(face: usize) -> DMat3 {
    let (x, y, z) = match face {
        0 => (DVec3::Y, DVec3::Z, DVec3::X),
        1 => (DVec3::Z, DVec3::Y, DVec3::NEG_X),
        2 => (DVec3::Z, DVec3::X, DVec3::Y),
        3 => (DVec3::X, DVec3::Z, DVec3::NEG_Y),
        4 => (DVec3::X, DVec3::Y, DVec3::Z),
        _ => (DVec3::Y, DVec3::X, DVec3::NEG_Z),
    };
    DMat3::from_cols(x, y, z)
}

/// Solid angle [sr] of the part of the plane z = 1 from the origin to (`x`, `y`), odd in both.
fn corner_solid_angle_sr(x: f64, y: f64) -> f64 {
    (x * y).atan2((1.0 + x * x + y * y).sqrt())
}

/// Solid angle [sr] of the rectangle of the plane z = 1 between two corners.
pub fn rectangle_solid_angle_sr(low: DVec2, high: DVec2) -> f64 {
    corner_solid_angle_sr(high.x, high.y)
        - corner_solid_angle_sr(low.x, high.y)
        - corner_solid_angle_sr(high.x, low.y)
        + corner_solid_angle_sr(low.x, low.y)
}

impl FaceMapping {
    /// Point of the face for a point of the unit square.
    ///
    /// Equal solid angle: the part of the face left of x covers Ω(x) = π/3 + 2·atan(x/√(2 + x²)) of the face's 2π/3,
    /// which is solved for x. Within a column, the sine of the elevation y/√(1 + x² + y²) is linear in v.
    pub fn plane_from_square(self, square: DVec2) -> DVec2 {
        match self {
            Self::Plain => square * 2.0 - 1.0,
            Self::EqualSolidAngle => {
                let tangent = ((square.x - 0.5) * (0.5 * FACE_SOLID_ANGLE_SR)).tan();
                let x = tangent * (2.0 / (1.0 - tangent * tangent)).sqrt();
                let sine = (2.0 * square.y - 1.0) / (2.0 + x * x).sqrt();
                DVec2::new(x, sine * ((1.0 + x * x) / (1.0 - sine * sine)).sqrt())
            }
        }
    }

    /// Point of the unit square for a point of the face: the inverse of [`Self::plane_from_square`].
    pub fn square_from_plane(self, plane: DVec2) -> DVec2 {
        match self {
            Self::Plain => (plane + 1.0) * 0.5,
            Self::EqualSolidAngle => {
                let d2 = 1.0 + plane.x * plane.x;
                let share = plane.x.atan2((d2 + 1.0).sqrt()) / (0.5 * FACE_SOLID_ANGLE_SR) + 0.5;
                let sine = plane.y / (d2 + plane.y * plane.y).sqrt();
                DVec2::new(share, 0.5 * (sine * (d2 + 1.0).sqrt() + 1.0))
            }
        }
    }

    /// The `y` of [`Self::square_from_plane`] alone, without the arctangent of its `x`.
    pub fn row_share(self, plane: DVec2) -> f64 {
        match self {
            Self::Plain => (plane.y + 1.0) * 0.5,
            Self::EqualSolidAngle => {
                let d2 = 1.0 + plane.x * plane.x;
                0.5 * (plane.y * ((d2 + 1.0) / (d2 + plane.y * plane.y)).sqrt() + 1.0)
            }
        }
    }

    /// Solid angle [sr] of the cell between two corners of the unit square.
    pub fn cell_solid_angle_sr(self, low: DVec2, high: DVec2) -> f64 {
        match self {
            Self::EqualSolidAngle => FACE_SOLID_ANGLE_SR * (high.x - low.x) * (high.y - low.y),
            Self::Plain => {
                rectangle_solid_angle_sr(self.plane_from_square(low), self.plane_from_square(high))
            }
        }
    }
}
