//! Starts of photons: aimed at specular surfaces, and stratified as finely as there are photons.
//!
//! A photon's index, scrambled, is a place along a space-filling curve through the launch domain (Morton's, cell by
//! cell of the item buffer). For every power of two, the first n indices divide the curve into n strata of one photon
//! each; further indices fill the gaps, so that no photon is wasted (Owen, "Scrambled Net Variance", 1997).

use glam::DVec2;

use super::spheres::{LampPoint, Spheres};
use crate::geometry::Ray;
use crate::geometry::cube_face::FaceMapping;
use crate::geometry::sampling::{even_code, even_point, in_square, unfolded};
use crate::light_pass::item_buffer::CELLS_PER_SIDE;
use crate::light_pass::launch::Launch;
use crate::light_pass::visibility::VisibleLight;
use crate::optics::LinearSrgb;
use crate::scene::emitter::{Emitter, EmitterSampler};
use crate::scene::{Light, PanelShape, Scene};
use crate::transport::{MediumStack, Tracer, media_at};

/// Points of a lamp that are probed to tell whether all of it lies within one medium.
const MEDIUM_PROBES: u32 = 16;

/// Photons from which the mean flux is estimated.
const FLUX_PROBES: u32 = 1 << 12;

/// Points of a lamp that are tried where its centre sees nothing.
const MIDDLE_PROBES: u32 = 16;

/// Dimension of [`even_point`] for points on lamps; those for micro-normals follow.
pub(super) const LAMP_DIMENSION: u32 = 0;

/// In a lamp's unit square.
pub(in crate::light_pass) const LAMP_MIDDLE: DVec2 = DVec2::splat(0.5);

/// A photon at its light.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    pub ray: Ray,
    /// Flux, as if it were the only photon [W per channel of a light of unit strength].
    pub flux_w: LinearSrgb,
    /// Media around its origin.
    pub media: MediumStack,
}

/// The launch domain of one light.
#[derive(Debug)]
pub struct PhotonLaunch<'a> {
    domain: Domain<'a>,
}

#[derive(Debug)]
enum Domain<'a> {
    /// Light from one point or direction: the marked cells of its item buffer.
    Cells {
        launch: &'a Launch,
        cells: Vec<Cell>,
        /// Flux [W per channel] of a photon in a direction of full strength; `None` if it depends on the position in a
        /// cell.
        full_w: Option<LinearSrgb>,
    },
    /// Extended light: bounding spheres of specular surfaces, as seen from each point of the light.
    Spheres(Lamp<'a>),
}

/// An extended light.
#[derive(Debug)]
struct Lamp<'a> {
    places: EmitterSampler<'a>,
    tracer: &'a Tracer,
    spheres: &'a Spheres,
    /// Around all its points; `None` if they lie in different media.
    media: Option<MediumStack>,
    /// Diagonal of the scene [m].
    across_m: f64,
}

/// A cell of the item buffer.
#[derive(Clone, Copy, Debug)]
struct Cell {
    face: u8,
    column: u8,
    row: u8,
}

impl<'a> PhotonLaunch<'a> {
    /// The domain of a light: `extended`, of unit strength, if its size matters.
    pub fn of(
        tracer: &'a Tracer,
        visible_light: &'a VisibleLight,
        extended: Option<&'a Light>,
        seed: u64,
    ) -> Self {
        match extended {
            Some(light) => Self::of_places(tracer, light, visible_light.spheres(tracer, light), seed),
            None => Self::of_cells(visible_light),
        }
    }

    /// The domain of a light from one point or direction: the cells that its item buffer marks.
    pub fn of_cells(visible_light: &'a VisibleLight) -> Self {
        let side = CELLS_PER_SIDE;
        let marked = |face: usize| {
            let on_curve = (0..side * side).map(|place| {
                let [column, row] = unfolded(place as u64);
                (column as usize, row as usize)
            });
            on_curve.filter(move |&(column, row)| visible_light.item_buffer.is_marked(face, column, row))
        };
        let on_face = |face: usize| {
            marked(face).map(move |(column, row)| Cell {
                face: face as u8,
                column: column as u8,
                row: row as u8,
            })
        };
        let cells: Vec<Cell> = (0..visible_light.launch.face_count()).flat_map(on_face).collect();
        Self {
            domain: Domain::Cells {
                full_w: full_w(&visible_light.launch, cells.len()),
                launch: &visible_light.launch,
                cells,
            },
        }
    }

