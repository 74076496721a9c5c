// What is seen where nothing stands in the way: the same in all directions.

fn background(direction: vec3f) -> vec3f {
    return frame.background;
}
