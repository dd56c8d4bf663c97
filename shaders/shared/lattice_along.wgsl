// A ray through the cubes of a layer's lattice: even shares of what it scatters are looked at where clouds have them. Uses cloud_lattice.wgsl.

// Shares of what a ray scatters up to the end of each part but the last; and where few are looked at.
const LATTICE_PARTS: vec4<f32> = vec4<f32>(0.25, 0.5, 0.75, 1.0);
const LATTICE_FEW_PARTS: vec4<f32> = vec4<f32>(0.5, 1.0, 1.0, 1.0);
// A ray's way between clouds beyond which they are looked at by themselves, cubes.
const LATTICE_GAP: f32 = 0.5;

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
    let lit_by = select(lattice.in_air, vec3<f32>(1.0), ray.from_above);
    let cubes = ray_sees_cubes(ray, lattice.cell_m);
    if cubes <= 0.0 {
        return share.rgb;
    }
    if ray.path_m <= 0.0 {
        return lit_by;
    }
    let along = lattice_ray(ray);
    let rise_m = ray.rise_m;
    let way = ray_way(ray, ray.way_uv);
    let start = ray.base_uv + frame.place.offset_uv;
    let lines = ray_lines(ray, start, ray.way_uv);

    let kept = lattice.kept.g;
    // What of all light from the ray is scattered along it.
    let whole = -lattice_expm1(-kept * frame.medium.extinction_550 * ray.path_m);
    let few = ray_takes_few(ray);
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
        let more = along.per_metre * piece.z * (piece.y - piece.x) * step_m;
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
        let lit = lattice_lit(along, uv, height_m, at, part * whole / f32(samples));
        found += lit.found;
        slab += lit.slab;
    }
    let reaches = lit_by * lattice_over_slab(found, slab);
    return mix(share.rgb, reaches, cubes);
}
