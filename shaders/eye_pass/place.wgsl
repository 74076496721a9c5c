// Vertex stage of surfaces.

struct Corner {
    // In mesh coordinates.
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Both texture coordinate sets.
    @location(2) uvs: vec4f,
    @location(3) map_uv: vec2f,
    // Rows of the transform to the scene, from the object's record.
    @location(4) row_x: vec4f,
    @location(5) row_y: vec4f,
    @location(6) row_z: vec4f,
    @location(7) colour: vec4f,
}

struct Fragment {
    // Bit-identical in every pass, as the passes compare for equal depth.
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
    let position = vec4f(corner.position, 1.0);
    let in_scene = vec3f(dot(corner.row_x, position), dot(corner.row_y, position), dot(corner.row_z, position));
    // Subtracts the camera first: this is exact for nearby positions.
    let from_camera = in_scene - frame.camera_position;
    var clip = frame.clip_from_camera * vec4f(from_camera, 1.0);
    clip.x -= frame.jitter.x * clip.w;
    clip.y -= frame.jitter.y * clip.w;
    let normal = normal_in_scene(corner.normal, corner.row_x.xyz, corner.row_y.xyz, corner.row_z.xyz);
    return Fragment(clip, from_camera, normal, corner.uvs, corner.map_uv, object, corner.colour.rgb);
}
