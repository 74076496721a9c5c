//! The scene by wavelength, for chains that meet glass which parts light.

use crate::eye_pass::wavelengths::{self, SeenWavelength};
use crate::scene::SurfaceKind;
use crate::transport::{MediumStack, SurfaceHit, Tracer};

/// The scene as light of one wavelength meets it.
#[derive(Debug)]
pub struct SceneAtWavelength {
    /// What the eye sees of that wavelength.
    pub seen: SeenWavelength,
    /// With the indices of that wavelength.
    pub tracer: Tracer,
}

/// The wavelengths of one sample; none where nothing is to be parted.
#[derive(Debug, Default)]
pub struct SpectralScene {
    /// Together they are all light.
    pub wavelengths: Vec<SceneAtWavelength>,
}

impl SpectralScene {
    /// For each of a pixel's samples `count` wavelengths, shifted from sample to sample; none in scenes where all
    /// light goes the same ways.
    pub fn of_samples(tracer: &Tracer, count: u32, samples: u32) -> Vec<Self> {
        let is_parting = tracer.scene().parts_wavelengths() && count > 0;
        let sample = |index: u32| {
            if !is_parting {
                return Self::default();
            }
            let bands = wavelengths::bands(count, wavelengths::shift_of_sample(index));
            let at = |seen: SeenWavelength| SceneAtWavelength {
                tracer: tracer.with_indices_at(seen.wavelength),
                seen,
            };
            Self {
                wavelengths: bands.into_iter().map(at).collect(),
            }
        };
        (0..samples).map(sample).collect()
    }

    /// Whether light goes on from a surface another way at another wavelength, or another part of it does.
    pub fn parts(&self, tracer: &Tracer, hit: &SurfaceHit, media: &MediumStack) -> bool {
        let scene = tracer.scene();
        let is_dispersive = |object: usize| scene.material_of(object).is_dispersive();
        let goes_by_index = match scene.material_of(hit.object).surface {
            SurfaceKind::Dielectric | SurfaceKind::ThinWall | SurfaceKind::Mixed => true,
            SurfaceKind::Diffuse | SurfaceKind::Mirror => false,
        };
        !self.wavelengths.is_empty()
            && goes_by_index
            && (is_dispersive(hit.object)
                || media
                    .objects()
                    .iter()
                    .any(|object| is_dispersive(*object as usize)))
    }
}
