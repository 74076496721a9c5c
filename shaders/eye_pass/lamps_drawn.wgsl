// Draws lamps that have an extent, added to what is behind them. Lengths in metres.

// Of the lamp's record.
struct LampCorner {
    @location(0) place: vec3f,
    @location(1) kind: u32,
    @location(2) across: vec3f,
    @location(3) radius: f32,
    @location(4) down: vec3f,
    @location(5) outline: u32,
}

struct LampFragment {
    @builtin(position) clip: vec4f,
    @location(0) from_camera: vec3f,
    @location(1) @interpolate(flat) lamp: u32,
}

@group(1) @binding(0) var<storage, read> seen_lamps: array<LightRecord>;

// Growth of a pixel's footprint per length.
fn pixel_spread() -> f32 {
    return frame.pixel_rad * frame.traced_per_pixel.y;
}

// Half-axes of a rectangle about a lamp and the pixels that it touches.
fn around(corner: LampCorner, middle: vec3f, far: f32) -> array<vec3f, 2> {
    if corner.outline != OUTLINE_ROUND {
        let sizes = vec2f(length(corner.across), length(corner.down));
        let wider = 1.0 + pixel_spread() * (far + sizes.x + sizes.y) / sizes;
        return array(corner.across * wider.x, corner.down * wider.y);
    }
    // Of a ball, a disc across the line to its centre that covers its outline.
    let pixel = pixel_spread() * far;
    let radius = max(corner.radius, pixel) + pixel;
    let sine = select(radius / far, 0.0, corner.kind == LIGHT_SUN);
    let size = radius / sqrt(max(1.0 - sine * sine, 0.01));
    let ahead = middle / far;
    let aside = cross(ahead, select(vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.0, 0.0), abs(ahead.y) > 0.9));
    let across = normalize(aside) * size;
    return array(across, cross(ahead, across));
}

// Two triangles a lamp.
@vertex
fn lamp_corner(corner: LampCorner, @builtin(vertex_index) index: u32, @builtin(instance_index) lamp: u32) -> LampFragment {
    // Suns are infinitely far away.
    let is_sun = corner.kind == LIGHT_SUN;
    let middle = select(corner.place - frame.camera_position, -corner.place, is_sun);
    let axes = around(corner, middle, max(length(middle), 1e-20));
    let at = vec2f(vec2u(0x32u >> index, 0x2cu >> index) & vec2u(1u)) * 2.0 - 1.0;
    let from_camera = middle + axes[0] * at.x + axes[1] * at.y;
    var clip = frame.clip_from_camera * vec4f(from_camera, select(1.0, 0.0, is_sun));
    clip.x -= frame.jitter.x * clip.w;
    clip.y -= frame.jitter.y * clip.w;
    // A surface in the plane of a panel hides it, as it does in mirrors.
    clip.z *= 1.0 - BEFORE_SURFACE;
    return LampFragment(clip, from_camera, lamp);
}

@fragment
fn lamp_drawn(fragment: LampFragment) -> @location(0) vec4f {
    var light = seen_lamps[fragment.lamp];
    light.place -= select(frame.camera_position, vec3f(0.0), light.kind == LIGHT_SUN);
    let cone = Cone(vec3f(0.0), 0.0, normalize(fragment.from_camera), pixel_spread(), 1.0);
    return vec4f(scaled(seen_lamp(light, cone).radiance), 0.0);
}
