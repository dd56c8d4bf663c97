// Texels of the texture sky: clouds along rays from an eye over a curved Earth. Uses the bindings of the method's file and
// shade_ray. A pass shades one layer on the part of each ray that sinks, or on the part that rises; passes come in the order
// in which a ray meets them.
//
// A texel is a cone. Where it is wider than a texel of the thickness map, that map's coarser levels are looked at; where it is
// longer over the ground than a few texels, several of its rays are. Of plain tiles (src/shade/tiles.rs) the host knows that one ray is
// enough of each texel, and that the sun is far: SKY_PLAIN is a constant of each shader, as software devices run through all that a branch skips.

alias CloudView = SkyView;

@group(0) @binding(2) var levels: texture_2d<f32>; // thickness, with mip levels
@group(0) @binding(3) var trilinear: sampler;
@group(0) @binding(14) var<storage, read> tiles: array<u32>;
@group(0) @binding(15) var air: texture_2d<f32>; // between the eye and the layer
@group(0) @binding(16) var<uniform> air_colours: AirColours;
// The method's own bindings begin here.
const METHOD_BINDING: u32 = 17u;
// Samples along a ray through the layer, at most.
const PATH_MOST_STEPS: f32 = 1024.0;

// Level of the map from which on few places along a ray are enough.
const LATTICE_FAR_LEVEL: f32 = 0.5;

// Nothing behind is seen through more than this.
const SKY_OPAQUE: f32 = 0.9998;

// The part of a ray that lies in the layer.
struct Crossing {
    near_m: f32,  // distances from the eye
    far_m: f32,
    near_z: f32,  // heights there
    far_z: f32,
    meets: bool,
}

fn sky_crossing(direction: vec3<f32>) -> Crossing {
    let h_m = view.eye.z;
    let base_m = frame.place.base_m;
    let top_m = base_m + frame.place.depth_m;
    let lowest = lowest_m(h_m, direction.z);
    let low_m = max(lowest, 0.0);
    let turns_inside = lowest > base_m;
    let turn_m = lowest_distance(h_m, direction.z);
    if view.rising == 0u {
        // From the eye down to the lowest point.
        let near_z = min(h_m, top_m);
        let far_z = max(base_m, low_m);
        let meets = direction.z < 0.0 && near_z > far_z;
        let far_m = select(sinking_distance(h_m, direction.z, far_z), turn_m, turns_inside);
        return Crossing(sinking_distance(h_m, direction.z, near_z), far_m, near_z, far_z, meets);
    }
    // From the lowest point up, if it is not in the ground.
    let near_z = max(base_m, low_m);
    let meets = near_z < top_m && (direction.z >= 0.0 || low_m > 0.0);
    let near_m = select(rising_distance(h_m, direction.z, near_z), turn_m, turns_inside);
    return Crossing(near_m, rising_distance(h_m, direction.z, top_m), near_z, top_m, meets);
}

fn sky_ray(direction: vec3<f32>, crossing: Crossing, level: f32, steps: f32) -> ViewRay {
    let h_m = view.eye.z;
    let from_above = view.rising == 0u;
    // The chord from the low end to the high one.
    let along = direction.xy / max(length(direction.xy), 1e-12);
    let near_way = ground_way(h_m, direction, crossing.near_m);
    let far_way = ground_way(h_m, direction, crossing.far_m);
    let low_way = select(near_way, far_way, from_above);
    let run_m = select(far_way - near_way, near_way - far_way, from_above);
    let rise_m = max(abs(crossing.far_z - crossing.near_z), LEAST_RISE_M);
    let up = normalize(vec3<f32>(along * run_m, rise_m));
    let cosine = clamp(up.z, MIN_COSINE, 1.0);
    let from_m = min(crossing.near_z, crossing.far_z) - frame.place.base_m;
    // Both its ends drift: so what stands upright does so on the map.
    let extent_m = frame.place.extent_m;
    let low_place = view.eye.xy + along * low_way;
    let low_drift_m = drift_m(view, extent_m, low_place);
    let drawn_m = drift_m(view, extent_m, low_place + along * run_m) - low_drift_m;
    let start_uv = domain_uv(low_place + low_drift_m, extent_m);
    // Over the map; not of unit length.
    let over = up + vec3<f32>(drawn_m * (cosine / rise_m), 0.0);
    let path = path_sampled(levels, trilinear, level, frame, start_uv, over, from_m, rise_m, steps);
    let climbed_m = select(path.low_m, path.high_m, from_above) / cosine;
    let hit_uv = start_uv + vec2<f32>(over.x, -over.y) * (climbed_m / extent_m);
    let way_uv = vec2<f32>(over.x, -over.y) * (rise_m / (cosine * extent_m));
    let depth = frame.medium.extinction_550 * path.length_m * cosine;
    let seen = select(-up, up, from_above);
    return ViewRay(seen, hit_uv, start_uv, cosine, path.length_m, depth, from_above, from_m, rise_m, way_uv, level, steps);
}

// Of the layer's map what a ray meets at a place, offset by the wind.
fn ray_map(ray: ViewRay, uv: vec2<f32>) -> vec4<f32> {
    return sample_level(levels, trilinear, uv, ray.level);
}

