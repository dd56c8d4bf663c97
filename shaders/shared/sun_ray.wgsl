// Cloud along a ray towards the sun, as far as some of the beam is left. Uses the bindings frame, disc and thickness of the pass.
@group(0) @binding(6) var bounds: texture_2d<f32>;
@group(0) @binding(7) var repeat: sampler;

const PATH_SEEN: bool = false;
// What comes after these.
const SUN_NEXT: u32 = 8u;

// What is left of a beam beyond this optical depth is less than single precision holds beside 1.
const SUN_RAY_DEPTH: f32 = 17.0;
// A ray is followed in pieces of so many lines between texels at least, and so many of them at most: where it is dark after one it goes no
// further.
const SUN_RAY_LINES: f32 = 96.0;
const SUN_RAY_PIECES: f32 = 10.0;

// Height crossed in cloud of the layer's extinction, or so much that the beam is dark: see path_in_layer.
fn height_to_sun(direction: u32, base_uv: vec2<f32>) -> f32 {
    let up = disc.ways[direction].towards;
    let cosine = max(up.z, MIN_COSINE);
    let slope = path_slope(frame, up);
    let excess = path_excess(thickness, frame, slope);
    let shorter = slope / max(1.0, excess);
    let per_metre = frame.medium.extinction_550 / cosine;
    let dark_m = SUN_RAY_DEPTH / (out_of_beam().g * per_metre);
    let start = base_uv + frame.place.offset_uv;
    let lines = min(excess, 1.0) * f32(frame.place.max_steps);
    let pieces = clamp(floor(lines / SUN_RAY_LINES), 1.0, SUN_RAY_PIECES);
    let piece_m = frame.place.depth_m / pieces;
    let steps = path_most_steps(frame.place.max_steps);
    var sum = 0.0;
    for (var piece = 0.0; piece < pieces && sum < dark_m; piece += 1.0) {
        let low_m = piece * piece_m;
        let way = Way(start + shorter * low_m, shorter, low_m, piece_m, 1.0);
        sum += path_stretch(thickness, bounds, repeat, way, per_metre, steps, 0.0).path_m;
    }
    return sum;
}

fn light_of(place: DiscPlace, base_uv: vec2<f32>) -> vec4<f32> {
    return light_after(height_to_sun(place.direction, base_uv) / place.cosine);
}
