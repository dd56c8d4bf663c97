// What every method of the cloud pass has in common: the view ray, light of sky and ground, alpha. Uses the pass's
// bindings and its function sunlight.
//
// A texel is a slab as deep as the view ray's cloud. Light of sky and ground is even, so by reciprocity its scattered
// part is the plane albedo or transmittance at the view angle.

// The ray of a texel.
struct ViewRay {
    seen: vec3<f32>,    // towards the viewer
    base_uv: vec2<f32>, // where it crosses the cloud base
    cosine: f32,        // of its zenith
    path_m: f32,        // length of cloud along it
    depth: f32,         // optical depth of the slab at 550 nm
    from_above: bool,
}

fn view_ray(pixel: vec2<u32>) -> ViewRay {
    let place = (vec2<f32>(f32(pixel.x), f32(pixel.y + view.first_row)) + 0.5) / f32(view.size) - 0.5;
    let from_above = view.from_above == 1u;
    let plane_m = select(frame.base_m, view.top_m, from_above);
    let position = vec3<f32>(vec2<f32>(place.x, -place.y) * frame.extent_m, plane_m);
    let to_eye = view.eye.xyz - position;
    let seen = select(view.towards.xyz, to_eye / max(length(to_eye), 1e-6), view.towards.w > 0.5);
    // The view ray, climbing through the layer.
    let up = select(-seen, seen, from_above);
    let cosine = clamp(up.z, MIN_COSINE, 1.0);
    let sunk_m = select(0.0, view.top_m - frame.base_m, from_above);
    let base_uv = domain_uv(position.xy - up.xy / cosine * sunk_m, frame.extent_m);
    let path_m = path_in_layer(thickness, repeat, frame, base_uv, up);
    let depth = frame.extinction.w * path_m * cosine;
    return ViewRay(seen, base_uv, cosine, path_m, depth, from_above);
}

fn cloud_texel(pixel: vec2<u32>) {
    let ray = view_ray(pixel);
    let path = frame.extinction.w * ray.path_m;
    let clear = exp(-path);
    // With all digits where the cloud is thin: colour may be divided by it.
    let alpha = select(1.0 - clear, path * slab_phi1(vec3<f32>(path)).x, path < 0.3);
    let reflected = slab_reflectance(reflectance, clamped, ray.depth, ray.cosine);
    let through = slab_transmittance(transmittance, clamped, ray.depth, ray.cosine);
    let transmitted = max(through - clear, vec3<f32>(0.0));
    let ground = sample_periodic(upwelling, repeat, ray.base_uv, 0u).rgb / PI;
    var light = select(frame.sky_light.rgb * transmitted + ground * reflected,
        frame.sky_light.rgb * reflected + ground * transmitted, ray.from_above);
    if frame.sun_light.w > 0.0 {
        light += frame.sun_light.rgb * sunlight(ray, through);
    }
    let at = 4u * (pixel.y * view.size + pixel.x);
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = alpha;
}
