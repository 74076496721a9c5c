//! Where photons start: aimed at what is specular, and stratified as finely as there are photons.
//!
//! A photon's index, scrambled, is a place along a curve through the whole launch domain (Morton's, cell by cell of the
//! item buffer). The first n indices divide the curve into n strata with one photon each, for every power of two; more of
//! them fill the gaps, so that no photon is ever traced in vain (Owen, "Scrambled Net Variance", 1997).

use glam::{DVec2, DVec3};

use crate::geometry::Ray;
use crate::geometry::cube_face::FaceMapping;
use crate::geometry::sampling::{even_code, even_point};
use crate::light_pass::caustic::setup::AimedLight;
use crate::light_pass::item_buffer::CELLS_PER_SIDE;
use crate::light_pass::launch::Launch;
use crate::optics::LinearSrgb;
use crate::scene::emitter::{Emitter, EmitterKind, Places, in_cap, on_disc};
use crate::scene::{Light, Scene};
use crate::transport::{MediumStack, Tracer, media_at};

/// Spheres that a light with a size aims at, at most.
const MAX_SPHERES: usize = 16;

/// Places of a lamp that tell whether it lies within one medium.
const MEDIUM_PROBES: u32 = 16;

/// Photons that tell their mean flux.
const FLUX_PROBES: u32 = 1 << 12;

/// Dimension of [`even_point`] that places on lamps are drawn from; those of micro-normals follow.
pub(super) const LAMP_DIMENSION: u32 = 0;

/// A photon at its light.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Its first segment.
    pub ray: Ray,
    /// Flux [W per channel of a light of unit strength] that it stands for if it were the only photon.
    pub flux_w: LinearSrgb,
    /// Bodies around its origin.
    pub media: MediumStack,
}

/// The launch domain of one light.
#[derive(Debug)]
pub struct PhotonLaunch<'a> {
    domain: Domain<'a>,
}

#[derive(Debug)]
enum Domain<'a> {
    /// Light of one place or direction: the marked cells of its item buffer.
    Cells {
        launch: &'a Launch,
        cells: Vec<Cell>,
        /// Flux [W per channel] of a photon in a direction of full strength; `None` where that depends on its place.
        full_w: Option<LinearSrgb>,
    },
    /// Light of many: spheres around what is specular, as each place sees them.
    Spheres {
        places: Places<'a>,
        tracer: &'a Tracer,
        spheres: Vec<Sphere>,
        /// Around all places; `None` where they lie in different media.
        media: Option<MediumStack>,
        /// Reaches across the whole scene [m].
        across_m: f64,
    },
}

/// A cell of the item buffer.
#[derive(Clone, Copy, Debug)]
struct Cell {
    face: u8,
    column: u8,
    row: u8,
}

#[derive(Clone, Copy, Debug)]
struct Sphere {
    centre: DVec3,
    radius_m: f64,
}

impl<'a> PhotonLaunch<'a> {
    /// The domain of a light as its item buffer sees it.
    pub fn of_cells(aimed: &'a AimedLight) -> Self {
        let side = CELLS_PER_SIDE;
        let marked = |face: usize| {
            let on_curve = (0..side * side).map(|place| {
                let [column, row] = unfolded(place as u64);
                (column as usize, row as usize)
            });
            on_curve.filter(move |&(column, row)| aimed.item_buffer.is_marked(face, column, row))
        };
        let on_face = |face: usize| {
            marked(face).map(move |(column, row)| Cell {
                face: face as u8,
                column: column as u8,
                row: row as u8,
            })
        };
        let cells: Vec<Cell> = (0..aimed.launch.face_count()).flat_map(on_face).collect();
        Self {
            domain: Domain::Cells {
                full_w: full_w(&aimed.launch, cells.len()),
                launch: &aimed.launch,
                cells,
            },
        }
    }

