// What path_columns.wgsl finds texel by texel, by samples of a map with mip levels. Between two samples heights and optical
// depth are taken to change evenly.
struct SampledPath {
    length_m: f32, // of cloud of the layer's extinction
    low_m: f32,    // mean height above the start of what is seen of the cloud along the ray, from below
    high_m: f32,   // and from above
}

// The ray starts from_m above the base plane, at start_uv, and climbs by rise_m along up. steps: samples for each texel of the
// level that it crosses: see path_lines.
fn path_sampled(
    map: texture_2d<f32>,
    trilinear: sampler,
    level: f32,
    frame: Frame,
    start_uv: vec2<f32>,
    up: vec3<f32>,
    from_m: f32,
    rise_m: f32,
    steps: f32,
) -> SampledPath {
    let cosine = max(up.z, MIN_COSINE);
    let start = start_uv + frame.place.offset_uv;
    let way_uv = vec2<f32>(up.x, -up.y) * (rise_m / (cosine * frame.place.extent_m));
    let lines = path_lines(map, level, start, way_uv, steps);
    // Optical depth per metre of height.
    let per_metre = frame.medium.extinction_550 / cosine;
    var before = sample_level(map, trilinear, start, level);
    var done = 0.0;
    var sum = 0.0;
    var left = 1.0;
    // Weighted heights and weights.
    var low = vec2<f32>(0.0);
    var high = vec2<f32>(0.0);
    for (var i = 0u; i < lines.count; i++) {
        let height_m = done * rise_m;
        let part = path_part(lines, i);
        let piece_m = (part - done) * rise_m;
        let after = sample_level(map, trilinear, start + way_uv * part, level);
        let piece = column_piece(before, after, from_m + vec2<f32>(height_m, height_m + piece_m));
        let path_m = piece.density * (piece.ends.y - piece.ends.x) * piece_m;
        sum += path_m;
        let middle_m = height_m + 0.5 * (piece.ends.x + piece.ends.y) * piece_m;
        let passing = exp(-per_metre * path_m);
        let kept = 1.0 - passing;
        low += left * kept * vec2<f32>(middle_m, 1.0);
        high = passing * high + kept * vec2<f32>(middle_m, 1.0);
        left *= passing;
        before = after;
        done = part;
    }
    return SampledPath(sum / cosine, low.x / max(low.y, 1e-30), high.x / max(high.y, 1e-30));
}
