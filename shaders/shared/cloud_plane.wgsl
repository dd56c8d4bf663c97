// Texels of the texture cloud: rays of a plane over the domain. Uses the bindings of the method's file and shade_ray.

alias CloudView = View;

@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var bounds: texture_2d<f32>;

const PATH_SEEN: bool = true;
// The method's own bindings begin here.
const METHOD_BINDING: u32 = 14u;

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
    return ViewRay(seen, hit_uv, base_uv, cosine, path.length_m, depth, from_above);
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
    let shaded = shade_ray(view_ray(pixel), left_of(1.0 - before.a, held_before));
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
