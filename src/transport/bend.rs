//! Bump mapping (Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978): the normal n and the gradient ∇h of a height
//! give n' ∝ n − (∇h − n·(n·∇h)). The surface itself stays where it is.

use glam::DVec3;

/// Tangential component of the height's gradient [1].
fn along_surface(normal: DVec3, gradient: DVec3) -> DVec3 {
    gradient - normal * normal.dot(gradient)
}

/// Perturbed unit normal.
pub fn bent(normal: DVec3, gradient: DVec3) -> DVec3 {
    // Never shorter than 1: the subtracted part is perpendicular to the unit normal.
    (normal - along_surface(normal, gradient)).normalize()
}
