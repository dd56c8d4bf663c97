// What every method of the cloud pass has in common: the view ray, light of sky, ground and other layers, alpha. Uses the
// pass's bindings and its function sunlight.
//
// A texel is a slab as deep as the view ray's cloud. Light from above and below is even, so by reciprocity its scattered
// part is the plane albedo or transmittance at the view angle. The sun's light is that of a slab under the open sun, times
// what the maps of sunlight say of the place where the view ray meets the cloud.

const PATH_SEEN: bool = true;

// The ray of a texel.
struct ViewRay {
    seen: vec3<f32>,    // towards the viewer
    hit_uv: vec2<f32>,  // where it shows the cloud: mean of what the viewer sees along it
    cosine: f32,        // of its zenith
    path_m: f32,        // length of cloud along it
    depth: f32,         // optical depth of the slab at 550 nm
    from_above: bool,
}

fn view_ray(pixel: vec2<u32>) -> ViewRay {
    let from_above = view.from_above == 1u;
    let ray = projection_ray(view, frame.place.extent_m, pixel);
    let position = ray.position;
    let seen = ray.seen;
    // The view ray, climbing through the layer.
    let up = select(-seen, seen, from_above);
    let cosine = clamp(up.z, MIN_COSINE, 1.0);
    let base_uv = domain_uv(position.xy + up.xy / cosine * (frame.place.base_m - view.plane_m), frame.place.extent_m);
    let path = path_in_layer(thickness, bounds, repeat, frame, base_uv, up);
    let climbed_m = select(path.low_m, path.high_m, from_above) / cosine;
    let hit_uv = base_uv + vec2<f32>(up.x, -up.y) * (climbed_m / frame.place.extent_m);
    let depth = frame.medium.extinction_550 * path.length_m * cosine;
    return ViewRay(seen, hit_uv, cosine, path.length_m, depth, from_above);
}

fn cloud_texel(pixel: vec2<u32>) {
    let ray = view_ray(pixel);
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
    let at = 4u * (pixel.y * view.size.x + pixel.x);
    var before = vec4<f32>(0.0);
    if view.first == 0u {
        before = vec4<f32>(output[at], output[at + 1u], output[at + 2u], output[at + 3u]);
    }
    // Layers are drawn from the viewer on.
    light = before.rgb + (1.0 - before.a) * light;
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = before.a + (1.0 - before.a) * alpha;
}
