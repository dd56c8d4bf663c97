// What rays through a layer have in common, whether its columns are over a flat base (path.wgsl) or have bases, tops and extinctions
// of their own (path_columns.wgsl).
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0).
//
// A ray that would be cut more than max_steps times, close to the horizon, is an approximation: it climbs as far on a
// shorter way over the map, whose clouds stand for those of the whole way. Flat layers stay exact. What a viewer sees is found
// with more of it exact (path_seen.wgsl).
struct Path {
    length_m: f32, // of cloud of the layer's extinction
    low_m: f32,    // mean height above the base of what is seen of the cloud along the ray, from below
    high_m: f32,   // and from above
}

// What is found along a stretch of a ray.
struct Stretch {
    path_m: f32,     // height climbed in cloud of the layer's extinction
    left: f32,       // of light along it
    low: vec2<f32>,  // what is seen of it from below: weighted heights above its start, and weights
    high: vec2<f32>, // and from above
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

// How far over the map a ray goes for each metre of height.
fn path_slope(frame: Frame, up: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(up.x, -up.y) / (max(up.z, MIN_COSINE) * frame.place.extent_m);
}

// How often a ray through the whole layer would be cut, over how often it may be.
fn path_excess(map: texture_2d<f32>, frame: Frame, slope: vec2<f32>) -> f32 {
    let crossings = frame.place.depth_m * dot(abs(slope), vec2<f32>(textureDimensions(map)));
    return crossings / f32(frame.place.max_steps);
}

// A ray that starts from_m above the base, at start_uv.
fn path_from(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    repeat: sampler,
    frame: Frame,
    start_uv: vec2<f32>,
    up: vec3<f32>,
    from_m: f32,
) -> Path {
    let cosine = max(up.z, MIN_COSINE);
    let slope = path_slope(frame, up);
    let shorter = slope / max(1.0, path_excess(map, frame, slope));
    // Optical depth per metre of height.
    let per_metre = frame.medium.extinction_550 / cosine;
    let start = start_uv + frame.place.offset_uv;
    let way_m = frame.place.depth_m - from_m;
    let all = path_stretch(map, bounds, repeat, start, shorter, from_m, way_m, per_metre, frame.place.max_steps);
    return Path(all.path_m / cosine, from_m + all.low.x / max(all.low.y, 1e-30), from_m + all.high.x / max(all.high.y, 1e-30));
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
