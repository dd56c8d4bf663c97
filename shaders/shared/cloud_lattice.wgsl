// The sun's light of a layer relative to a slab's under the open sun: by the layer's lattice along the view ray, over the same
// lattice's light in a slab as deep. Both are looked at after the same optical depths, so that what that leaves out drops out: at even shares of the
// light that the ray scatters. Light scattered once is dressed
// with what is scattered forward on its way, as in cumulus. Twin: src/reference/cloud_lattice.rs.
@group(0) @binding(METHOD_NEXT) var<uniform> lattice: LatticeLight;
@group(0) @binding(METHOD_NEXT + 1) var within: texture_3d<f32>;     // green mean radiance, moments along x, y, z; above those red and blue means
@group(0) @binding(METHOD_NEXT + 2) var sun_depths: texture_3d<f32>; // lines by where they pass the base plane, heights
@group(0) @binding(METHOD_NEXT + 3) var slabs: texture_2d<f32>;      // heights, slabs by the root of their depth; below those red and blue means
@group(0) @binding(METHOD_NEXT + 4) var dressed: texture_2d<f32>;    // light scattered once, three colours: angle, path at 550 nm
@group(0) @binding(METHOD_NEXT + 5) var around: sampler;
@group(0) @binding(METHOD_NEXT + 6) var evenly: sampler;

// Parts of a ray that are looked at, at most, and shares of what it scatters up to the end of each but the last; and where few are looked at.
const LATTICE_SAMPLES: u32 = 4u;
const LATTICE_PARTS: vec4<f32> = vec4<f32>(0.25, 0.5, 0.75, 1.0);
const LATTICE_FEW: u32 = 2u;
const LATTICE_FEW_PARTS: vec4<f32> = vec4<f32>(0.5, 1.0, 1.0, 1.0);
// The last ends so much of its share before all is scattered, times what of all light is: in deep cloud it has no end, and its light is scattered about the
// middle of so much.
const LATTICE_LAST: f32 = 0.25;
// A ray's way between clouds beyond which they are looked at by themselves, cubes.
const LATTICE_GAP: f32 = 0.5;
// What a path counts more than its length.
const LATTICE_DETOUR: f32 = 0.005;
const LATTICE_PATH_SCALE: f32 = 0.2;
const LATTICE_PATH_LOG: f32 = 6.39859493; // ln 601
// No mean radiance: the least of a half float.
const LATTICE_DARK: f32 = 6e-8;
// What a slab's light is multiplied with, at most.
const LATTICE_MOST: f32 = 16.0;

// What of the light of a place goes through so much optical depth.
fn lattice_passes(depth: f32, ratio: vec3<f32>) -> vec3<f32> {
    return exp(-lattice.kept * ratio * depth);
}

// With all digits where x is small.
fn lattice_expm1(x: f32) -> f32 {
    return select(exp(x) - 1.0, x * (1.0 + 0.5 * x), abs(x) < 1e-3);
}

fn lattice_log1p(x: vec4<f32>) -> vec4<f32> {
    return select(log(1.0 + x), x * (1.0 - 0.5 * x), abs(x) < vec4<f32>(1e-3));
}

// Light scattered once, by the angle's place in the table and the path to and from where it is.
fn lattice_once(column: f32, path: f32) -> vec3<f32> {
    let rows = f32(textureDimensions(dressed).y);
    let stretched = path * (1.0 + LATTICE_DETOUR * path);
    let v = (log(1.0 + stretched / LATTICE_PATH_SCALE) / LATTICE_PATH_LOG * (rows - 1.0) + 0.5) / rows;
    return textureSampleLevel(dressed, evenly, vec2<f32>(column, v), 0.0).rgb;
}

// What a mean radiance of each colour and the moment against the view, relative to the mean, are as a source of what is scattered
// again.
fn lattice_more(mean: vec3<f32>, moment: f32) -> vec3<f32> {
    return max(mean * (1.0 - lattice.asymmetry * moment), vec3<f32>(0.0));
}

