// Traces single rays for tests and returns their hits.

struct ProbeRay {
    origin: vec3f,
    padding0: u32,
    direction: vec3f,
    padding1: u32,
}

struct ProbeHit {
    order: u32,
    distance: f32,
    padding: vec2u,
}

@group(0) @binding(0) var<storage, read> probe_rays: array<ProbeRay>;
@group(0) @binding(1) var<storage, read_write> probe_hits: array<ProbeHit>;

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&probe_rays) {
        return;
    }
    let ray = probe_rays[id.x];
    let hit = closest_hit(ray.origin, ray.direction, FAR_AWAY);
    var order = NO_TRIANGLE;
    if hit.triangle != NO_TRIANGLE {
        order = met(hit).order;
    }
    probe_hits[id.x] = ProbeHit(order, hit.distance, vec2u(0u));
}
