//! What cases are made of. Metres, watts, y up.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::scene::builtin::{parts, shapes};
use crate::scene::{LightKind, Mesh, Scene};
use crate::settings::{BakeSettings, MapResolution};
use crate::units::{Flux, Irradiance};

/// A point light of 1 W/sr.
pub const ONE_W_PER_SR: Flux = Flux(4.0 * PI);

/// Exactly that lattice [rays/sr], maps of `side` texels each way.
pub fn at(density_per_sr: f64, side: usize) -> BakeSettings {
    BakeSettings {
        density_per_sr,
        map_resolution: MapResolution::Fixed {
            width: side,
            height: side,
        },
        ..BakeSettings::default()
    }
}

/// The same, following every branch that carries a 1e-9th.
pub fn thoroughly(density_per_sr: f64, side: usize) -> BakeSettings {
    BakeSettings {
        branch_threshold: Some(1e-9),
        max_depth: 1000,
        ..at(density_per_sr, side)
    }
}

/// A lamp of 1 W/sr.
pub fn lamp(scene: &mut Scene, position: DVec3) {
    scene
        .lights
        .push(parts::point_light("lamp", position, ONE_W_PER_SR));
}

/// A sun of 1 W/m² across its beam.
pub fn sun(scene: &mut Scene, direction: DVec3) {
    scene.lights.push(parts::sun("sun", direction, Irradiance(1.0)));
}

/// A floor of 1 × 1 m below a horizontal slab of glass that covers it, as a lamp 1.5 m above sees it.
pub fn under_slab(ior: f64) -> Scene {
    let mut scene = parts::reference_scene(0.5);
    let slab = shapes::cuboid(DVec3::new(-3.0, 0.5, -3.0), DVec3::new(3.0, 0.7, 3.0));
    parts::add(&mut scene, "slab", slab, parts::dielectric("glass", ior));
    scene
}

/// A lamp before an upright mirror, with a floor between: E of the floor is that of the mirrored lamp.
pub fn upright_mirror() -> Scene {
    with_upright(mirror_mesh())
}

/// The mesh of its mirror.
pub fn mirror_mesh() -> Mesh {
    shapes::rectangle(DVec3::new(0.6, 0.75, 0.0), DVec3::Z, DVec3::Y * 0.75)
}

/// The same with another mirror, or pieces of one.
pub fn with_upright(mirror: Mesh) -> Scene {
    let mut scene = parts::reference_scene(0.5);
    parts::add(&mut scene, "mirror", mirror, parts::mirror());
    lamp(&mut scene, UPRIGHT_LAMP);
    scene
}

/// The lamp before the upright mirror [m].
pub const UPRIGHT_LAMP: DVec3 = DVec3::new(-0.1, 1.0, 0.05);

/// E on the floor before the upright mirror by its mirrored lamp [W/m²].
pub fn upright_theory(point: DVec3) -> f64 {
    from_lamp(
        point,
        DVec3::new(1.2 - UPRIGHT_LAMP.x, UPRIGHT_LAMP.y, UPRIGHT_LAMP.z),
    )
}

/// E of a lamp of 1 W/sr on a horizontal surface [W/m²].
pub fn from_lamp(point: DVec3, lamp: DVec3) -> f64 {
    let away = lamp - point;
    away.y.abs() / away.length().powi(3)
}

/// A glass ball over a floor, under a lamp.
pub fn glass_ball(levels: u32) -> Scene {
    let mut scene = parts::reference_scene(0.4);
    let ball = shapes::sphere(DVec3::new(0.0, 0.5, 0.0), 0.3, levels);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    lamp(&mut scene, DVec3::new(0.1, 2.0, 0.05));
    scene
}

/// A box of opaque faces around everything within 1 m or so, without what lies in it.
pub fn room(half_m: f64) -> Scene {
    let mut scene = parts::reference_scene(half_m);
    scene.objects[0].mesh = Arc::new(shapes::cuboid(DVec3::splat(-half_m), DVec3::splat(half_m)));
    scene
}

/// Turned, scaled about the origin, then moved. A mirroring `linear` part turns triangles, so that outsides stay
/// outside. Lights keep their strength; those without a place are turned.
pub fn transformed(mut scene: Scene, rotation: DMat3, scale: f64, offset: DVec3) -> Scene {
    let place = |p: DVec3| rotation * p * scale + offset;
    let is_mirrored = rotation.determinant() < 0.0;
    for object in &mut scene.objects {
        let mesh = Arc::make_mut(&mut object.mesh);
        mesh.positions.iter_mut().for_each(|p| *p = place(*p));
        mesh.normals.iter_mut().for_each(|n| *n = rotation * *n);
        if is_mirrored {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position, .. } => *position = place(*position),
            LightKind::Spot {
                position, direction, ..
            } => {
                *position = place(*position);
                *direction = rotation * *direction;
            }
            LightKind::Sun { direction, .. } => *direction = rotation * *direction,
            LightKind::Panel {
                centre, across, down, ..
            } => {
                *centre = place(*centre);
                *across = rotation * *across * scale;
                *down = rotation * *down * scale * if is_mirrored { -1.0 } else { 1.0 };
            }
            LightKind::Surface { .. } | LightKind::Environment { .. } => {}
        }
    }
    for material in &mut scene.materials {
        if let Some(volume) = &mut material.volume {
            volume.attenuation_distance_m *= scale;
        }
    }
    scene
}

/// Numbers in [0, 1), the same at every run.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    use rand_pcg::rand_core::{Rng, SeedableRng};
    let mut generator = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    move || (generator.next_u64() >> 11) as f64 * (-53_f64).exp2()
}
