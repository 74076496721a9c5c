//! Intersection of wavefront patches with receivers: planes by one equation, others by the hierarchy.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

use super::facets::Facets;
use crate::geometry::Ray;
use crate::illumination::{Chart, Receiver};
use crate::light_pass::receiver_maps::ChartFor;
use crate::scene::{Mesh, SurfaceKind};
use crate::transport::Tracer;

/// How far from the map's centre light is followed on the extended plane [map sides].
const FARTHEST_SIDES: f64 = 8.0;

/// Deviation from a plane and an affine parametrisation, relative to the mesh, that counts as rounding.
const FLATNESS: f64 = 1e-7;

/// A receiver that lies in one plane, with affine map coordinates.
#[derive(Clone, Copy, Debug)]
pub struct PlaneChart {
    normal: DVec3,
    offset_m: f64,
    /// Texel coordinates are `rows·p + origin`.
    rows: [DVec3; 2],
    origin: DVec2,
    middle: DVec2,
    farthest_texels: f64,
    /// Whether the surface fills its map, so that the map's border is the surface's.
    pub fills_map: bool,
}

impl PlaneChart {
    /// Texel coordinates where a ray (of any length) hits the extended plane, and the distance in units of the
    /// direction; `None` if it misses, comes from behind, or hits too far off the map to matter.
    pub fn meet(&self, ray: &Ray) -> Option<(DVec2, f64)> {
        let slope = ray.direction.dot(self.normal);
        if slope > 0.0 {
            return None;
        }
        let distance = (self.offset_m - ray.origin.dot(self.normal)) / slope;
        let point = ray.origin + ray.direction * distance;
        let texel = DVec2::new(self.rows[0].dot(point), self.rows[1].dot(point)) + self.origin;
        let near = (texel - self.middle).abs().max_element() <= self.farthest_texels;
        // Rejects NaN too.
        (distance > 0.0 && near).then_some((texel, distance))
    }

    /// Whether a point lies behind the plane, so that light from there cannot reach this side.
    pub fn hides(&self, point: DVec3) -> bool {
        point.dot(self.normal) < self.offset_m
    }

    fn of(mesh: &Mesh, chart: &Chart) -> Option<Self> {
        let largest = (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle);
                ((b - a).cross(c - a).length_squared(), triangle)
            })
            .reduce(|a, b| if b.0 > a.0 { b } else { a })?
            .1;
        let corners = mesh.corners(largest);
        // Opposes the incident light.
        let normal = mesh.face_normal(largest) * chart.receiver.side().sign();
        let rows = chart.texel_from_world(largest, corners)?;
        let size = DVec2::new(chart.width as f64, chart.height as f64);
        let origin = chart.corner_uvs[largest][0] * size
            - DVec2::new(rows[0].dot(corners[0]), rows[1].dot(corners[0]));
        let offset_m = normal.dot(corners[0]);
        let (low, high) = mesh.bounds()?;
        let tolerance_m = FLATNESS * (high - low).length();
        let tolerance_texels = FLATNESS * size.max_element();
        for (triangle, uvs) in chart.corner_uvs.iter().enumerate() {
            for (corner, uv) in mesh.corners(triangle).into_iter().zip(uvs) {
                let texel = DVec2::new(rows[0].dot(corner), rows[1].dot(corner)) + origin;
                let off_plane = (normal.dot(corner) - offset_m).abs() > tolerance_m;
                if off_plane || (texel - *uv * size).abs().max_element() > tolerance_texels {
                    return None;
                }
            }
        }
        Some(Self {
            normal,
            offset_m,
            rows,
            origin,
            middle: size * 0.5,
            farthest_texels: FARTHEST_SIDES * size.max_element(),
            fills_map: chart.is_full(),
        })
    }
}

/// A receiver with its parametrisation.
#[derive(Debug)]
pub struct ReceiverSurface {
    pub chart: Arc<Chart>,
    /// `None` where it is not flat.
    pub plane: Option<PlaneChart>,
    /// Whether it takes all incident light.
    pub is_diffuse: bool,
    /// Area of the whole surface [m²].
    pub area_m2: f64,
}

impl ReceiverSurface {
    pub fn island(&self, triangle: u32) -> u32 {
        self.chart
            .islands()
            .map_or(0, |islands| islands.of_triangle(triangle as usize))
    }

    /// Texel coordinates of a point of a triangle, from its second and third barycentric coordinate.
    pub fn texel(&self, triangle: u32, barycentric: DVec2) -> DVec2 {
        let [b, c] = barycentric.to_array();
        let size = DVec2::new(self.chart.width as f64, self.chart.height as f64);
        self.chart.uv(triangle as usize, [1.0 - b - c, b, c]) * size
    }
}

/// All receivers of a scene, prepared on first use.
pub struct Receivers<'a> {
    pub tracer: &'a Tracer,
    chart_for: &'a ChartFor<'a>,
    slots: Vec<OnceLock<Option<ReceiverSurface>>>,
    bounds: Vec<(DVec3, DVec3)>,
    scene_bounds: (DVec3, DVec3),
}

