// Start and limits of rays through the scene's hierarchy.

struct ChainStart {
    eye: vec3f,
    unit_m: f32,
    media: vec4u,
    near: f32,
    branch_threshold: f32,
    max_depth: u32,
    branching_depth: u32,
    light_count: u32,
    // Of lamps that are highlights alone; they follow after the lights.
    lobe_lamp_count: u32,
    padding0: u32,
    padding1: u32,
}

@group(1) @binding(0) var<uniform> start: ChainStart;
