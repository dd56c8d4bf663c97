// A layer over a flat base, of one extinction: a texel of its map is the thickness.

// Height of a column's top above the base plane.
fn column_top(texel: vec4<f32>) -> f32 {
    return texel.x;
}

fn column_thickness(texel: vec4<f32>) -> f32 {
    return texel.x;
}

// Heights that bound its cloud, above the base plane.
fn column_ends(texel: vec4<f32>) -> vec2<f32> {
    return texel.xx;
}

// Whether the heights of a block of columns tell of cloud.
fn column_counts(texel: vec4<f32>) -> bool {
    return true;
}
