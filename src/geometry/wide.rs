//! Intersects a ray with four boxes or four triangles at a time in single precision, conservatively.
//!
//! The hierarchy of two children a node is folded into one of four (Wald, Benthin and Boulos, "Getting Rid of Packets",
//! 2008), so that one operation serves four boxes; so do the triangles of its leaves.

use glam::{BVec4A, DVec3, Vec3A, Vec4};
use obvhs::bvh2::Bvh2;

use super::bvh::to_single;

/// Generous bound on the rounding of a coordinate or an operation.
const ROUNDING: f32 = 1e-6;

/// Largest stack that is kept off the heap [entries].
const USUAL_STACK: usize = 48;

/// Triangles tested at once.
const LANES: usize = 4;

/// Boxes of up to four child nodes or leaves, in two cache lines.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Wide {
    /// Minimum and maximum of the four boxes along each axis; inverted in empty lanes.
    planes: [[Vec4; 2]; 3],
    /// Indices of nodes, or of the first packs of leaves, marked by [`LEAF`].
    children: [u32; 4],
}

/// Marks leaves among children.
const LEAF: u32 = 1 << 31;

/// Up to four triangles (Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997). The test has
/// margins wider than all rounding: it only rejects what the exact test would reject too. In three cache lines.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Pack {
    corner: [Vec4; 3],
    edges: [[Vec4; 3]; 2],
    /// Lengths of the edges, rounded up.
    lengths: [Vec4; 2],
    /// Slot of the first triangle; the others follow.
    first: u32,
    /// Bit mask of the lanes in use.
    lanes: u32,
    /// Whether it is the last of its leaf.
    is_last: bool,
}

/// A ray in units in which the scene has a radius of about one.
#[derive(Clone, Copy, Debug)]
pub(super) struct WideRay {
    pub(super) origin: Vec3A,
    pub(super) direction: Vec3A,
    /// End of the search.
    pub(super) end: f32,
    /// Slot of the triangle that it leaves.
    pub(super) left: u32,
}

/// A four-wide hierarchy in single precision.
pub(super) struct WideBvh {
    nodes: Vec<Wide>,
    packs: Vec<Pack>,
    /// Largest number of stack entries.
    stack: usize,
}

impl WideBvh {
    /// `triangles` are in the order of the leaves, in units in which the scene has a radius of about one.
    pub(super) fn new(bvh: &Bvh2, triangles: &[[DVec3; 3]]) -> Self {
        let mut wide = Self {
            nodes: Vec::new(),
            packs: Vec::new(),
            stack: 0,
        };
        if !triangles.is_empty() {
            wide.nodes.push(Wide::EMPTY);
            wide.fold(bvh, triangles);
        }
        wide
    }

    /// Fills the nodes below the root, which exists already.
    fn fold(&mut self, bvh: &Bvh2, triangles: &[[DVec3; 3]]) {
        // Nodes to fill: own index, index in the binary hierarchy, depth.
        let mut waiting = vec![(0, 0, 1)];
        while let Some((place, from, depth)) = waiting.pop() {
            self.stack = self.stack.max(3 * depth + 1);
            for (lane, child) in four(bvh, from).enumerate() {
                let node = &bvh.nodes[child];
                let aabb = node.aabb();
                for axis in 0..3 {
                    let [low, high] = &mut self.nodes[place].planes[axis];
                    (low[lane], high[lane]) = (aabb.min[axis], aabb.max[axis]);
                }
                self.nodes[place].children[lane] = if node.is_leaf() {
                    let first = node.first_index as usize;
                    self.leaf(first, &triangles[first..first + node.prim_count as usize])
                } else {
                    let index = self.nodes.len();
                    self.nodes.push(Wide::EMPTY);
                    waiting.push((index, child, depth + 1));
                    index as u32
                };
            }
        }
    }

    fn leaf(&mut self, first: usize, triangles: &[[DVec3; 3]]) -> u32 {
        let index = self.packs.len() as u32;
        let packs = triangles.chunks(LANES).enumerate();
        let packs = packs.map(|(pack, triangles)| Pack::new(first + pack * LANES, triangles));
        self.packs.extend(packs);
        if let Some(last) = self.packs.last_mut() {
            last.is_last = true;
        }
        index | LEAF
    }

