// What rays through a layer have in common, whether its columns are over a flat base (path.wgsl) or have bases, tops and extinctions
// of their own (path_columns.wgsl).
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0).
//
// A ray that would be cut more than max_steps times, close to the horizon, is an approximation: it climbs as far on a
// shorter way over the map, whose clouds stand for those of the whole way. Flat layers stay exact. What a viewer sees is found
// with more of it exact (path_seen.wgsl).
// What is found along a stretch of a ray.
struct Stretch {
    path_m: f32,    // height crossed in cloud of the layer's extinction
    left: f32,      // of light along it
    met: vec2<f32>, // what is seen of it from its start: weighted ways from there, and weights
    done_m: f32,    // how far it was followed
}

// Length of cloud of the layer's extinction along a ray.
fn path_in_layer(
    map: texture_2d<f32>,
    bounds: texture_2d<f32>,
    repeat: sampler,
    frame: Frame,
    base_uv: vec2<f32>,
    up: vec3<f32>,
) -> f32 {
    return path_from(map, bounds, repeat, frame, base_uv, up, 0.0);
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
) -> f32 {
    let cosine = max(up.z, MIN_COSINE);
    let slope = path_slope(frame, up);
    let shorter = slope / max(1.0, path_excess(map, frame, slope));
    // Optical depth per metre of height.
    let per_metre = frame.medium.extinction_550 / cosine;
    let start = start_uv + frame.place.offset_uv;
    let way_m = frame.place.depth_m - from_m;
    let steps = path_most_steps(frame.place.max_steps);
    return path_stretch(map, bounds, repeat, Way(start, shorter, from_m, way_m, 1.0), per_metre, steps, 0.0).path_m / cosine;
}

// A part of a ray.
struct Way {
    start_uv: vec2<f32>,
    uv_per_metre: vec2<f32>, // how far it goes over the map for each metre of height
    from_m: f32,             // height of its start above the base
    way_m: f32,              // height from there to its end
    sense: f32,              // 1: it climbs, -1: it sinks
}

// Steps that end at so many lines, blocks, or where the ray comes to all that may be in a block, and looks at wide blocks of which
// nothing is known: fewer of the latter three than half the lines.
fn path_most_steps(lines: u32) -> u32 {
    return lines + lines / 2u + 8u;
}

// A block about a cell, of which may be known that it is cloud, or clear, where the ray is.
struct Block {
    side: f32,    // squares between texel centres; 1 where nothing is known
    first_m: f32, // until here the ray is before all that may be in the block
    before: bool,
    after: bool,  // behind it
}

fn path_block(bounds: texture_2d<f32>, level: u32, cell: vec2<f32>, way: Way, done_m: f32) -> Block {
    let between = path_between(bounds, level, cell, way);
    let before = done_m < between.x;
    let after = done_m >= between.y;
    return Block(select(1.0, f32(BOUNDS_TEXELS << level), before || after), between.x, before, after);
}

// Where a ray is among all that may be in a block.
fn path_between(bounds: texture_2d<f32>, level: u32, cell: vec2<f32>, way: Way) -> vec2<f32> {
    let block = vec2<i32>(floor(cell / f32(BOUNDS_TEXELS << level)));
    let ends = textureLoad(bounds, block, i32(level)).xy - way.from_m;
    return select(-ends.yx, ends, way.sense > 0.0);
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