impl std::fmt::Debug for Receivers<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Receivers").finish_non_exhaustive()
    }
}

impl<'a> Receivers<'a> {
    /// With no receiver prepared yet.
    pub fn new(tracer: &'a Tracer, chart_for: &'a ChartFor<'a>) -> Self {
        let scene = tracer.scene();
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        Self {
            tracer,
            chart_for,
            slots: Receiver::all(scene.objects.len())
                .map(|_| OnceLock::new())
                .collect(),
            bounds: scene
                .objects
                .iter()
                .map(|object| object.bounds().unwrap_or(empty))
                .collect(),
            scene_bounds: scene.bounds().unwrap_or(empty),
        }
    }

    /// `None` where the receiver cannot have a map.
    pub fn get(&self, receiver: Receiver) -> Option<&ReceiverSurface> {
        self.slots[receiver.index()]
            .get_or_init(|| self.prepare(receiver))
            .as_ref()
    }

    /// The facets of a receiver; `None` if it lies in one plane with an affine chart.
    pub fn facets(&self, receiver: Receiver) -> Option<Facets<'_>> {
        let surface = self.get(receiver).filter(|surface| surface.plane.is_none())?;
        Some(Facets {
            surface,
            mesh: self.tracer.scene().objects[receiver.object()].mesh_in_scene(),
            adjacency: self.tracer.adjacency(receiver.object()),
        })
    }

    fn prepare(&self, receiver: Receiver) -> Option<ReceiverSurface> {
        let scene = self.tracer.scene();
        let object = receiver.object();
        let chart = (self.chart_for)(receiver)?;
        let mesh = scene.objects[object].mesh_in_scene();
        Some(ReceiverSurface {
            plane: PlaneChart::of(mesh, &chart),
            is_diffuse: scene.material_of(object).surface == SurfaceKind::Diffuse,
            area_m2: mesh.area_m2(),
            chart,
        })
    }

    /// Whether a beam, given by its traced rays, may hit any object except the given ones: tests bounding boxes of
    /// objects against boxes around parts of the beam.
    pub fn meets_others(&self, beam: &PatchBeam, except: [u32; 2]) -> bool {
        let whole = beam.bounds(0.0, 1.0);
        self.tracer.note_box(whole);
        self.bounds.iter().enumerate().any(|(object, bounds)| {
            !except.contains(&(object as u32))
                && overlap(whole, *bounds)
                && beam.meets(*bounds, (0.0, 1.0), BEAM_HALVINGS)
        })
    }

    /// Where a ray leaves the scene's bounding box; its origin if it is already outside [m].
    pub fn exit_point(&self, ray: &Ray) -> DVec3 {
        let (low, high) = self.scene_bounds;
        let mut distance_m = f64::INFINITY;
        for axis in 0..3 {
            let d = ray.direction[axis];
            let wall = if d > 0.0 { high[axis] } else { low[axis] };
            if d != 0.0 {
                distance_m = distance_m.min((wall - ray.origin[axis]) / d);
            }
        }
        if distance_m > 0.0 && distance_m.is_finite() {
            ray.at(distance_m)
        } else {
            ray.origin
        }
    }
}

/// Halvings of a beam for a closer test.
const BEAM_HALVINGS: u32 = 5;

/// How far light between traced rays may stray from them, relative to their distance from each other.
const BEAM_MARGIN: f64 = 0.25;

/// Start and end points of a patch's traced rays [m].
#[derive(Clone, Copy, Debug)]
pub struct PatchBeam {
    ends: [[DVec3; 2]; 4],
}

impl PatchBeam {
    /// Of one to four rays.
    pub fn new(ends: impl Iterator<Item = [DVec3; 2]>) -> Self {
        let mut beam = Self {
            ends: [[DVec3::ZERO; 2]; 4],
        };
        let mut last = None;
        let mut ends = ends;
        for slot in &mut beam.ends {
            last = ends.next().or(last);
            *slot = last.unwrap_or_default();
        }
        beam
    }

    /// Bounding box of the part between two fractions of the way [m].
    fn bounds(&self, from: f64, to: f64) -> (DVec3, DVec3) {
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for share in [from, to] {
            let points = self.ends.map(|[start, end]| start.lerp(end, share));
            let low = points.into_iter().fold(DVec3::INFINITY, DVec3::min);
            let high = points.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
            let margin = (high - low).length() * BEAM_MARGIN;
            bounds = (bounds.0.min(low - margin), bounds.1.max(high + margin));
        }
        bounds
    }

    fn meets(&self, others: (DVec3, DVec3), (from, to): (f64, f64), halvings: u32) -> bool {
        overlap(self.bounds(from, to), others)
            && (halvings == 0 || {
                let middle = 0.5 * (from + to);
                [(from, middle), (middle, to)]
                    .into_iter()
                    .any(|part| self.meets(others, part, halvings - 1))
            })
    }
}

fn overlap(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> bool {
    a.0.cmple(b.1).all() && a.1.cmpge(b.0).all()
}
