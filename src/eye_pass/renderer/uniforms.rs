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
        /// Seen where nothing is hit [W/(m² sr)].
        background: [f32; 3],
        padding: u32,
    }
}

/// Plane receivers that specular surfaces see; `MAX_RECEIVERS` in the shader.
pub(super) const MAX_RECEIVERS: usize = 16;

shader_struct! {
    /// A plane receiver as specular surfaces see it. Rows are linear functions of the place: xyz · place + w.
    Receiver {
        /// Distance from the plane [m].
        plane: [f32; 4],
        /// Map coordinate across.
        u: [f32; 4],
        /// Map coordinate down.
        v: [f32; 4],
        /// Texels of its image that the whole map covers.
        image_size: [f32; 2],
        padding: [f32; 2],
    }
}

shader_struct! {
    /// What specular surfaces see.
    Surroundings {
        /// The first `count` are in use.
        receivers: [Receiver; MAX_RECEIVERS],
        /// Seen below the horizon where there are no receivers [W/(m² sr)].
        mean_radiance: [f32; 3],
        /// Receivers in use.
        count: u32,
        /// Radiance [W/(m² sr)] of an image value of 1.
        radiance_scale: f32,
        padding0: f32,
        padding1: f32,
        padding2: f32,
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
        padding: u32,
    }
}

/// A colour in single precision.
pub(super) fn rgb(colour: LinearSrgb) -> [f32; 3] {
    colour.to_array().map(|channel| channel as f32)
}
