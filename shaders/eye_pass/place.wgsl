// Corners of triangles in the picture.

struct Corner {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Both sets of texture coordinates.
    @location(2) uvs: vec4f,
    @location(3) map_uv: vec2f,
    @location(7) colour: vec4f,
}

struct Fragment {
    // The same bits in every pass: what is drawn twice is compared for equal depth.
    @builtin(position) @invariant clip: vec4f,
    @location(0) from_camera: vec3f,
    @location(1) normal: vec3f,
    @location(2) uvs: vec4f,
    @location(3) map_uv: vec2f,
    @location(4) @interpolate(flat) object: u32,
    @location(5) colour: vec3f,
}

@vertex
fn place(corner: Corner, @builtin(instance_index) object: u32) -> Fragment {
    // Relative to the camera first: differences of nearby numbers lose nothing.
    let from_camera = corner.position - frame.camera_position;
    var clip = frame.clip_from_camera * vec4f(from_camera, 1.0);
    clip.x -= frame.jitter.x * clip.w;
    clip.y -= frame.jitter.y * clip.w;
    return Fragment(clip, from_camera, corner.normal, corner.uvs, corner.map_uv, object, corner.colour.rgb);
}
