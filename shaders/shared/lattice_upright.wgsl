// The same of an upright ray: one column has all of its cloud, with no gap. Uses cloud_lattice.wgsl.

// As of other rays: but for the moment upwards none counts.
fn lattice_within(uv: vec2<f32>, height: f32, towards: vec3<f32>) -> vec3<f32> {
    let cubes = f32(textureDimensions(within).z) / 2.0;
    let z = clamp(height, 0.5, cubes - 0.5);
    return lattice_upwards(textureSampleLevel(within, around, vec3<f32>(uv, (cubes + z) / (2.0 * cubes)), 0.0), towards.z);
}

fn lattice_slab(height: f32, node: f32, along: vec2<f32>) -> vec3<f32> {
    let size = vec2<f32>(textureDimensions(slabs));
    let place = vec2<f32>(height, 0.5 * size.y + node + 0.5) / size;
    return lattice_upwards(textureSampleLevel(slabs, evenly, place, 0.0), along.y);
}

fn lattice_upwards(light: vec4<f32>, up: f32) -> vec3<f32> {
    return lattice_more(light.xzy, light.w * up / max(light.z, LATTICE_DARK));
}

fn sun_reaches(ray: ViewRay, share: vec4<f32>) -> vec3<f32> {
    let lit_by = select(lattice.in_air, vec3<f32>(1.0), ray.from_above);
    if ray.path_m <= 0.0 {
        return lit_by;
    }
    let along = lattice_ray(ray);
    let uv = ray.base_uv + frame.place.offset_uv;
    let column = ray_map(ray, uv);
    let piece = lattice_piece(column, column, vec2<f32>(ray.from_m, ray.from_m + ray.rise_m));
    let ends_m = ray.from_m + ray.rise_m * select(piece.xy, piece.yx, ray.from_above);
    let depth = max(along.per_metre * piece.z * (piece.y - piece.x) * ray.rise_m, 1e-12);
    let kept = lattice.kept.g;
    // What of all light from the ray is scattered along it.
    let whole = -lattice_expm1(-kept * frame.medium.extinction_550 * ray.path_m);
    let before_last = 1.0 - LATTICE_LAST * whole / f32(LATTICE_FEW);
    var since = 0.0;
    var found = vec3<f32>(0.0);
    var slab = vec3<f32>(0.0);
    for (var i = 1u; i <= LATTICE_FEW; i++) {
        let until = -lattice_log1p(vec4<f32>(-whole * min(f32(i) / f32(LATTICE_FEW), before_last))).x / kept;
        let passed = 0.5 * (since + until);
        since = until;
        let height_m = mix(ends_m.x, ends_m.y, min(passed / depth, 1.0));
        let lit = lattice_lit(along, uv, height_m, passed, whole / f32(LATTICE_FEW));
        found += lit.found;
        slab += lit.slab;
    }
    return lit_by * lattice_over_slab(found, slab);
}