// Mean radiance and moment against the view in the cubes around a place: the source of what is scattered again.
fn lattice_within(uv: vec2<f32>, height: f32, towards: vec3<f32>) -> vec3<f32> {
    let cubes = f32(textureDimensions(within).z) / 2.0;
    let z = clamp(height, 0.5, cubes - 0.5);
    let light = textureSampleLevel(within, around, vec3<f32>(uv, z / (2.0 * cubes)), 0.0);
    let moment = dot(light.yzw, vec3<f32>(towards.x, -towards.y, towards.z)) / max(light.x, LATTICE_DARK);
    if lattice.grey == 1u {
        return lattice_more(light.xxx, moment);
    }
    let others = textureSampleLevel(within, around, vec3<f32>(uv, (cubes + z) / (2.0 * cubes)), 0.0);
    return lattice_more(vec3<f32>(others.x, light.x, others.y), moment);
}

// The same in a slab: height, row of its depth, the view's part along the sun's side and upwards.
fn lattice_slab(height: f32, node: f32, along: vec2<f32>) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(slabs));
    let light = textureSampleLevel(slabs, evenly, vec2<f32>(height, node + 0.5) / size, 0.0);
    let moment = dot(light.yw, along) / max(light.x, LATTICE_DARK);
    if lattice.grey == 1u {
        return lattice_more(light.xxx, moment);
    }
    let others = textureSampleLevel(slabs, evenly, vec2<f32>(height, 0.5 * size.y + node + 0.5) / size, 0.0);
    return lattice_more(vec3<f32>(others.x, light.x, others.y), moment);
}

