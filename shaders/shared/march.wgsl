// What rays through a layer have in common, whether its columns are over a flat base (path.wgsl) or have bases, tops and extinctions
// of their own (path_columns.wgsl).
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0).
struct Path {
    length_m: f32, // of cloud of the layer's extinction
    low_m: f32,    // mean height above the base of what is seen of the cloud along the ray, from below
    high_m: f32,   // and from above
}

fn path_in_layer(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    repeat: sampler,
    frame: Frame,
    base_uv: vec2<f32>,
    up: vec3<f32>,
) -> Path {
    return path_from(map, bounds, repeat, frame, base_uv, up, 0.0);
}

// Mean depth at which light is stopped in a stretch of optical depth x that stops it, as a part of the stretch: 1/2 in a
// thin one, 1/x in a thick one.
fn path_mean_depth(x: f32) -> f32 {
    return select(1.0 / max(x, 0.3) - 1.0 / (exp(min(x, 80.0)) - 1.0), 0.5 - x / 12.0 + x * x * x / 720.0, x < 0.3);
}

// The cell that a ray goes into: where it lies on a line, the one ahead.
fn path_cell(place: vec2<f32>, forward: vec2<bool>) -> vec2<f32> {
    return select(ceil(place) - 1.0, floor(place), forward);
}

// Ways up to where a ray leaves a square on each axis.
fn path_end(place: vec2<f32>, corner: vec2<f32>, side: f32, pitch: vec2<f32>, forward: vec2<bool>) -> vec2<f32> {
    return select(place - corner, corner + side - place, forward) * pitch;
}
