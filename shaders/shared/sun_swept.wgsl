// Light along a ray towards the sun, between those that were swept (sun_sweep). Uses the bindings frame, disc and thickness of the
// pass.
//
// What the rays about a place leave is blended, not the cloud that they meet: at the edge of a cloud the mean of light is right then, however far rays are
// apart, and it is blurred as a disc would. The disc's places lie the closer for it (src/sun_rays.rs).
@group(0) @binding(6) var<storage, read> swept: array<f32>;

// What comes after these.
const SUN_NEXT: u32 = 7u;

fn light_of(place: DiscPlace, base_uv: vec2<f32>) -> vec4<f32> {
    let way = disc.ways[place.direction];
    let size = vec2<f32>(sweep_size(thickness, way));
    let uv = fract(base_uv + frame.place.offset_uv);
    let at = select(uv, uv.yx, way.flipped == 1u) * size - vec2<f32>(0.5 * f32(disc.lines), 0.5);
    // Lines, and starts.
    let line = sweep_wrapped(select(at.x, size.x - 1.0 - at.x, way.backwards == 1u), size.x);
    let along = line * f32(disc.between);
    let start = min(floor(along), size.x * f32(disc.between) - 1.0);
    let across = at.y - way.across * line;
    let low = floor(across);
    let rows = sweep_rows(thickness);
    let first = sweep_number(rows, place.direction, u32(sweep_wrapped(low, size.y)), u32(start));
    let second = sweep_number(rows, place.direction, u32(sweep_wrapped(low + 1.0, size.y)), u32(start));
    let path_m = vec4<f32>(swept[first], swept[first + SWEEP_STRIP], swept[second], swept[second + SWEEP_STRIP]) / (way.per_metre * place.cosine);
    let part = vec2<f32>(along - start, across - low);
    let near = mix(light_after(path_m.x), light_after(path_m.y), part.x);
    let far = mix(light_after(path_m.z), light_after(path_m.w), part.x);
    return mix(near, far, part.y);
}

// Brought to 0 to size. Rounded quotients may be off by one.
fn sweep_wrapped(place: f32, size: f32) -> f32 {
    let within = place - size * floor(place / size);
    return select(select(within, within - size, within >= size), within + size, within < 0.0);
}
