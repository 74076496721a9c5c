//! What specular surfaces are shown instead of their surroundings.

use crate::illumination::IlluminationMap;
use crate::optics::LinearSrgb;
use crate::scene::Scene;

/// Mean radiance ρE/π of all surfaces with a map, by area [W/(m² sr)]; black without maps. Textures count as white.
pub(super) fn mean_diffuse_radiance(scene: &Scene, maps: &[IlluminationMap]) -> LinearSrgb {
    let (mut exitance_w, mut area_m2) = (LinearSrgb::BLACK, 0.0);
    for map in maps {
        let albedo = scene.material_of(map.chart.object).base_colour;
        for layer in &map.layers {
            exitance_w += map.flux_w(layer.kind) * albedo;
        }
        area_m2 += scene.objects[map.chart.object].mesh.area_m2();
    }
    if area_m2 > 0.0 {
        exitance_w / (area_m2 * std::f64::consts::PI)
    } else {
        LinearSrgb::BLACK
    }
}
