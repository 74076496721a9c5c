// The stack of bodies that a path is inside of, innermost first: eight 16-bit numbers, object index + 1 each, 0 for
// none. Twin of transport/medium.rs.

const MEDIA: u32 = 8u;

fn medium_at(media: vec4u, place: u32) -> u32 {
    return (media[place / 2u] >> (16u * (place % 2u))) & 0xffffu;
}

// Number of the innermost body; 0 outside of all.
fn innermost(media: vec4u) -> u32 {
    return media.x & 0xffffu;
}

// A body beyond the stack's capacity is not recorded.
fn entered(media: vec4u, object: u32) -> vec4u {
    if medium_at(media, MEDIA - 1u) != 0u {
        return media;
    }
    return vec4u(
        (media.x << 16u) | (object + 1u),
        (media.y << 16u) | (media.x >> 16u),
        (media.z << 16u) | (media.y >> 16u),
        (media.w << 16u) | (media.z >> 16u),
    );
}

// Removes the innermost entry of a body; unchanged if the path was not inside it.
fn left(media: vec4u, object: u32) -> vec4u {
    var place = 0u;
    while place < MEDIA && medium_at(media, place) != object + 1u {
        place += 1u;
    }
    if place == MEDIA {
        return media;
    }
    var kept = vec4u(0u);
    for (var to = 0u; to < MEDIA; to += 1u) {
        let source = select(to + 1u, to, to < place);
        if source < MEDIA {
            kept[to / 2u] |= medium_at(media, source) << (16u * (to % 2u));
        }
    }
    return kept;
}

fn medium_ior(media: vec4u, wavelength: u32) -> f32 {
    let number = innermost(media);
    if number == 0u {
        return 1.0;
    }
    return ior_of(number - 1u, wavelength);
}

// Transmittance over a distance [m] in the innermost body (Beer and Lambert).
fn medium_transmittance(media: vec4u, distance_m: f32) -> vec3f {
    let number = innermost(media);
    if number == 0u {
        return vec3f(1.0);
    }
    return exp(-objects[number - 1u].absorption_per_m * distance_m);
}
