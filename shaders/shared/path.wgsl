// Cloud along a ray through the layer: its length, and the heights between which it lies.
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0). Cloud fills base to
// base + thickness, thickness being the bilinear, periodic map. The ray is cut where it crosses the lines between texel
// centres, on which the map has its kinks. In between, a bilinear map is a parabola along the ray: three samples give it,
// and the part of the piece counts along which the ray is below it, so the length is exact. Where only every so many
// lines are taken, or the ray is too long for max_steps, the parabola is an approximation; flat layers stay exact.
struct Path {
    length_m: f32,
    low_m: f32,  // heights above the base between which the ray is in cloud
    high_m: f32,
}

fn path_in_layer(map: texture_2d<f32>, repeat: sampler, frame: Frame, base_uv: vec2<f32>, up: vec3<f32>) -> Path {
    return path_from(map, repeat, frame, base_uv, up, 0.0);
}

// The same for a ray that starts from_m above the base, at start_uv.
fn path_from(
    map: texture_2d<f32>,
    repeat: sampler,
    frame: Frame,
    start_uv: vec2<f32>,
    up: vec3<f32>,
    from_m: f32,
) -> Path {
    let cosine = max(up.z, MIN_COSINE);
    let uv_per_metre = vec2<f32>(up.x, -up.y) / (cosine * frame.extent_m);
    let start = start_uv + frame.offset_uv;
    let size = vec2<f32>(textureDimensions(map));
    let crossings = frame.depth_m * dot(abs(uv_per_metre), size);
    let texels = size / max(frame.step_texels, crossings / f32(frame.max_steps));
    let place = start * texels - 0.5 * texels / size;
    let slope = uv_per_metre * texels;
    // Ways up to where the ray meets the next lines, and between lines; a ray along a line never meets another.
    let pitch = 1.0 / max(abs(slope), vec2<f32>(1e-12));
    var line = pitch * select(place - ceil(place) + 1.0, floor(place) + 1.0 - place, slope > vec2<f32>(0.0));
    let way_m = frame.depth_m - from_m;
    var sum = 0.0;
    var low_m = way_m;
    var high_m = 0.0;
    var height_m = 0.0;
    // Height of the cloud's top above the ray.
    var above = sample_periodic(map, repeat, start, 0u).x - from_m;
    for (var i = 0u; i < frame.max_steps + 4u && height_m < way_m; i++) {
        let next_m = min(min(line.x, line.y), way_m);
        let middle_m = 0.5 * (height_m + next_m);
        let middle = sample_periodic(map, repeat, start + uv_per_metre * middle_m, 0u).x - from_m - middle_m;
        let next = sample_periodic(map, repeat, start + uv_per_metre * next_m, 0u).x - from_m - next_m;
        let inside = path_inside(above, middle, next);
        if inside > 0.0 {
            // A ray leaves the piece's cloud at one of its ends, but for a hump or a hollow in the middle.
            let part_m = inside * (next_m - height_m);
            sum += part_m;
            low_m = min(low_m, select(next_m - part_m, height_m, above > 0.0));
            high_m = select(height_m + part_m, next_m, next > 0.0);
        }
        line += select(vec2<f32>(0.0), pitch, line <= vec2<f32>(next_m));
        height_m = next_m;
        above = next;
    }
    return Path(sum / cosine, from_m + min(low_m, high_m), from_m + high_m);
}

// Part of a piece along which a parabola is above 0, given its values at the start, in the middle and at the end.
fn path_inside(first: f32, middle: f32, last: f32) -> f32 {
    let least = min(first, min(middle, last));
    let most = max(first, max(middle, last));
    // a t^2 + b t + first, t from 0 to 1.
    let a = 2.0 * (first + last - 2.0 * middle);
    let b = 4.0 * middle - 3.0 * first - last;
    if abs(a) <= 1e-4 * max(most, -least) {
        return select(select(most / max(most - least, 1e-30), 1.0, least >= 0.0), 0.0, most <= 0.0);
    }
    let inside = b * b - 4.0 * a * first;
    if inside <= 0.0 {
        return select(0.0, 1.0, a > 0.0);
    }
    // The root without cancellation first; the other by their product.
    let q = -0.5 * (b + select(-1.0, 1.0, b >= 0.0) * sqrt(inside));
    let one = q / a;
    let other = select(first / q, one, q == 0.0);
    let between = clamp(max(one, other), 0.0, 1.0) - clamp(min(one, other), 0.0, 1.0);
    return select(between, 1.0 - between, a > 0.0);
}
