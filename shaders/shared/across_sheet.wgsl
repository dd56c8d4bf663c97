// What path_across.wgsl counts of a layer over a flat base.

// Part of the way between two columns, at those heights, that is in cloud.
fn across_cloud(first: vec4<f32>, last: vec4<f32>, heights_m: vec2<f32>) -> f32 {
    let above = vec2<f32>(first.x, last.x) - heights_m;
    return (max(above.x, 0.0) + max(above.y, 0.0)) / max(abs(above.x) + abs(above.y), 1e-9);
}

// Heights between which there may be cloud in a block of texels: from the base on.
fn across_ends(ends: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(-1e9, ends.y);
}
