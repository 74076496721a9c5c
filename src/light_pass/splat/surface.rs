//! How the triangle of an arrival lies in its map, kept from arrival to arrival.

use glam::DVec2;

use super::footprint::TexelFromWorld;
use crate::illumination::Receiver;
use crate::light_pass::path::Arrival;
use crate::light_pass::receiver_maps::{ReceiverMap, ReceiverMaps};
use crate::scene::Scene;

/// A triangle in its map.
#[derive(Clone, Debug)]
pub(super) struct Surface<'a> {
    pub(super) map: &'a ReceiverMap,
    /// Map coordinates of the corners.
    uvs: [DVec2; 3],
    /// Texels across and down.
    size: DVec2,
    pub(super) texel_from_world: TexelFromWorld,
    pub(super) texels_per_m2: f64,
}

impl<'a> Surface<'a> {
    /// `None` without a map, and for a degenerate triangle.
    fn new(scene: &Scene, maps: &'a ReceiverMaps, arrival: &Arrival) -> Option<Self> {
        let triangle = arrival.triangle as usize;
        let map = maps.get(arrival.receiver)?;
        let corners = scene.objects[arrival.receiver.object()]
            .mesh_in_scene()
            .corners(triangle);
        let texel_from_world = map.chart.texel_from_world(triangle, corners)?;
        Some(Self {
            map,
            uvs: map.chart.corner_uvs[triangle],
            size: DVec2::new(map.chart.width as f64, map.chart.height as f64),
            texel_from_world,
            texels_per_m2: texel_from_world[0].cross(texel_from_world[1]).length(),
        })
    }

    /// Texel coordinates of an arrival on the triangle.
    pub(super) fn centre(&self, arrival: &Arrival) -> DVec2 {
        let [a, b, c] = self.uvs;
        let DVec2 { x: wb, y: wc } = arrival.barycentric;
        let uv = a * (1.0 - wb - wc) + b * wb + c * wc;
        (uv * self.size).clamp(DVec2::ZERO, self.size)
    }
}

/// Receiver and triangle.
type Key = (Receiver, u32);

/// Cache of the last triangles: neighbouring rays mostly arrive on the same ones.
pub(super) struct Surfaces<'a> {
    scene: &'a Scene,
    maps: &'a ReceiverMaps,
    slots: [Option<(Key, Option<Surface<'a>>)>; SLOTS],
}

const SLOTS: usize = 8;

impl<'a> Surfaces<'a> {
    pub(super) fn new(scene: &'a Scene, maps: &'a ReceiverMaps) -> Self {
        Self {
            scene,
            maps,
            slots: [const { None }; SLOTS],
        }
    }

    /// The triangle of an arrival; `None` where nothing can be deposited.
    pub(super) fn of(&mut self, arrival: &Arrival) -> Option<&Surface<'a>> {
        let key = (arrival.receiver, arrival.triangle);
        let slot = &mut self.slots[arrival.triangle as usize % SLOTS];
        if slot.as_ref().is_none_or(|(held, _)| *held != key) {
            *slot = Some((key, Surface::new(self.scene, self.maps, arrival)));
        }
        slot.as_ref()?.1.as_ref()
    }
}
