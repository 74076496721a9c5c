// One picture: the camera and how radiance is written.

struct Frame {
    clip_from_camera: mat4x4f,
    camera_position: vec3f,
    radiance_scale: f32,
    background: vec3f,
    padding: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
