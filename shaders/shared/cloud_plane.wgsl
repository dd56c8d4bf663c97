// Texels of the texture cloud: rays of a plane over the domain. Uses the bindings of the method's file and shade_ray.

alias CloudView = View;

// What a ray meets.
struct Seen {
    length_m: f32,     // of cloud of the layer's extinction
    hit_uv: vec2<f32>, // mean place of what the viewer sees
}

// Way over the map for each metre of height from which a ray is flat.
const FLAT_SLOPE: f32 = 8.0;
// Steps of a ray to the light of a lattice, at most.
const RAY_MOST_STEPS: f32 = 256.0;
// The method's own bindings begin here.
const METHOD_BINDING: u32 = 14u;

// Samples along the rest of a flat ray, at most.
const PATH_MOST_STEPS: f32 = 1024.0;
// Rays of a texel, at most; and the slope from which on each texel of the map has one: flat views show the edges of clouds one behind
// the other. Steeper ones are points.
const VIEW_MOST_RAYS: f32 = 8.0;
const VIEW_RAY_SLOPE: f32 = 60.0;
// How far those of a parallel view lie beside even places, texels of the map: at its texels and half-way between them clouds are not like the
// mean, and all texels of such a view may lie alike.
const VIEW_ASIDE: f32 = 0.25;

fn view_ray(ray: Ray) -> ViewRay {
    let from_above = view.from_above == 1u;
    let position = ray.position;
    let seen = ray.seen;
    // The view ray, climbing through the layer.
    let up = select(-seen, seen, from_above);
    let cosine = clamp(up.z, MIN_COSINE, 1.0);
    let base_uv = domain_uv(position.xy + up.xy / cosine * (frame.place.base_m - view.plane_m), frame.place.extent_m);
    let path = path_seen(base_uv, up, from_above);
    let depth = frame.medium.extinction_550 * path.length_m * cosine;
    let way_uv = vec2<f32>(up.x, -up.y) * (frame.place.depth_m / (cosine * frame.place.extent_m));
    return ViewRay(seen, path.hit_uv, base_uv, cosine, path.length_m, depth, from_above, 0.0, frame.place.depth_m, way_uv, 0.0, 1.0);
}

// Of the layer's map what a ray meets at a place, offset by the wind.
fn ray_map(ray: ViewRay, uv: vec2<f32>) -> vec4<f32> {
    return sample_periodic(thickness, repeat, uv, 0u);
}

// The way over the map of a ray that goes straight on by way_uv: close to the horizon a shorter one stands for it, as in path_seen.
fn ray_way(ray: ViewRay, way_uv: vec2<f32>) -> vec2<f32> {
    return way_uv / max(ray_crosses(way_uv) / RAY_MOST_STEPS, 1.0);
}

// Steps of a texel.
fn ray_lines(ray: ViewRay, start: vec2<f32>, way_uv: vec2<f32>) -> PathLines {
    let count = clamp(ceil(ray_crosses(way_uv)), 1.0, RAY_MOST_STEPS);
    return PathLines(1.0 / count, 1.0 / count, u32(count));
}

// Texels of the map that a way crosses.
fn ray_crosses(way_uv: vec2<f32>) -> f32 {
    let texels = textureDimensions(thickness);
    return length(way_uv) * f32(max(texels.x, texels.y));
}

// How much the light of cubes of the lattice counts, and not its means over them.
fn ray_sees_cubes(ray: ViewRay, cell_m: f32) -> f32 {
    return 1.0;
}

// Cosine of a parallel view's zenith from which on few places along a ray are enough.
const LATTICE_STEEP: f32 = 0.7;

// Whether few places along a ray are enough. Of an eye's view no ray, as a ring would show where it is.
fn ray_takes_few(ray: ViewRay) -> bool {
    return view.perspective == 0u && ray.cosine > LATTICE_STEEP;
}

// Texels of the map that one of the picture is as wide as.
fn view_across() -> f32 {
    let map = textureDimensions(thickness);
    return f32(max(map.x, map.y)) / f32(max(view.size.x, view.size.y));
}

fn plane_texel(pixel: vec2<u32>, left: Left) -> Shaded {
    let middle = texel_place(view, pixel);
    let ray = projection_ray_at(view, frame.place.extent_m, middle);
    let slope = length(ray.seen.xy) / max(abs(ray.seen.z), MIN_COSINE);
    let flat = slope > FLAT_SLOPE;
    let across = view_across();
    let wanted = ceil(across * min(slope / VIEW_RAY_SLOPE, 1.0));
    let rays = select(1u, u32(clamp(wanted, 1.0, VIEW_MOST_RAYS)), flat);
    // Beside each other: along the view a flat ray shows the same for many texels.
    let beside = vec2<f32>(ray.seen.y, ray.seen.x) / max(length(ray.seen.xy), 1e-12) / vec2<f32>(view.size);
    let aside = select(0.0, VIEW_ASIDE / across, flat && view.perspective == 0u) - 0.5;
    var sum = Shaded(vec3<f32>(0.0), 0.0, vec2<f32>(0.0));
    var i = 0u;
    // Left at its end: software devices run through the body once more where a loop is left at its head.
    loop {
        let one = projection_ray_at(view, frame.place.extent_m, middle + beside * ((f32(i) + 0.5) / f32(rays) + aside));
        let shaded = shade_ray(view_ray(one), left);
        sum = Shaded(sum.light + shaded.light, sum.alpha + shaded.alpha, sum.held + shaded.held);
        continuing {
            i++;
            break if i >= rays;
        }
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