    /// The domain of a light with a size; `light` is of unit strength.
    pub fn of_places(tracer: &'a Tracer, light: &'a Light, casters: &[usize], seed: u64) -> Self {
        let scene: &Scene = tracer.scene();
        let places = Places::new(light, scene);
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
            domain: Domain::Spheres {
                spheres: spheres(scene, casters, MAX_SPHERES),
                media: is_same.then_some(first),
                across_m: (high - low).length(),
                places,
                tracer,
            },
        }
    }

    /// Whether no photon could start.
    pub fn is_empty(&self) -> bool {
        match &self.domain {
            Domain::Cells { cells, .. } => cells.is_empty(),
            Domain::Spheres { spheres, .. } => spheres.is_empty(),
        }
    }

    /// Solid angle [sr] of the domain, or its area [m²] of parallel light; of a light with a size as its middle place sees
    /// it.
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
            Domain::Spheres { places, spheres, .. } => {
                let Some(emitter) = places.sample(DVec2::splat(0.5)) else {
                    return 0.0;
                };
                spheres.iter().map(|sphere| sphere.measure(&emitter)).sum()
            }
        }
    }

    /// Mean flux of a photon [W, largest channel], by some of them.
    pub fn mean_flux_w(&self, seed: u64) -> f64 {
        let of = |index: u32| {
            let start = self.start(index, Self::place(index, seed), seed);
            start.map_or(0.0, |start| start.flux_w.max_channel())
        };
        (0..FLUX_PROBES).map(of).sum::<f64>() / f64::from(FLUX_PROBES)
    }

    /// Place along the domain's curve of a photon, [0, 2⁶⁴).
    pub fn place(index: u32, seed: u64) -> u64 {
        even_code(index, seed)
    }

    /// The photon of an index at a place along the domain's curve; `None` where its place of the lamp sends nothing to
    /// anything specular.
    pub fn start(&self, index: u32, place: u64, seed: u64) -> Option<Start> {
        match &self.domain {
            Domain::Cells {
                launch,
                cells,
                full_w,
            } => {
                let (cell, rest) = chosen(place, cells.len());
                let cell = cells[cell];
                let within = in_square(rest);
                let side = CELLS_PER_SIDE as f64;
                let square = (DVec2::new(f64::from(cell.column), f64::from(cell.row)) + within) / side;
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
            Domain::Spheres {
                places,
                tracer,
                spheres,
                media,
                across_m,
            } => {
                let emitter = places.sample(even_point(index, LAMP_DIMENSION, seed))?;
                let (ray, measure) = aimed(&emitter, spheres, place, *across_m)?;
                let media = match (media, emitter.kind.position()) {
                    (Some(media), _) => *media,
                    (None, Some(position)) => media_at(tracer, position),
                    (None, None) => MediumStack::default(),
                };
                Some(Start {
                    flux_w: emitter.strength * (emitter.kind.falloff(ray.direction) * measure),
                    ray,
                    media,
                })
            }
        }
    }
}

/// So many cells' part of a face.
fn cell_share(cells: usize) -> f64 {
    cells as f64 / (CELLS_PER_SIDE * CELLS_PER_SIDE) as f64
}

fn full_w(launch: &Launch, cells: usize) -> Option<LinearSrgb> {
    let measure = launch.cell_measure(DVec2::ZERO, DVec2::ONE) * cell_share(cells);
    let is_even = launch.is_fitted() || launch.mapping() != FaceMapping::Plain;
    is_even.then(|| launch.emitter().strength * measure)
}

/// Which of so many equal parts of the curve a place lies in, and where in it.
fn chosen(place: u64, parts: usize) -> (usize, u64) {
    let product = u128::from(place) * parts as u128;
    ((product >> 64) as usize, product as u64)
}

/// Column and row of a place along Morton's curve: its odd and its even bits.
fn unfolded(place: u64) -> [u32; 2] {
    let every_second = |code: u64| {
        let mut code = code & 0x5555_5555_5555_5555;
        for (shift, mask) in [
            (1, 0x3333_3333_3333_3333),
            (2, 0x0f0f_0f0f_0f0f_0f0f),
            (4, 0x00ff_00ff_00ff_00ff),
            (8, 0x0000_ffff_0000_ffff),
            (16, 0x0000_0000_ffff_ffff),
        ] {
            code = (code | code >> shift) & mask;
        }
        code as u32
    };
    [every_second(place), every_second(place >> 1)]
}

/// The same as a point of the unit square.
fn in_square(place: u64) -> DVec2 {
    DVec2::from(unfolded(place).map(|code| (f64::from(code) + 0.5) * (-32_f64).exp2()))
}

impl Sphere {
    /// Solid angle [sr] that a place sends light into towards it, or its cross-section [m²] in parallel light.
    fn measure(&self, emitter: &Emitter) -> f64 {
        let Some(position) = emitter.kind.position() else {
            return std::f64::consts::PI * self.radius_m * self.radius_m;
        };
        let towards = self.centre - position;
        if let EmitterKind::Facet { normal, .. } = emitter.kind
            && towards.dot(normal) < -self.radius_m
        {
            return 0.0;
        }
        let half_angle_rad = self.half_angle_rad(position);
        if let EmitterKind::Spot {
            direction,
            outer_cone_rad,
            ..
        } = emitter.kind
            && towards.angle_between(direction) > half_angle_rad + outer_cone_rad
        {
            return 0.0;
        }
        cap_sr(half_angle_rad)
    }

    /// Half-angle [rad] of the cone around it; π from within.
    fn half_angle_rad(&self, position: DVec3) -> f64 {
        let distance_m = position.distance(self.centre);
        if distance_m > self.radius_m {
            (self.radius_m / distance_m).asin()
        } else {
            std::f64::consts::PI
        }
    }

