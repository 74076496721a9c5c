//! What is handed to the shaders; names and order are those of `shaders/eye_pass/`.

use crate::gpu::layout::shader_struct;
use crate::optics::LinearSrgb;

shader_struct! {
    /// One picture.
    Frame {
        /// Clip from world axes with the camera at the origin, column by column.
        clip_from_camera: [[f32; 4]; 4],
        /// Scene coordinates [m].
        camera_position: [f32; 3],
        /// What is written is radiance times this.
        radiance_scale: f32,
        /// Seen by specular surfaces above the horizon [W/(m² sr)].
        sky_radiance: [f32; 3],
        padding0: f32,
        /// Seen by specular surfaces below the horizon [W/(m² sr)].
        ground_radiance: [f32; 3],
        padding1: f32,
    }
}

shader_struct! {
    /// One object.
    ObjectUniform {
        /// [`Material::base_colour`](crate::scene::Material::base_colour).
        base_colour: [f32; 3],
        /// Irradiance [W/m²] of a map value of 1.
        irradiance_scale: f32,
        /// [W/(m² sr)].
        emitted_radiance: [f32; 3],
        /// Refractive index.
        ior: f32,
        /// What a clear body lets through over its typical thickness, [0, 1].
        body_transmittance: [f32; 3],
        /// Kind of surface, `SURFACE_*` in the shader.
        surface: u32,
    }
}

shader_struct! {
    /// The last pass.
    ToneMapping {
        /// Display light per written value.
        exposure: f32,
        /// `TONE_MAP_*` in the shader.
        tone_map: u32,
        /// 1 where the target does not encode by itself.
        encode_srgb: u32,
        padding: u32,
    }
}

/// A colour in single precision.
pub(super) fn rgb(colour: LinearSrgb) -> [f32; 3] {
    colour.to_array().map(|channel| channel as f32)
}
