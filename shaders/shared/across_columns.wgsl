// What path_across.wgsl counts of a layer whose columns have bases, tops and extinctions of their own.

// Part of the way between two columns, at those heights, that is in cloud, times its extinction relative to the layer's.
fn across_cloud(first: vec4<f32>, last: vec4<f32>, heights_m: vec2<f32>) -> f32 {
    let piece = column_piece(first, last, heights_m);
    return piece.density * (piece.ends.y - piece.ends.x);
}

// Heights between which there may be cloud in a block of texels.
fn across_ends(ends: vec2<f32>) -> vec2<f32> {
    return ends;
}