fn sun_reaches(ray: ViewRay, share: vec4<f32>) -> vec3<f32> {
    let lit = select(lattice.in_air, vec3<f32>(1.0), ray.from_above);
    let cubes = ray_sees_cubes(ray, lattice.cell_m);
    if cubes <= 0.0 {
        return share.rgb;
    }
    if ray.path_m <= 0.0 {
        return lit;
    }
    let sun = frame.sun.towards;
    let towards = -ray.seen;
    let extinction = frame.medium.extinction_550;
    let ratio = frame.medium.extinction / extinction;
    let rise_m = ray.rise_m;
    let way = ray_way(ray, ray.way_uv);
    let start = ray.base_uv + frame.place.offset_uv;
    let per_metre = extinction / ray.cosine;
    let lines = ray_lines(ray, start, ray.way_uv);

    let sun_way = vec2<f32>(sun.x, -sun.y) / (frame.sun.slant_cosine * frame.place.extent_m);
    let angle = 2.0 * atan2(length(towards - sun), length(towards + sun));
    let angles = f32(textureDimensions(dressed).x);
    let column = (sqrt(angle / PI) * (angles - 1.0) + 0.5) / angles;
    let heights = f32(textureDimensions(sun_depths).z);
    let level = length(sun.xy);
    let facing = select(0.0, dot(towards.xy, sun.xy) / max(level, 1e-6), level > 1e-6);
    let all_m = ray.path_m * ray.cosine;
    let rows = f32(textureDimensions(slabs).y / 2u);
    let node = sqrt(min(all_m * extinction / lattice.reach, 1.0)) * (rows - 1.0);

    let kept = lattice.kept.g;
    // What of all light from the ray is scattered along it.
    let whole = -lattice_expm1(-kept * extinction * ray.path_m);
    let few = ray_is_far(ray);
    let samples = select(LATTICE_SAMPLES, LATTICE_FEW, few);
    let shares = select(LATTICE_PARTS, LATTICE_FEW_PARTS, few);
    let before_last = 1.0 - LATTICE_LAST * whole / f32(samples);
    let until = -lattice_log1p(-whole * min(shares, vec4<f32>(before_last))) / kept;
    let since = vec4<f32>(0.0, until.xyz);
    let gap_m = LATTICE_GAP * lattice.cell_m * ray.cosine;
    var near = ray_map(ray, start + select(vec2<f32>(0.0), way, ray.from_above));
    // Cloud and mean heights of the parts: of each step with cloud what lies in them. What a part has beyond a gap is by itself.
    var met = vec4<f32>(0.0);
    var heights_m = vec4<f32>(0.0);
    var met_beyond = vec4<f32>(0.0);
    var beyond_m = vec4<f32>(0.0);
    var beyond = vec4<bool>(false);
    var last_m = 0.0;
    var before = 0.0;
    var step = 0u;
    loop {
        let upper = select(step, lines.count - 1u - step, ray.from_above);
        let parts = vec2<f32>(select(path_part(lines, upper - 1u), 0.0, upper == 0u), path_part(lines, upper));
        let far = ray_map(ray, start + way * select(parts.y, parts.x, ray.from_above));
        let step_m = rise_m * (parts.y - parts.x);
        let low_m = ray.from_m + rise_m * parts.x;
        let piece = lattice_piece(select(near, far, ray.from_above), select(far, near, ray.from_above),
            vec2<f32>(low_m, low_m + step_m));
        near = far;
        let more = per_metre * piece.z * (piece.y - piece.x) * step_m;
        let ends_m = low_m + step_m * select(piece.xy, piece.yx, ray.from_above);
        let first = clamp((since - before) / max(more, 1e-12), vec4<f32>(0.0), vec4<f32>(1.0));
        let last = clamp((until - before) / max(more, 1e-12), vec4<f32>(0.0), vec4<f32>(1.0));
        let weight = more * (last - first);
        let weighted_m = weight * mix(vec4<f32>(ends_m.x), vec4<f32>(ends_m.y), 0.5 * (first + last));
        let gap = more > 0.0 && abs(ends_m.x - last_m) > gap_m;
        beyond = beyond | (vec4<bool>(gap) & (since < vec4<f32>(before)) & (vec4<f32>(before) < until));
        met += select(weight, vec4<f32>(0.0), beyond);
        heights_m += select(weighted_m, vec4<f32>(0.0), beyond);
        met_beyond += select(vec4<f32>(0.0), weight, beyond);
        beyond_m += select(vec4<f32>(0.0), weighted_m, beyond);
        last_m = select(last_m, ends_m.y, more > 0.0);
        before += more;
        step++;
        // Left at its end: software devices run through the body once more where a loop is left at its head.
        continuing {
            break if step >= lines.count || before >= until.w;
        }
    }
    var found = vec3<f32>(0.0);
    var slab = vec3<f32>(0.0);
    // Parts, and what they have beyond gaps.
    var open = met_beyond > vec4<f32>(0.0);
    let count = samples + countOneBits(u32(open.x) | (u32(open.y) << 1u) | (u32(open.z) << 2u) | (u32(open.w) << 3u));
    for (var i = 0u; i < count; i++) {
        let is_beyond = i >= samples;
        let k = select(i, select(select(select(3u, 2u, open.z), 1u, open.y), 0u, open.x), is_beyond);
        open = open & (vec4<bool>(!is_beyond) | (vec4<u32>(0u, 1u, 2u, 3u) != vec4<u32>(k)));
        // By rounding the ray may end before its last part.
        let all = max(met[k] + met_beyond[k], 1e-12);
        let part = select(1.0 - met_beyond[k] / all, met_beyond[k] / all, is_beyond);
        let height_m = select(select(last_m, heights_m[k] / met[k], met[k] > 1e-12), beyond_m[k] / met_beyond[k], is_beyond);
        let uv = start + way * ((height_m - ray.from_m) / rise_m);
        let at = select(since[k] + 0.5 * part * (until[k] - since[k]), until[k] - 0.5 * part * (until[k] - since[k]), is_beyond);
        let passes = lattice_passes(at, ratio);
        // Depth that it stands for.
        let depth = part * whole / (f32(samples) * kept * passes.g);
        let share = depth * lattice.albedo * lattice.kept * ratio * passes;
        let line = vec3<f32>(uv - sun_way * height_m, (height_m / lattice.sun_step_m + 0.5) / heights);
        let sun_depth = max(textureSampleLevel(sun_depths, around, line, 0.0).x, 0.0);
        found += depth * lattice_once(column, at + sun_depth)
            + share * lattice_within(uv, height_m / lattice.cell_m + 1.0, towards);
        // The same place of the slab.
        let passed_m = at / per_metre;
        let slab_m = select(passed_m, max(all_m - passed_m, 0.0), ray.from_above);
        let above = extinction * select(max(all_m - passed_m, 0.0), passed_m, ray.from_above);
        slab += depth * lattice_once(column, at + above / frame.sun.slant_cosine)
            + share * lattice_slab(slab_m / (lattice.density * lattice.cell_m) + 1.0, node, vec2<f32>(facing, towards.z));
    }
    let least = vec3<f32>(1e-12);
    let reaches = lit * select(vec3<f32>(1.0), min(found / max(slab, least), vec3<f32>(LATTICE_MOST)), slab > least);
    return mix(share.rgb, reaches, cubes);
}
