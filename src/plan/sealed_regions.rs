//! Regions of the scene that opaque closed surfaces separate.

use glam::DVec3;

use crate::geometry::enclosure::{Bounds, is_closed, triangle_meets_box, winding_number};
use crate::scene::{InScene, Light, LightKind, LightSize, Mesh, Scene};

/// Larger meshes are not tested and seal nothing.
const MAX_TRIANGLES: usize = 200_000;

/// Tolerance within which a winding number counts as an integer.
const WINDING_TOLERANCE: f64 = 1e-6;

/// Opaque closed objects around something, in ascending order; `None` if that is undecidable.
type EnclosedBy = Option<Vec<usize>>;

/// The opaque closed objects around each object and each light.
#[derive(Debug)]
pub(super) struct Compartments {
    objects: Vec<EnclosedBy>,
    lights: Vec<EnclosedBy>,
    /// Whether the object itself is such a surface: it borders both its outside and its inside.
    encloses: Vec<bool>,
}

impl Compartments {
    pub(super) fn of(scene: &Scene) -> Self {
        // Boxes rule out most pairs of a container and its contents before any triangle is tested.
        let bounds: Vec<Option<Bounds>> = scene.objects.iter().map(|object| object.bounds()).collect();
        let mut compartments = Self {
            objects: vec![Some(Vec::new()); scene.objects.len()],
            lights: vec![Some(Vec::new()); scene.lights.len()],
            encloses: vec![false; scene.objects.len()],
        };
        for (container, object) in scene.objects.iter().enumerate() {
            let Some(around) = bounds[container].filter(|_| scene.material_of(container).is_opaque()) else {
                continue;
            };
            // An object that intersects such a surface is on both sides of it.
            let near: Vec<(usize, Bounds)> = bounds
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != container)
                .filter_map(|(other, bounds)| Some((other, bounds.filter(|other| overlap(around, *other))?)))
                .collect();
            let lamps: Vec<(usize, Bounds)> = scene
                .lights
                .iter()
                .enumerate()
                .filter_map(|(light, source)| Some((light, extent(source, &bounds)?)))
                .filter(|(_, place)| overlap(around, *place))
                .collect();

            // Only a watertight mesh has an inside. Tests of large ones would take longer than the rays that they save.
            let mesh = object.mesh();
            if (near.is_empty() && lamps.is_empty()) || mesh.triangles.len() > MAX_TRIANGLES {
                continue;
            }
            let mesh = &*object.copy_in_scene();
            if !is_closed(&mesh.positions, &mesh.triangles) {
                continue;
            }

            // Winding numbers tell which side of the surface each object and light is on.
            compartments.encloses[container] = true;
            for (other, bounds) in near {
                // Bounding boxes often overlap where surfaces do not.
                if enters(scene.objects[other].in_scene(), around) {
                    book(
                        &mut compartments.objects[other],
                        container,
                        is_inside(mesh, bounds),
                    );
                }
            }
            for (light, place) in lamps {
                book(&mut compartments.lights[light], container, is_inside(mesh, place));
            }
        }
        compartments
    }

    /// Whether light from a light may reach an object.
    pub(super) fn light_meets(&self, light: usize, object: usize) -> bool {
        self.borders(object, &self.lights[light])
    }

    /// Whether light may travel from one object to another.
    pub(super) fn share(&self, from: usize, to: usize) -> bool {
        let Some(own) = &self.objects[from] else {
            return true;
        };
        let inner = self.encloses[from].then(|| Some(with(own, from)));
        self.borders(to, &self.objects[from]) || inner.is_some_and(|inner| self.borders(to, &inner))
    }

    /// Whether an object borders the space enclosed by `around`.
    fn borders(&self, object: usize, around: &EnclosedBy) -> bool {
        let (Some(own), Some(around)) = (&self.objects[object], around) else {
            return true;
        };
        own == around || (self.encloses[object] && with(own, object) == *around)
    }
}

/// Bounding box of a light; `None` for lights at infinity, which are outside of everything.
fn extent(light: &Light, objects: &[Option<Bounds>]) -> Option<Bounds> {
    match light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
            let reach = match light.size {
                LightSize::Radius { radius_m } => DVec3::splat(radius_m),
                _ => DVec3::ZERO,
            };
            Some((position - reach, position + reach))
        }
        LightKind::Panel {
            centre, across, down, ..
        } => {
            let reach = across.abs() + down.abs();
            Some((centre - reach, centre + reach))
        }
        LightKind::Surface { object, .. } => objects.get(object).copied().flatten(),
        LightKind::Sun { .. } | LightKind::Environment { .. } => None,
    }
}

fn overlap((low, high): Bounds, (from, to): Bounds) -> bool {
    low.cmple(to).all() && high.cmpge(from).all()
}

/// Whether any part of a mesh lies in a box; assumed for large meshes.
fn enters(mesh: InScene, bounds: Bounds) -> bool {
    mesh.triangle_count() > MAX_TRIANGLES
        || (0..mesh.triangle_count()).any(|triangle| triangle_meets_box(mesh.corners(triangle), bounds))
}

/// Whether a box lies entirely inside a closed mesh; `None` if the mesh intersects it or comes too close.
fn is_inside(mesh: &Mesh, (low, high): Bounds) -> Option<bool> {
    let corners = || (0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle));
    // Exceeds rounding, so that surfaces that touch the box count as intersecting it.
    let margin = DVec3::splat(1e-9 * (high.abs().max(low.abs()).max_element() + (high - low).length()));
    let widened = (low - margin, high + margin);
    if corners().any(|corners| triangle_meets_box(corners, widened)) {
        return None;
    }
    let winding = winding_number(corners(), low * 0.5 + high * 0.5).abs();
    let whole = winding.round();
    ((winding - whole).abs() < WINDING_TOLERANCE).then_some(whole == 1.0)
}

/// Adds a container to those around something.
fn book(around: &mut EnclosedBy, container: usize, is_inside: Option<bool>) {
    match (around.as_mut(), is_inside) {
        (Some(list), Some(true)) => list.push(container),
        (_, None) => *around = None,
        _ => {}
    }
}

/// A copy with one more container, in order.
fn with(around: &[usize], container: usize) -> Vec<usize> {
    let place = around.partition_point(|&other| other < container);
    let mut all = around.to_vec();
    all.insert(place, container);
    all
}
