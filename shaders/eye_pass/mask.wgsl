// Alpha masks: surfaces are cut out where alpha is below the cutoff.

// Whether the surface has an alpha mask; for chains, whether any surface of the scene has.
override HAS_MASK: bool;

// Whether a surface is present at a position. Uses the finest level of the texture, as the light pass does.
fn is_there(object: ObjectRecord, uvs: vec4f) -> bool {
    var alpha = 1.0;
    if object.texture != NO_IMAGE {
        let record = image_table[object.texture];
        alpha = level_value(texture_tiles, record, image_table[record], placed(object.texture, uvs, false)).a;
    }
    return alpha >= object.alpha_cutoff;
}

// Discards fragments in holes. Derivatives must be taken before.
fn cut_out(fragment: Fragment) {
    if HAS_MASK && !is_there(objects[fragment.object], fragment.uvs) {
        discard;
    }
}
