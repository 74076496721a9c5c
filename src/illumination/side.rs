//! The two sides of a surface. Light on one side of a thin sheet is not seen on the other, so each side is a receiver
//! with a map of its own. Both use the same coordinates.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A side of a surface, by the winding of its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Side that the geometric normal points to.
    Front,
    Back,
}

impl Side {
    /// The side that a ray of this direction hits.
    pub fn met(direction: DVec3, geometric_normal: DVec3) -> Self {
        if direction.dot(geometric_normal) <= 0.0 {
            Self::Front
        } else {
            Self::Back
        }
    }

    /// Factor of the geometric normal that makes it point away from the surface on this side.
    pub fn sign(self) -> f64 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }
}

/// One side of one object, which can receive light in a map. Ordered by object, front first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Receiver(u32);

impl Receiver {
    /// A side of an object, given its index in `Scene::objects`, below 2³¹.
    pub fn new(object: usize, side: Side) -> Self {
        Self((object as u32) << 1 | u32::from(side == Side::Back))
    }

    pub fn front(object: usize) -> Self {
        Self::new(object, Side::Front)
    }

    pub fn back(object: usize) -> Self {
        Self::new(object, Side::Back)
    }

    /// The receivers of this many objects, in order.
    pub fn all(objects: usize) -> impl Iterator<Item = Self> {
        (0..2 * objects as u32).map(Self)
    }

    /// Index into `Scene::objects`.
    pub fn object(self) -> usize {
        (self.0 >> 1) as usize
    }

    pub fn side(self) -> Side {
        if self.0 & 1 == 0 { Side::Front } else { Side::Back }
    }

    /// Position in [`Receiver::all`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Debug for Receiver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} of object {}", self.side(), self.object())
    }
}
