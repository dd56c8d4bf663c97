// What every method of slab light has in common: light of sky, ground and other layers, alpha. Uses the pass's bindings and
// its functions sunlight, slab_reflects and slab_lets_through; and sun_reaches, which says what of it reaches the layer (cloud_share.wgsl, cloud_lattice.wgsl).
//
// A texel is a slab as deep as the view ray's cloud. Light from above and below is even, so by reciprocity its scattered
// part is the plane albedo or transmittance at the view angle. The sun's light is that of a slab under the open sun, times
// what the maps of sunlight say of the place where the view ray meets the cloud.

// What lies before a layer in a texel.
struct Left {
    clear: f32, // what all of it lets through as alpha counts it
    even: f32,  // of even light: more, as what layers scatter forwards goes on to the viewer
    other: f32, // as alpha counts it, what is no layer lets through
    path: f32,  // optical path of transport at 550 nm in the layers
}

// A layer behind others.
struct Shaded {
    light: vec3<f32>, // towards the viewer, as it comes through the layers before
    alpha: f32,       // of the layer
    held: vec2<f32>,  // part of even light from behind that it does not let through; its optical path of transport
}

// `held`: what the layers before hold of even light, what others do, and the path in layers.
fn left_of(clear: f32, held: vec3<f32>) -> Left {
    let together = view.together == 1u;
    return Left(clear, select(clear, 1.0 - held.x, together), select(clear, 1.0 - held.y, together), held.z);
}

fn held_with(before: vec3<f32>, own: vec2<f32>) -> vec3<f32> {
    return before + vec3<f32>((1.0 - before.x) * own.x, 0.0, own.y);
}

fn shade_ray(ray: ViewRay, left: Left) -> Shaded {
    let path = frame.medium.extinction_550 * ray.path_m;
    let clear = exp(-path);
    // With all digits where the cloud is thin: colour may be divided by it.
    let alpha = select(1.0 - clear, path * slab_phi1(vec3<f32>(path)).x, path < 0.3);
    let reflected = slab_reflects(ray);
    let through = slab_lets_through(ray);
    // What is drawn behind comes through as it is, the rest is even.
    var even_clear = clear;
    if view.together == 1u {
        even_clear = min(exp(-frame.medium.forward_550 * path), through.g);
    }
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
        light += frame.sun.irradiance * sun_reaches(ray, share) * added_sunlight(ray, share.w, left);
    }
    return Shaded(light, alpha, vec2<f32>(1.0 - even_clear, frame.medium.transport_550 * path));
}

// Scattered sunlight that the viewer gets because of this layer, per irradiance facing the sun. With the layers above it, which are
// `above` deep for transport towards the sun, it is one slab of its own droplets; without it they are one. From below the
// difference is what it adds to the light of theirs that alpha lets through. From above light goes in by the way to the sun
// and out by the view's: the slab above is as deep as takes both.
fn added_sunlight(ray: ViewRay, above: f32, left: Left) -> vec3<f32> {
    let passing = select(left.clear, left.other, ray.from_above);
    var depth = above / max(frame.medium.transport_550, 1e-6);
    if ray.from_above {
        let in_and_out = vec2<f32>(1.0 / frame.sun.slant_cosine, 1.0 / ray.cosine);
        depth = (depth * in_and_out.x + left.path / max(frame.medium.transport_550, 1e-6)) / (in_and_out.x + in_and_out.y);
    }
    let clear = select(exp(-frame.medium.extinction_550 * ray.path_m), 1.0, ray.from_above);
    // Once where no other layer is above. A loop, as software devices run through what a branch skips.
    let above_it = max(depth, 0.0);
    var added = vec3<f32>(0.0);
    var without = false;
    loop {
        let one = sunlight(deeper(ray, select(ray.depth + above_it, above_it, without)));
        added += select(one, -clear * one, without);
        let last = without || above_it == 0.0;
        without = true;
        continuing {
            break if last;
        }
    }
    return passing * select(added, max(added, vec3<f32>(0.0)), above_it > 0.0);
}
