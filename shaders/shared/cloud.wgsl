// What every method of slab light has in common: light of sky, ground and other layers, alpha. Uses the pass's bindings and
// its function sunlight; and sun_reaches, which says what of it reaches the layer (cloud_share.wgsl, cloud_lattice.wgsl).
//
// A texel is a slab as deep as the view ray's cloud. Light from above and below is even, so by reciprocity its scattered
// part is the plane albedo or transmittance at the view angle. The sun's light is that of a slab under the open sun, times
// what the maps of sunlight say of the place where the view ray meets the cloud.

// The ray of a texel.
struct ViewRay {
    seen: vec3<f32>,    // towards the viewer
    hit_uv: vec2<f32>,  // where it shows the cloud: mean of what the viewer sees along it
    base_uv: vec2<f32>, // where it crosses the base plane, or begins within the layer
    cosine: f32,        // of its zenith
    path_m: f32,        // length of cloud along it
    depth: f32,         // optical depth of the slab at 550 nm
    from_above: bool,
}

// What the layers before a texel let through of light that comes from behind them: as alpha counts it, of even light, and of
// the sun's. Of the latter two more, as what they scatter forwards goes on to the viewer.
struct Left {
    clear: f32,
    even: f32,
    sun: f32,
}

// A layer behind others.
struct Shaded {
    light: vec3<f32>, // towards the viewer, as it comes through the layers before
    alpha: f32,       // of the layer
    held: vec2<f32>,  // parts of even light and of the sun's from behind that it does not let through
}

fn left_of(clear: f32, held: vec2<f32>) -> Left {
    let together = view.together == 1u;
    return Left(clear, select(clear, 1.0 - held.x, together), select(clear, 1.0 - held.y, together));
}

fn shade_ray(ray: ViewRay, left: Left) -> Shaded {
    let path = frame.medium.extinction_550 * ray.path_m;
    let clear = exp(-path);
    // With all digits where the cloud is thin: colour may be divided by it.
    let alpha = select(1.0 - clear, path * slab_phi1(vec3<f32>(path)).x, path < 0.3);
    let reflected = slab_reflectance(reflectance, clamped, ray.depth, ray.cosine);
    let through = slab_transmittance(transmittance, clamped, ray.depth, ray.cosine);
    // What is drawn behind comes through as it is, the rest is even.
    var even_clear = clear;
    if view.together == 1u {
        even_clear = min(exp(-frame.medium.forward_550 * path), through.g);
    }
    var sun_clear = even_clear;
    let transmitted = max(through - even_clear, vec3<f32>(0.0));
    let low = sample_periodic(from_below, repeat, ray.hit_uv, 0u).rgb / PI;
    let high = sample_periodic(from_above, repeat, ray.hit_uv, 0u).rgb / PI;
    var light = left.even * select(high * transmitted + low * reflected, high * reflected + low * transmitted, ray.from_above);
    if view.together == 1u {
        // What is composited behind all layers comes through as alpha says, and not as they carry even light on.
        let beyond = sample_periodic(behind, repeat, ray.hit_uv, 0u).rgb / PI;
        light += beyond * (left.clear * alpha - left.even * (1.0 - even_clear));
    }
    if frame.sun.cosine > 0.0 {
        let share = sample_periodic(sun_share, repeat, ray.hit_uv, 0u);
        var lit = 1.0;
        if share.w < 1.0 || view.together == 1u {
            // The nearer to the sun, the less of what the layers above scattered is the sun's light still.
            let part = 1.0 - forward_albedo(ray);
            lit = pow(share.w, max(part / max(frame.medium.forward_550, 1e-6) - 1.0, 0.0));
            sun_clear = min(exp(-part * path), even_clear);
        }
        light += left.sun * lit * (frame.sun.irradiance * sun_reaches(ray, share) * sunlight(ray, through));
    }
    return Shaded(light, alpha, 1.0 - vec2<f32>(even_clear, sun_clear));
}

// Part of extinction at 550 nm after which light still counts as the sun's for a view.
fn forward_albedo(ray: ViewRay) -> f32 {
    let half_sin = min(0.5 * length(ray.seen + frame.sun.towards), 1.0);
    let half_cos = min(0.5 * length(ray.seen - frame.sun.towards), 1.0);
    let row = (PHASE_ROWS - 0.5) / PHASE_ROWS;
    return sample_clamped(phase, clamped, vec2<f32>(phase_coordinate(half_sin, half_cos), row)).w;
}
