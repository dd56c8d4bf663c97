// Over a flat base: where in a step of a ray there is cloud, as parts of it, and its extinction relative to the layer's.
fn lattice_piece(first: vec4<f32>, last: vec4<f32>, heights_m: vec2<f32>) -> vec3<f32> {
    let under = vec2<f32>(first.x, last.x) - heights_m;
    let crossing = under.x / select(under.x - under.y, 1.0, under.x == under.y);
    let ends = vec2<f32>(select(crossing, 0.0, under.x > 0.0), select(crossing, 1.0, under.y > 0.0));
    return select(vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(ends, 1.0), under.x > 0.0 || under.y > 0.0);
}