    /// Calls `meet` with the slots of all triangles that the ray may hit, roughly front to back. `meet` returns the new
    /// end of the search; a negative one ends it at once.
    #[inline(always)]
    pub(super) fn search(&self, ray: WideRay, meet: impl FnMut(usize) -> f32) {
        if self.nodes.is_empty() {
            return;
        }
        if self.stack <= USUAL_STACK {
            self.walk(ray, &mut [(0.0, 0); USUAL_STACK], meet);
        } else {
            self.walk(ray, &mut vec![(0.0, 0); self.stack], meet);
        }
    }

    #[inline(always)]
    fn walk(&self, mut ray: WideRay, stack: &mut [(f32, u32)], mut meet: impl FnMut(usize) -> f32) {
        // Nodes wait with the distances of their boxes, so that those beyond a nearer hit are dropped unread.
        let slabs = Slabs::new(&ray);
        let lanes = RayLanes::new(&ray);
        let mut height = 0;
        let mut child = 0;
        loop {
            if child & LEAF != 0 {
                // The test of four triangles is conservative: what passes it is decided exactly by `meet`.
                for pack in &self.packs[(child & !LEAF) as usize..] {
                    // The lane of the triangle that the ray leaves; beyond all lanes in other packs.
                    let left = 1_u64 << ray.left.wrapping_sub(pack.first).min(63);
                    let mut met = pack.may_meet(&lanes, ray.end) & !(left as u32);
                    while met != 0 {
                        let lane = met.trailing_zeros();
                        met &= met - 1;
                        ray.end = ray.end.min(meet((pack.first + lane) as usize));
                        if ray.end < 0.0 {
                            return;
                        }
                    }
                    if pack.is_last {
                        break;
                    }
                }
            } else {
                let node = &self.nodes[child as usize];
                let (nears, mut met) = slabs.meet(node, ray.end);
                if met != 0 {
                    let lane = lowest(met);
                    met &= met - 1;
                    // The nearest comes first; the others wait unsorted.
                    let mut best = (nears[lane], node.children[lane]);
                    while met != 0 {
                        let lane = lowest(met);
                        met &= met - 1;
                        let other = (nears[lane], node.children[lane]);
                        let swap = other.0 < best.0;
                        stack[height] = if swap { best } else { other };
                        best = if swap { other } else { best };
                        height += 1;
                    }
                    child = best.1;
                    continue;
                }
            }

            // The latest waiting node whose box begins before the ray's end; those skipped lie behind a hit.
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                if stack[height].0 <= ray.end {
                    child = stack[height].1;
                    break;
                }
            }
        }
    }
}

/// The lowest lane of a mask, which is not empty.
fn lowest(mask: u32) -> usize {
    mask.trailing_zeros() as usize % LANES
}

/// Up to four nodes below one, splitting the largest first; the node itself if it is a leaf.
fn four(bvh: &Bvh2, from: usize) -> impl Iterator<Item = usize> {
    let mut found = vec![from];
    while found.len() < 4 {
        let size = |place: &usize| bvh.nodes[found[*place]].aabb().half_area();
        let inner = (0..found.len()).filter(|place| !bvh.nodes[found[*place]].is_leaf());
        let Some(largest) = inner.max_by(|a, b| size(a).total_cmp(&size(b))) else {
            break;
        };
        let first = bvh.nodes[found[largest]].first_index as usize;
        found[largest] = first;
        found.push(first + 1);
    }
    found.into_iter()
}

impl Wide {
    const EMPTY: Self = Self {
        planes: [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3],
        children: [0; 4],
    };
}

/// Ray data for the slab tests.
struct Slabs {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// Which of the two planes of each axis the ray crosses first.
    near: [usize; 3],
}

