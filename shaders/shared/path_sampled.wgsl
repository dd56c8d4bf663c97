// Cloud along a ray through the layer where many rays and long ones are looked at: what path.wgsl finds exactly, by samples of
// a map with mip levels. Between two samples the height of the cloud's top above the ray is taken to change evenly.
struct SampledPath {
    length_m: f32,
    low_m: f32,  // mean height above the start of what is seen of the cloud along the ray, from below
    high_m: f32, // and from above
}

// The ray starts from_m above the base, at start_uv, and climbs by rise_m along up. steps: samples for each texel of the level
// that it crosses: see path_lines.
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
    var before = sample_level(map, trilinear, start, level).x - from_m;
    var done = 0.0;
    var sum = 0.0;
    var left = 1.0;
    // Weighted heights and weights.
    var low = vec2<f32>(0.0);
    var high = vec2<f32>(0.0);
    for (var i = 0u; i < lines.count; i++) {
        let part = path_part(lines, i);
        let piece_m = rise_m * (part - done);
        let above = sample_level(map, trilinear, start + way_uv * part, level).x - from_m - rise_m * part;
        // Part of the piece in cloud, at the end where the ray is in it.
        let inside = (max(before, 0.0) + max(above, 0.0)) / max(abs(before) + abs(above), 1e-9);
        let part_m = inside * piece_m;
        sum += part_m;
        let middle_m = rise_m * part - select(0.5 * part_m, piece_m - 0.5 * part_m, before > above);
        let passing = exp(-per_metre * part_m);
        let kept = 1.0 - passing;
        low += left * kept * vec2<f32>(middle_m, 1.0);
        high = passing * high + kept * vec2<f32>(middle_m, 1.0);
        left *= passing;
        before = above;
        done = part;
    }
    return SampledPath(sum / cosine, low.x / max(low.y, 1e-30), high.x / max(high.y, 1e-30));
}
