//! Polish that covers a part of a surface: shares of the light.

use std::sync::Arc;

use glam::DVec3;
use nephroid::geometry::Ray;
use nephroid::optics::fresnel::dielectric_reflectance;
use nephroid::scene::SurfaceKind;
use nephroid::scene::builtin::parts;
use nephroid::transport::{MediumStack, Tracer};

#[test]
fn polish_reflects_by_the_part_that_it_covers_and_the_rest_is_deposited() {
    for polish in [0.0, 0.3, 1.0] {
        let mut scene = parts::reference_scene(1.0);
        let floor = &mut scene.materials[0];
        (floor.surface, floor.roughness, floor.polish) = (SurfaceKind::Mixed, 0.0, polish);
        let tracer = Tracer::new(Arc::new(scene));
        for tangent in [0.0, 0.5, 2.0, 20.0] {
            let direction = DVec3::new(tangent, -1.0, 0.0).normalize();
            let origin = DVec3::new(-0.1 * tangent.min(1.0), 0.0, 0.1) - direction * 0.5;
            let hit = tracer.closest_hit(&Ray { origin, direction }).expect("the floor");
            let shares = tracer.interact(&hit, direction, &MediumStack::default());
            let back = shares.reflection.map_or(0.0, |branch| branch.share.g);
            let expected = polish * dielectric_reflectance(-direction.y, 1.5);
            assert!((back - expected).abs() < 1e-12, "{back} {expected}");
            assert!((back + shares.deposit.g - 1.0).abs() < 1e-12);
        }
    }
}
