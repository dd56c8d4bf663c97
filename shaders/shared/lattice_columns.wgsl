// Of columns: where in a step of a ray there is cloud, as parts of it, and its extinction relative to the layer's.
fn lattice_piece(first: vec4<f32>, last: vec4<f32>, heights_m: vec2<f32>) -> vec3<f32> {
    let piece = column_piece(first, last, heights_m);
    return vec3<f32>(piece.ends, piece.density);
}
