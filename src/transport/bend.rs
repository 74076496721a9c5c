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

/// Change of the perturbed normal [1] from the changes of the normal and of the height's gradient along a step.
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
