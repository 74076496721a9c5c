// Surfaces with holes: an alpha mask takes away what lies below its cutoff.

// Whether the surface has one; for chains, whether anything in the scene has.
override HAS_MASK: bool;

// Whether an object's surface is there at a place of its base colour texture, at its finest: so does light find it.
fn is_there(object: ObjectRecord, uvs: vec4f) -> bool {
    var alpha = 1.0;
    if object.texture != NO_IMAGE {
        let record = image_table[object.texture];
        alpha = level_value(texture_tiles, record, image_table[record], placed(object.texture, uvs, false)).a;
    }
    return alpha >= object.alpha_cutoff;
}

// Leaves holes as they are; derivatives are to be taken before.
fn cut_out(fragment: Fragment) {
    if HAS_MASK && !is_there(objects[fragment.object], fragment.uvs) {
        discard;
    }
}