// The way over the map of a ray that goes straight on by way_uv.
fn ray_way(ray: ViewRay, way_uv: vec2<f32>) -> vec2<f32> {
    return way_uv;
}

// Steps from line to line, as of path_sampled.
fn ray_lines(ray: ViewRay, start: vec2<f32>, way_uv: vec2<f32>) -> PathLines {
    return path_lines(levels, ray.level, start, way_uv, ray.steps);
}

// How much the light of cubes of the lattice counts, and not its means over them: from below less from where a texel is as wide as a cube, none
// where it is as wide as four. Cubes and coarse levels of the map do not know each other's gaps. From above means are worse.
fn ray_sees_cubes(ray: ViewRay, cell_m: f32) -> f32 {
    let texels = textureDimensions(levels);
    let cube = max(log2(cell_m * f32(max(texels.x, texels.y)) / frame.place.extent_m), 0.0);
    return select(clamp(1.0 - 0.5 * (ray.level - cube), 0.0, 1.0), 1.0, ray.from_above);
}

// Whether few places along a ray are enough: of one of several of a texel, and of one that sees no more than a texel of the map.
fn ray_takes_few(ray: ViewRay) -> bool {
    return ray.level > LATTICE_FAR_LEVEL || ray.steps < view.steps;
}

// The host lists the tiles of the picture that may show the layer: software devices run through all that a branch skips.
fn cloud_texel(invocation: vec2<u32>) {
    let pixel = sky_pixel(tiles[invocation.x / SKY_TILE], vec2<u32>(invocation.x % SKY_TILE, invocation.y));
    if pixel.x >= view.size.x || pixel.y >= view.rows {
        return;
    }
    let texel = pixel.y * view.size.x + pixel.x;
    let at = 4u * texel;
    let before = vec4<f32>(output[at], output[at + 1u], output[at + 2u], output[at + 3u]);
    var held_before = vec3<f32>(1.0, 1.0, 0.0);
    if view.together == 1u {
        held_before = held[texel];
    }
    if min(before.a, held_before.x) >= SKY_OPAQUE {
        return;
    }
    let shaded = sky_texel(vec2<f32>(pixel + vec2<u32>(0u, view.first_row)) + 0.5, left_of(1.0 - before.a, held_before));
    // Below 0 by rounding, and by what the air before one layer takes more than before another.
    let light = max(before.rgb + shaded.light, vec3<f32>(0.0));
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = before.a + (1.0 - before.a) * shaded.alpha;
    if view.together == 1u {
        held[texel] = held_with(held_before, shaded.held);
    }
}

fn sky_texel(middle: vec2<f32>, left: Left) -> Shaded {
    let direction = sphere_direction(view, middle);
    if dot(direction, direction) == 0.0 {
        return Shaded(vec3<f32>(0.0), 0.0, vec2<f32>(0.0));
    }
    let cone = sphere_cone(view, direction);
    let crossing = sky_crossing(direction);
    // How much of the thickness map the texel covers, along the ray.
    let size = textureDimensions(levels);
    let per_metre = f32(max(size.x, size.y)) / frame.place.extent_m;
    let far = crossing.near_m * per_metre;
    let along = far * cone.rise / max(abs(cosine_at(view.eye.z, direction.z, crossing.near_m, crossing.near_z)), 1e-3);
    var rays = u32(clamp(ceil(along / view.texels_per_ray), 1.0, f32(view.rays)));
    // Some of the texel may meet the layer where its middle does not.
    let edge = abs(direction.z - view.edge) < cone.rise;
    rays = select(select(0u, select(rays, 1u, SKY_PLAIN), crossing.meets), view.rays, edge && !SKY_PLAIN);
    // What one of many rays misses another finds.
    let steps = view.steps / sqrt(f32(max(rays, 1u)));
    var sum = vec4<f32>(0.0);
    var held_sum = vec2<f32>(0.0);
    // Left at its end: software devices run through the body once more where a loop is left at its head.
    var i = 0u;
    loop {
        var towards = direction;
        var met = crossing;
        if !SKY_PLAIN && rays > 1u {
            towards = scattered_direction(view, middle, direction, i);
            met = sky_crossing(towards);
        }
        if met.meets && i < rays {
            // And across it. Of each ray: the texel's middle may miss the layer.
            let level = view.coarseness + log2(max(met.near_m * per_metre * cone.side, 1e-6));
            let coarse = clamp(level, 0.0, f32(textureNumLevels(levels)) - 1.0);
            let shaded = shade_ray(sky_ray(towards, met, coarse, steps), left);
            sum += vec4<f32>(shaded.light, shaded.alpha);
            held_sum += shaded.held;
        }
        continuing {
            i++;
            break if SKY_PLAIN || i >= rays;
        }
    }
    let count = max(f32(rays), 1.0);
    let cloud = sum / count;
    let before = air_light(air, clamped, direction, frame.sun.towards, view.horizon, view.rising == 0u);
    let light = cloud.rgb * before.through + left.clear * cloud.a * before.light;
    return Shaded(light, cloud.a, held_sum / count);
}
