//! Bump mapping (Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978): the normal n and the gradient ∇h of a height
//! give n' ∝ n − (∇h − n·(n·∇h)). The surface itself stays where it is.

use glam::DVec3;

/// The gradient of the height without its part along the unit normal [1].
fn along_surface(normal: DVec3, gradient: DVec3) -> DVec3 {
    gradient - normal * normal.dot(gradient)
}

/// The bent unit normal.
pub fn bent(normal: DVec3, gradient: DVec3) -> DVec3 {
    // At least as long as the unit normal, which the rest is perpendicular to.
    (normal - along_surface(normal, gradient)).normalize()
}

/// The change of the bent normal [1] for a step along which the normal and the gradient change by so much.
pub fn bent_change(normal: DVec3, gradient: DVec3, normal_change: DVec3, gradient_change: DVec3) -> DVec3 {
    let sum = normal - along_surface(normal, gradient);
    let length = sum.length();
    let unit = sum / length;
    let along_normal = normal.dot(gradient);
    let along_normal_change = normal_change.dot(gradient) + normal.dot(gradient_change);
    let change =
        normal_change - gradient_change + normal_change * along_normal + normal * along_normal_change;
    (change - unit * unit.dot(change)) / length
}
