//! The same scene in another way.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use nephroid::scene::{LightKind, LightSize, Scene};
use nephroid::units::{Irradiance, Radiance, RadiantIntensity};

/// All lights so many times as strong.
pub fn brightened(mut scene: Scene, factor: f64) -> Scene {
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => {
                *intensity = RadiantIntensity(intensity.0 * factor);
            }
            LightKind::Sun {
                normal_irradiance, ..
            } => *normal_irradiance = Irradiance(normal_irradiance.0 * factor),
            LightKind::Panel { radiance, .. } | LightKind::Surface { radiance, .. } => {
                *radiance = Radiance(radiance.0 * factor);
            }
            LightKind::Environment { scale } => *scale *= factor,
        }
    }
    scene
}

/// Turned about the origin, then moved [m].
pub fn moved(scene: Scene, turn: DQuat, offset: DVec3) -> Scene {
    placed(scene, |p| turn * p + offset, |d| turn * d)
}

/// Seen in a mirror at x = 0: triangles stay wound counter-clockwise about their outside.
pub fn mirrored(scene: Scene) -> Scene {
    let flip = DVec3::new(-1.0, 1.0, 1.0);
    let mut scene = placed(scene, |p| p * flip, |d| d * flip);
    for object in &mut scene.objects {
        for triangle in &mut Arc::make_mut(&mut object.mesh).triangles {
            triangle.swap(1, 2);
        }
    }
    for light in &mut scene.lights {
        if let LightKind::Panel { across, down, .. } = &mut light.kind {
            std::mem::swap(across, down);
        }
    }
    scene
}

/// So many times as large, with everything that is a length.
pub fn scaled(scene: Scene, factor: f64) -> Scene {
    let mut scene = placed(scene, |p| p * factor, |d| d);
    for light in &mut scene.lights {
        if let LightKind::Panel { across, down, .. } = &mut light.kind {
            *across *= factor;
            *down *= factor;
        }
        if let LightSize::Radius { radius_m } = &mut light.size {
            *radius_m *= factor;
        }
    }
    for material in &mut scene.materials {
        if let Some(volume) = &mut material.volume {
            volume.attenuation_distance_m *= factor;
        }
    }
    scene
}

/// What irradiance is multiplied by in a scene of one light that is so many times as large: a given intensity [W/sr]
/// thins out, a given irradiance or radiance does not.
pub fn thinned(scene: &Scene, factor: f64) -> f64 {
    match scene.lights[0].kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => 1.0 / (factor * factor),
        _ => 1.0,
    }
}

/// The last object first.
pub fn reordered(mut scene: Scene) -> Scene {
    scene.objects.reverse();
    scene
}

fn placed(mut scene: Scene, place: impl Fn(DVec3) -> DVec3, direct: impl Fn(DVec3) -> DVec3) -> Scene {
    for object in &mut scene.objects {
        let mesh = Arc::make_mut(&mut object.mesh);
        mesh.positions.iter_mut().for_each(|p| *p = place(*p));
        mesh.normals.iter_mut().for_each(|n| *n = direct(*n));
    }
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } => *position = place(*position),
            LightKind::Spot {
                position, direction, ..
            } => {
                *position = place(*position);
                *direction = direct(*direction);
            }
            LightKind::Sun { direction, .. } => *direction = direct(*direction),
            LightKind::Panel {
                centre, across, down, ..
            } => {
                *centre = place(*centre);
                *across = direct(*across);
                *down = direct(*down);
            }
            LightKind::Surface { .. } | LightKind::Environment { .. } => {}
        }
    }
    scene
}
