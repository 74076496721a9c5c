//! The two sides of a surface. Light on one side of a thin sheet is not seen on the other, so each side is a receiver
//! with a map of its own. Both use the same coordinates.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A side of a surface, by the winding of its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Where the geometric normal points to.
    Front,
    /// The other one.
    Back,
}

impl Side {
    /// The side that a ray of some direction comes to, of a surface with a geometric normal.
    pub fn met(direction: DVec3, geometric_normal: DVec3) -> Self {
        if direction.dot(geometric_normal) <= 0.0 {
            Self::Front
        } else {
            Self::Back
        }
    }

    /// What the geometric normal is multiplied by to point away from the surface on this side.
    pub fn sign(self) -> f64 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }
}

/// One side of one object: what takes light into a map. Ordered by object, its front first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Receiver(u32);

impl Receiver {
    /// A side of an object, an index into `Scene::objects` below 2³¹.
    pub fn new(object: usize, side: Side) -> Self {
        Self((object as u32) << 1 | u32::from(side == Side::Back))
    }

    /// The front of an object.
    pub fn front(object: usize) -> Self {
        Self::new(object, Side::Front)
    }

    /// The back of an object.
    pub fn back(object: usize) -> Self {
        Self::new(object, Side::Back)
    }

    /// The receivers of so many objects, in order.
    pub fn all(objects: usize) -> impl Iterator<Item = Self> {
        (0..2 * objects as u32).map(Self)
    }

    /// Index into `Scene::objects`.
    pub fn object(self) -> usize {
        (self.0 >> 1) as usize
    }

    /// Which side of it.
    pub fn side(self) -> Side {
        if self.0 & 1 == 0 { Side::Front } else { Side::Back }
    }

    /// Its place among [`Receiver::all`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Debug for Receiver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} of object {}", self.side(), self.object())
    }
}
