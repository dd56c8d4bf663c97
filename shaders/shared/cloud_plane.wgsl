// Texels of the texture cloud: rays of a plane over the domain. Uses the bindings of the method's file and shade_ray.

alias CloudView = View;

@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var bounds: texture_2d<f32>;

const PATH_SEEN: bool = true;
// The method's own bindings begin here.
const METHOD_BINDING: u32 = 14u;

// Rays of a texel, at most; and the slope from which there are more where texels are as wide as the map's, one for each such
// slope beyond it. Views close to the horizon show clouds' edges one behind the other, finer than any texel; steeper ones are points.
const VIEW_MOST_RAYS: f32 = 8.0;
const VIEW_RAY_SLOPE: f32 = 8.0;
// Places of a texel's rays (SKY_SCATTER in sphere.wgsl).
const VIEW_SCATTER: vec2<f32> = vec2<f32>(0.75487767, 0.56984029);

fn view_ray(ray: Ray) -> ViewRay {
    let from_above = view.from_above == 1u;
    let position = ray.position;
    let seen = ray.seen;
    // The view ray, climbing through the layer.
    let up = select(-seen, seen, from_above);
    let cosine = clamp(up.z, MIN_COSINE, 1.0);
    let base_uv = domain_uv(position.xy + up.xy / cosine * (frame.place.base_m - view.plane_m), frame.place.extent_m);
    let path = path_seen(thickness, bounds, repeat, frame, base_uv, up, from_above);
    let depth = frame.medium.extinction_550 * path.length_m * cosine;
    return ViewRay(seen, path.hit_uv, base_uv, cosine, path.length_m, depth, from_above);
}

fn view_rays(ray: Ray) -> u32 {
    let slope = length(ray.seen.xy) / max(abs(ray.seen.z), MIN_COSINE);
    let map = textureDimensions(thickness);
    let across = f32(max(map.x, map.y)) / f32(max(view.size.x, view.size.y));
    return u32(clamp(ceil(max(slope / VIEW_RAY_SLOPE - 1.0, 0.0) * across), 1.0, VIEW_MOST_RAYS));
}

fn plane_texel(pixel: vec2<u32>, left: Left) -> Shaded {
    let middle = texel_place(view, pixel);
    let ray = projection_ray_at(view, frame.place.extent_m, middle);
    let rays = view_rays(ray);
    var sum = Shaded(vec3<f32>(0.0), 0.0, vec2<f32>(0.0));
    for (var i = 0u; i < rays; i++) {
        let inside = select(vec2<f32>(0.0), fract((f32(i) + 0.5) * VIEW_SCATTER) - 0.5, rays > 1u);
        let one = projection_ray_at(view, frame.place.extent_m, middle + inside / vec2<f32>(view.size));
        let shaded = shade_ray(view_ray(one), left);
        sum = Shaded(sum.light + shaded.light, sum.alpha + shaded.alpha, sum.held + shaded.held);
    }
    let count = f32(rays);
    return Shaded(sum.light / count, sum.alpha / count, sum.held / count);
}

fn cloud_texel(pixel: vec2<u32>) {
    if pixel.x >= view.size.x || pixel.y >= view.rows {
        return;
    }
    let texel = pixel.y * view.size.x + pixel.x;
    let at = 4u * texel;
    var before = vec4<f32>(0.0);
    var held_before = vec3<f32>(0.0);
    if view.first == 0u {
        before = vec4<f32>(output[at], output[at + 1u], output[at + 2u], output[at + 3u]);
        if view.together == 1u {
            held_before = held[texel];
        }
    }
    // Layers are drawn from the viewer on.
    let shaded = plane_texel(pixel, left_of(1.0 - before.a, held_before));
    // Below 0 by rounding alone: layers give and take what is composited behind them.
    let light = max(before.rgb + shaded.light, vec3<f32>(0.0));
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = before.a + (1.0 - before.a) * shaded.alpha;
    if view.together == 1u {
        held[texel] = held_with(held_before, shaded.held);
    }
}
