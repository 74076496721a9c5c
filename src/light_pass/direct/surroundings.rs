//! The medium that a lamp lies in. Direct light crosses no surface, and so stays within it.

use glam::DVec3;

use crate::optics::LinearSrgb;
use crate::scene::{Scene, Volume};
use crate::transport::{Tracer, media_at};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumAround {
    /// Refractive index [1].
    pub ior: f64,
    volume: Option<Volume>,
}

impl MediumAround {
    pub const VACUUM: Self = Self {
        ior: 1.0,
        volume: None,
    };

    pub fn at(tracer: &Tracer, point: DVec3) -> Self {
        let (scene, media): (&Scene, _) = (tracer.scene(), media_at(tracer, point));
        Self {
            ior: media.ior(scene),
            volume: media.top().and_then(|object| scene.material_of(object).volume),
        }
    }

    pub fn transmittance(&self, distance_m: f64) -> LinearSrgb {
        self.volume
            .map_or(LinearSrgb::WHITE, |volume| volume.transmittance(distance_m))
    }
}