    /// Whether a ray of an emitter may have been aimed at it.
    fn has(&self, ray: &Ray, emitter: &Emitter) -> bool {
        let Some(position) = emitter.kind.position() else {
            let towards = self.centre - ray.origin;
            let beside = towards - ray.direction * towards.dot(ray.direction);
            return beside.length_squared() <= self.radius_m * self.radius_m;
        };
        let towards = self.centre - position;
        let along = towards.dot(ray.direction);
        let distance2 = towards.length_squared();
        let radius2 = self.radius_m * self.radius_m;
        distance2 <= radius2 || (along > 0.0 && distance2 - along * along <= radius2)
    }
}

/// Solid angle of a cone [sr].
fn cap_sr(half_angle_rad: f64) -> f64 {
    4.0 * std::f64::consts::PI * (0.5 * half_angle_rad).sin().powi(2)
}

/// A ray of a place of a lamp towards one of the spheres, and the measure [sr or m²] that it stands for. A direction that
/// several spheres could have been given counts once: by how many that could.
fn aimed(emitter: &Emitter, spheres: &[Sphere], place: u64, across_m: f64) -> Option<(Ray, f64)> {
    let mut measures = [0.0; MAX_SPHERES];
    for (measure, sphere) in measures.iter_mut().zip(spheres) {
        *measure = sphere.measure(emitter);
    }
    let total: f64 = measures.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mut left = place as f64 * (-64_f64).exp2() * total;
    let mut which = 0;
    while which + 1 < spheres.len() && left >= measures[which] {
        left -= measures[which];
        which += 1;
    }
    while measures[which] <= 0.0 {
        which = which.checked_sub(1)?;
    }
    let share = (left / measures[which]).clamp(0.0, 1.0 - f64::EPSILON);
    let rest = (share * 64_f64.exp2()) as u64;
    let square = in_square(rest);
    let sphere = spheres[which];
    let ray = match emitter.kind {
        EmitterKind::Parallel { direction } => {
            let (x, y) = direction.any_orthonormal_pair();
            let offset = on_disc(square) * sphere.radius_m;
            Ray {
                origin: sphere.centre + x * offset.x + y * offset.y - direction * across_m,
                direction,
            }
        }
        EmitterKind::Point { position }
        | EmitterKind::Spot { position, .. }
        | EmitterKind::Facet { position, .. } => {
            let axis = (sphere.centre - position).normalize_or(DVec3::Z);
            Ray {
                origin: position,
                direction: in_cap(axis, sphere.half_angle_rad(position), square),
            }
        }
    };
    let owners = spheres
        .iter()
        .zip(measures)
        .filter(|(sphere, measure)| *measure > 0.0 && sphere.has(&ray, emitter))
        .count()
        .max(1);
    Some((ray, total / owners as f64))
}

/// Spheres around objects: around each, or around groups of neighbours where there are more than `most`.
fn spheres(scene: &Scene, objects: &[usize], most: usize) -> Vec<Sphere> {
    let mut bounded: Vec<(usize, DVec3)> = objects
        .iter()
        .filter_map(|&object| {
            let (low, high) = scene.objects[object].mesh.bounds()?;
            Some((object, low * 0.5 + high * 0.5))
        })
        .collect();
    let mut found = Vec::new();
    divide(scene, &mut bounded, most, &mut found);
    found
}

fn divide(scene: &Scene, objects: &mut [(usize, DVec3)], most: usize, found: &mut Vec<Sphere>) {
    if objects.is_empty() {
        return;
    }
    if objects.len() == 1 || most <= 1 {
        found.extend(around(scene, objects));
        return;
    }
    let centres = || objects.iter().map(|(_, centre)| *centre);
    let low = centres().fold(DVec3::INFINITY, DVec3::min);
    let high = centres().fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (high - low).max_position();
    objects.sort_by(|a, b| a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0)));
    let (first, second) = objects.split_at_mut(objects.len() / 2);
    divide(scene, first, most / 2, found);
    divide(scene, second, most - most / 2, found);
}

fn around(scene: &Scene, objects: &[(usize, DVec3)]) -> Option<Sphere> {
    let vertices = || {
        objects
            .iter()
            .flat_map(|(object, _)| &scene.objects[*object].mesh.positions)
    };
    let low = vertices().fold(DVec3::INFINITY, |low, position| low.min(*position));
    let high = vertices().fold(DVec3::NEG_INFINITY, |high, position| high.max(*position));
    let centre = low * 0.5 + high * 0.5;
    let radius_m = vertices()
        .map(|position| position.distance(centre))
        .fold(0.0, f64::max);
    // A hair more, so that rounding loses nothing at the rim.
    (radius_m > 0.0 && radius_m.is_finite()).then_some(Sphere {
        centre,
        radius_m: radius_m * (1.0 + 1e-9),
    })
}
