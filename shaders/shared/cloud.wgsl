// What every method of slab light has in common: light of sky, ground and other layers, alpha. Uses the pass's bindings and
// its function sunlight.
//
// A texel is a slab as deep as the view ray's cloud. Light from above and below is even, so by reciprocity its scattered
// part is the plane albedo or transmittance at the view angle. The sun's light is that of a slab under the open sun, times
// what the maps of sunlight say of the place where the view ray meets the cloud.

// The ray of a texel.
struct ViewRay {
    seen: vec3<f32>,    // towards the viewer
    hit_uv: vec2<f32>,  // where it shows the cloud: mean of what the viewer sees along it
    cosine: f32,        // of its zenith
    path_m: f32,        // length of cloud along it
    depth: f32,         // optical depth of the slab at 550 nm
    from_above: bool,
}

// Light towards the viewer, premultiplied, and alpha.
fn shade_ray(ray: ViewRay) -> vec4<f32> {
    let path = frame.medium.extinction_550 * ray.path_m;
    let clear = exp(-path);
    // With all digits where the cloud is thin: colour may be divided by it.
    let alpha = select(1.0 - clear, path * slab_phi1(vec3<f32>(path)).x, path < 0.3);
    let reflected = slab_reflectance(reflectance, clamped, ray.depth, ray.cosine);
    let through = slab_transmittance(transmittance, clamped, ray.depth, ray.cosine);
    let transmitted = max(through - clear, vec3<f32>(0.0));
    let low = sample_periodic(from_below, repeat, ray.hit_uv, 0u).rgb / PI;
    let high = sample_periodic(from_above, repeat, ray.hit_uv, 0u).rgb / PI;
    var light = select(high * transmitted + low * reflected, high * reflected + low * transmitted, ray.from_above);
    if frame.sun.cosine > 0.0 {
        let share = sample_periodic(sun_share, repeat, ray.hit_uv, 0u).rgb;
        light += frame.sun.irradiance * share * sunlight(ray, through);
    }
    return vec4<f32>(light, alpha);
}