    /// The domain of an extended light; `light` has unit strength.
    fn of_places(tracer: &'a Tracer, light: &'a Light, spheres: &'a Spheres, seed: u64) -> Self {
        let scene: &Scene = tracer.scene();
        let places = spheres.places(light, scene);
        let mut media = (0..MEDIUM_PROBES).filter_map(|probe| {
            let position = places
                .sample(even_point(probe, LAMP_DIMENSION, seed))?
                .kind
                .position()?;
            Some(media_at(tracer, position))
        });
        let first = media.next().unwrap_or_default();
        let is_same = media.all(|media| media == first);
        let (low, high) = scene.bounds().unwrap_or_default();
        Self {
            domain: Domain::Spheres(Lamp {
                spheres,
                media: is_same.then_some(first),
                across_m: (high - low).length(),
                places,
                tracer,
            }),
        }
    }

    /// Whether no photon can start.
    pub fn is_empty(&self) -> bool {
        match &self.domain {
            Domain::Cells { cells, .. } => cells.is_empty(),
            Domain::Spheres(lamp) => lamp.spheres.is_empty(),
        }
    }

    /// Solid angle of the domain [sr], or its cross-section in parallel light [m²]. For an extended light, as seen from
    /// its centre.
    pub fn measure(&self) -> f64 {
        match &self.domain {
            Domain::Cells { launch, cells, .. } => {
                let side = CELLS_PER_SIDE as f64;
                let of_cell = |cell: &Cell| {
                    let low = DVec2::new(f64::from(cell.column), f64::from(cell.row)) / side;
                    launch.cell_measure(low, low + 1.0 / side)
                };
                cells.iter().map(of_cell).sum()
            }
            Domain::Spheres(lamp) => {
                let seen = |square: DVec2| {
                    let point = LampPoint::of(&lamp.places, square);
                    point.map_or(0.0, |point| lamp.spheres.measure(&point))
                };
                match seen(LAMP_MIDDLE) {
                    // The centre may face away.
                    0.0 => (0..MIDDLE_PROBES)
                        .map(|probe| seen(even_point(probe, LAMP_DIMENSION, 0)))
                        .fold(0.0, f64::max),
                    measure => measure,
                }
            }
        }
    }

    /// Mean flux of a photon [W, largest channel], estimated from a few.
    pub fn mean_flux_w(&self, seed: u64) -> f64 {
        let of = |index: u32| {
            let start = self.start(index, Self::place(index, seed), seed);
            start.map_or(0.0, |start| start.flux_w.max_channel())
        };
        (0..FLUX_PROBES).map(of).sum::<f64>() / f64::from(FLUX_PROBES)
    }

    /// A photon's place along the domain's curve, [0, 2⁶⁴).
    pub fn place(index: u32, seed: u64) -> u64 {
        even_code(index, seed)
    }

    /// Number of unit squares that make up the whole domain: faces of the launch, or squares of spheres.
    pub(super) fn root_count(&self) -> usize {
        match &self.domain {
            Domain::Cells { launch, .. } => launch.face_count(),
            Domain::Spheres(lamp) => lamp.spheres.sphere_count(),
        }
    }

    /// Cells that light is aimed at, as (root, column, row); `None` for an extended light.
    pub(super) fn marked_cells(&self) -> Option<Vec<(u32, u32, u32)>> {
        match &self.domain {
            Domain::Cells { cells, .. } => {
                let place = |cell: &Cell| (cell.face.into(), cell.column.into(), cell.row.into());
                Some(cells.iter().map(place).collect())
            }
            Domain::Spheres(_) => None,
        }
    }

