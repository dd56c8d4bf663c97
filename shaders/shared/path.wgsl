// Length of cloud along a ray through the layer, metres.
//
// The ray crosses the base plane at base_uv and climbs along up (unit vector, up.z > 0). Cloud fills base to
// base + thickness, thickness being the bilinear, periodic map. A step counts the overlap of its height range with the
// column at its middle, so that a flat layer is exact with any number of steps.
fn path_in_layer(map: texture_2d<f32>, repeat: sampler, frame: Frame, base_uv: vec2<f32>, up: vec3<f32>) -> f32 {
    let cosine = max(up.z, MIN_COSINE);
    let uv_per_metre = vec2<f32>(up.x, -up.y) / (cosine * frame.extent_m);
    let reach_m = frame.depth_m * length(up.xy) / cosine;
    // Compared as floats: a grazing ray through a thin tile can need more steps than an integer holds.
    let steps = u32(clamp(ceil(reach_m / frame.texel_m), 1.0, f32(frame.max_steps)));
    let step_m = frame.depth_m / f32(steps);
    let start = base_uv + frame.offset_uv;
    var sum = 0.0;
    for (var i = 0u; i < steps; i++) {
        let low_m = f32(i) * step_m;
        let height_m = sample_periodic(map, repeat, start + uv_per_metre * (low_m + 0.5 * step_m), 0u).x;
        sum += clamp(height_m - low_m, 0.0, step_m);
    }
    return sum / cosine;
}