impl Slabs {
    fn new(ray: &WideRay) -> Self {
        // Clamps components near zero, which keeps their inverses finite.
        let inverse = ray.direction.to_array().map(|component| {
            if component.abs() > f32::EPSILON {
                1.0 / component
            } else {
                (1.0 / f32::EPSILON).copysign(component)
            }
        });
        let near = |axis: usize| usize::from(inverse[axis] < 0.0);
        Self {
            near: [near(0), near(1), near(2)],
            origin: ray.origin.to_array().map(Vec4::splat),
            inverse: inverse.map(Vec4::splat),
        }
    }

    /// Distances at which the ray enters the boxes, and the bit mask of those it hits before its end.
    #[inline(always)]
    fn meet(&self, node: &Wide, end: f32) -> ([f32; 4], u32) {
        // Masked, the index needs no bounds check.
        let plane = |axis: usize, which: usize| {
            (node.planes[axis][which & 1] - self.origin[axis]) * self.inverse[axis]
        };
        let near = |axis: usize| plane(axis, self.near[axis]);
        let far = |axis: usize| plane(axis, self.near[axis] ^ 1);
        let enters = near(0).max(near(1)).max(near(2)).max(Vec4::ZERO);
        let leaves = far(0).min(far(1)).min(far(2)).min(Vec4::splat(end));
        (enters.to_array(), enters.cmple(leaves).bitmask())
    }
}

/// Ray data for the triangle tests.
struct RayLanes {
    origin: [Vec4; 3],
    direction: [Vec4; 3],
    /// Error of a coordinate: of origin and corner, and of the sums and products derived from them.
    error: Vec4,
}

impl RayLanes {
    fn new(ray: &WideRay) -> Self {
        Self {
            origin: ray.origin.to_array().map(Vec4::splat),
            direction: ray.direction.to_array().map(Vec4::splat),
            // No corner is farther from the centre than a few units.
            error: Vec4::splat(ROUNDING * (3.0 + ray.origin.length())),
        }
    }
}

fn cross(a: [Vec4; 3], b: [Vec4; 3]) -> [Vec4; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Pack {
    fn new(first: usize, triangles: &[[DVec3; 3]]) -> Self {
        let mut pack = Self {
            corner: [Vec4::ZERO; 3],
            edges: [[Vec4::ZERO; 3]; 2],
            lengths: [Vec4::ZERO; 2],
            first: first as u32,
            lanes: (1 << triangles.len()) - 1,
            is_last: false,
        };
        for (lane, [a, b, c]) in triangles.iter().enumerate() {
            let edges = [to_single(*b - *a), to_single(*c - *a)];
            let corner = to_single(*a);
            for axis in 0..3 {
                pack.corner[axis][lane] = corner[axis];
                pack.edges[0][axis][lane] = edges[0][axis];
                pack.edges[1][axis][lane] = edges[1][axis];
            }
            for (lengths, edge) in pack.lengths.iter_mut().zip(edges) {
                lengths[lane] = edge.length() * (1.0 + ROUNDING);
            }
        }
        pack
    }

    /// Bit mask of the triangles, except those that the ray clearly misses or hits clearly behind its origin or beyond
    /// its end. Non-finite numbers never count as clear.
    #[inline(always)]
    fn may_meet(&self, ray: &RayLanes, end: f32) -> u32 {
        let [e1, e2] = self.edges;
        let from_corner = [0, 1, 2].map(|axis| ray.origin[axis] - self.corner[axis]);
        let p = cross(ray.direction, e2);
        let determinant = dot(e1, p);
        let area = self.lengths[0] * self.lengths[1];
        let size = determinant.abs();
        let size_error = area * ROUNDING;
        let side = determinant.signum();
        let u = side * dot(from_corner, p);
        let q = cross(from_corner, e1);
        let v = side * dot(ray.direction, q);
        let [u_error, v_error] = [self.lengths[1] * ray.error, self.lengths[0] * ray.error];
        let distance = side * dot(e2, q);
        let distance_error = area * ray.error;
        let missed: BVec4A = u.cmplt(-u_error)
            | v.cmplt(-v_error)
            | (u + v).cmpgt(size + size_error + u_error + v_error)
            | distance.cmplt(-distance_error)
            | distance.cmpgt((size + size_error) * end + distance_error);
        let is_clear = size.cmpgt(size_error);
        !(missed & is_clear).bitmask() & self.lanes
    }
}
