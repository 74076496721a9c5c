//! Marks the cells of an item buffer, and finds those whose casters are occluded.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::bits::CellBits;
use super::hidden::{Hidden, HiddenCells};
use super::search::{Bounds, Search};
use crate::light_pass::launch::Launch;
use crate::transport::{SceneNode, Tracer};

/// Triangles of an object that are tested before the hierarchy is searched for one that the light sees.
const TRIED_FIRST: usize = 16;

/// Inputs of marking.
pub(super) struct Builder<'a> {
    pub(super) launch: &'a Launch,
    pub(super) tracer: &'a Tracer,
    /// Box of each object; `None` if it has no vertices.
    pub(super) bounds: &'a [Option<Bounds>],
    /// Boxes of the wanted objects.
    pub(super) boxes: Vec<Bounds>,
    /// Whether an object is a caster.
    pub(super) wanted: &'a [bool],
    pub(super) tests: AtomicU64,
}

impl Builder<'_> {
    fn roots(&self) -> Vec<SceneNode<'_>> {
        self.tracer.roots()
    }

    fn count(&self, tests: u64) {
        // A sum: the order does not matter.
        self.tests.fetch_add(tests, Ordering::Relaxed);
    }

    /// Whether any of the visible cells sees an object.
    pub(super) fn sees(&self, object: usize, bounds: Bounds, visible: &[CellBits]) -> bool {
        let wanted = |other: usize| other == object;
        let bounds = [bounds];
        let mesh = self.tracer.scene().objects[object].in_scene();
        visible.iter().enumerate().any(|(face, visible)| {
            let search = Search::new(self.launch, face, &bounds, &[], &wanted);
            let first = 0..mesh.triangle_count().min(TRIED_FIRST);
            let at_once = first
                .into_iter()
                .any(|triangle| search.touches(&mesh.corners(triangle), visible));
            let seen = at_once || search.finds(self.roots(), visible);
            self.count(search.tests());
            seen
        })
    }

    /// The lit cells of each face that a triangle of a wanted object touches. `others`: boxes of all other objects.
    pub(super) fn mark(&self, lit: &[CellBits], others: &[Bounds]) -> Vec<CellBits> {
        let wanted = |object: usize| self.wanted[object];
        let mark = |(face, lit): (usize, &CellBits)| {
            let mut open = lit.clone();
            let search = Search::new(self.launch, face, &self.boxes, others, &wanted);
            let objects = self.tracer.scene().objects.iter().zip(self.wanted);
            for (object, _) in objects.filter(|(_, wanted)| **wanted) {
                search.close_some(object.in_scene(), &mut open);
            }
            search.close(self.roots(), &mut open);
            self.count(search.tests());
            lit.without(&open)
        };
        lit.par_iter().enumerate().map(mark).collect()
    }

    /// By face: the cells in which something may be hidden, and what is hidden. Empty if nothing can be.
    pub(super) fn hidden(&self, faces: &[CellBits]) -> Vec<(CellBits, Hidden)> {
        // Only opaque triangles in front of a caster can hide it.
        let hiders = self.hiders();
        if hiders.is_empty() {
            return Vec::new();
        }
        let wanted = |object: usize| self.wanted[object];
        let find = |(face, marked): (usize, &CellBits)| {
            let mut cells = HiddenCells::new(self.launch, face);
            let mut tests = 0;
            let search = Search::new(self.launch, face, &self.boxes, &[], &wanted);

            // Opaque faces make the cells that they touch doubtful. Faces of casters come last: they cover cells too,
            // but make none doubtful, as light goes on from them.
            let is_any_marked = marked.count() > 0;
            let is_near = |bounds: Bounds| is_any_marked && search.may_touch(bounds, marked);
            let are_near: Vec<bool> = self
                .bounds
                .iter()
                .map(|bounds| bounds.is_some_and(is_near))
                .collect();
            for &(object, triangle) in hiders.iter().filter(|(object, _)| are_near[*object]) {
                let mesh = self.tracer.scene().objects[object].in_scene();
                let marked = (!self.wanted[object]).then_some(marked);
                tests += cells.add_opaque(object, &mesh.corners(triangle), marked);
            }

            // Casters are compared with these faces only in doubtful cells: elsewhere nothing can hide them.
            let doubtful = cells.doubtful().clone();
            search.visit(self.roots(), &doubtful, |object, corners| {
                tests += cells.add_caster(object, corners);
                false
            });
            self.count(tests + search.tests());
            let found = cells.find();
            (doubtful, found)
        };
        faces.par_iter().enumerate().map(find).collect()
    }

    /// Large opaque triangles, with their objects, that have part of a caster's box behind their plane as seen from the
    /// light: no others can hide a caster. Largest first, but those of casters last; empty if there are only those.
    fn hiders(&self) -> Vec<(usize, usize)> {
        let scene = self.tracer.scene();
        let large = self.tracer.largest_opaque();
        self.count(large.len() as u64);
        let may_hide = |&(object, triangle): &(usize, usize)| {
            let mesh = scene.objects[object].in_scene();
            let (corner, normal) = (mesh.corners(triangle)[0], mesh.face_normal(triangle));
            let side = self.launch.side_of_light(corner, normal);
            let has_behind = |(low, high): &Bounds| {
                let height = ((*low + *high) * 0.5 - corner).dot(normal);
                let reach = ((*high - *low) * 0.5).dot(normal.abs());
                side * height - reach < 0.0
            };
            !self.is_the_only_caster(object) && self.boxes.iter().any(has_behind)
        };
        let hiders = large.iter().copied().filter(may_hide);
        let (of_casters, mut hiders): (Vec<_>, Vec<_>) = hiders.partition(|(object, _)| self.wanted[*object]);
        if !hiders.is_empty() {
            hiders.extend(of_casters);
        }
        hiders
    }

    /// An object does not hide itself.
    fn is_the_only_caster(&self, object: usize) -> bool {
        self.wanted[object] && self.wanted.iter().filter(|wanted| **wanted).count() == 1
    }
}