    /// The launch of a light without extent, whose roots are its faces.
    pub(super) fn of_faces(&self) -> Option<&'a Launch> {
        match &self.domain {
            Domain::Cells { launch, .. } => Some(launch),
            Domain::Spheres(_) => None,
        }
    }

    /// The light that starts at a point of a root and a point of its lamp's unit square, with its flux per unit square;
    /// `None` if none does.
    pub(in crate::light_pass) fn start_at(&self, root: usize, square: DVec2, lamp: DVec2) -> Option<Start> {
        match &self.domain {
            Domain::Cells { launch, .. } => {
                let ray = launch.ray(root, square);
                Some(Start {
                    flux_w: launch.flux_density_w(square, ray.direction),
                    ray,
                    media: *launch.media(),
                })
            }
            Domain::Spheres(of) => {
                let point = LampPoint::of(&of.places, lamp)?;
                let light = of.spheres.aim_at(&point, root, square, of.across_m)?;
                Some(of.start(&point.emitter, light))
            }
        }
    }

    /// Where on its lamp a photon starts, in the lamp's unit square; the centre for light from one point or direction.
    pub(super) fn lamp_place(&self, index: u32, seed: u64) -> DVec2 {
        match &self.domain {
            Domain::Cells { .. } => LAMP_MIDDLE,
            Domain::Spheres(_) => even_point(index, LAMP_DIMENSION, seed),
        }
    }

    /// Whether the lamp, if it has a size, faces one way.
    pub fn has_offsets(&self) -> bool {
        matches!(self.domain, Domain::Cells { .. }) || self.lamp_outline().is_some()
    }

    /// Outline of a lamp that faces one way; `None` for other lights.
    pub(super) fn lamp_outline(&self) -> Option<PanelShape> {
        match &self.domain {
            Domain::Cells { .. } => None,
            Domain::Spheres(lamp) => lamp.places.outline(),
        }
    }

    /// The photon of an index at a place along the domain's curve; `None` if its point of the lamp emits nothing
    /// towards specular surfaces.
    pub fn start(&self, index: u32, place: u64, seed: u64) -> Option<Start> {
        let (launch, cells, full_w) = match &self.domain {
            Domain::Cells {
                launch,
                cells,
                full_w,
            } => (launch, cells, full_w),
            Domain::Spheres(lamp) => {
                let point = LampPoint::of(&lamp.places, self.lamp_place(index, seed))?;
                let light = lamp.spheres.aim(&point, place, lamp.across_m)?;
                return Some(lamp.start(&point.emitter, light));
            }
        };
        // All cells get equally many photons.
        let (cell, rest) = chosen(place, cells.len());
        let cell = cells.get(cell)?;
        let side = CELLS_PER_SIDE as f64;
        let square = (DVec2::new(f64::from(cell.column), f64::from(cell.row)) + in_square(rest)) / side;
        let ray = launch.ray(usize::from(cell.face), square);
        let flux_w = match full_w {
            Some(full_w) => *full_w * launch.emitter().kind.falloff(ray.direction),
            None => launch.flux_density_w(square, ray.direction) * cell_share(cells.len()),
        };
        Some(Start {
            ray,
            flux_w,
            media: *launch.media(),
        })
    }
}

impl Lamp<'_> {
    /// The photon of a ray, which represents a measure [sr or m²].
    fn start(&self, emitter: &Emitter, (ray, measure): (Ray, f64)) -> Start {
        let media = match (self.media, emitter.kind.position()) {
            (Some(media), _) => media,
            (None, Some(_)) => media_at(self.tracer, ray.origin),
            (None, None) => MediumStack::default(),
        };
        Start {
            flux_w: emitter.strength * (emitter.kind.falloff(ray.direction) * measure),
            ray,
            media,
        }
    }
}

/// Fraction of a face that this number of cells covers.
fn cell_share(cells: usize) -> f64 {
    cells as f64 / (CELLS_PER_SIDE * CELLS_PER_SIDE) as f64
}

fn full_w(launch: &Launch, cells: usize) -> Option<LinearSrgb> {
    let measure = launch.cell_measure(DVec2::ZERO, DVec2::ONE) * cell_share(cells);
    let is_even = launch.is_fitted() || launch.mapping() != FaceMapping::Plain;
    is_even.then(|| launch.emitter().strength * measure)
}

/// Which of `parts` equal parts of the curve a place lies in, and where in that part, [0, 2⁶⁴).
fn chosen(place: u64, parts: usize) -> (usize, u64) {
    let product = u128::from(place) * parts as u128;
    ((product >> 64) as usize, product as u64)
}
