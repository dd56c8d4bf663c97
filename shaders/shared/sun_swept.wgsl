// Cloud along a ray towards the sun, between those that were swept (sun_sweep). Uses the bindings frame, disc and thickness of the
// pass.
@group(0) @binding(9) var<storage, read> swept: array<f32>;

// Height crossed in cloud of the layer's extinction.
fn height_to_sun(direction: u32, base_uv: vec2<f32>) -> f32 {
    let way = disc.ways[direction];
    let size = vec2<f32>(sweep_size(thickness, way));
    let uv = fract(base_uv + frame.place.offset_uv);
    let place = select(uv, uv.yx, way.flipped == 1u) * size - vec2<f32>(0.5 * f32(disc.lines), 0.5);
    // Lines, and starts.
    let line = sweep_wrapped(select(place.x, size.x - 1.0 - place.x, way.backwards == 1u), size.x);
    let along = line * f32(disc.between);
    let start = min(floor(along), size.x * f32(disc.between) - 1.0);
    let across = place.y - way.across * line;
    let low = floor(across);
    let rows = sweep_rows(thickness);
    let first = sweep_row(rows, direction, u32(sweep_wrapped(low, size.y))) + u32(start);
    let second = sweep_row(rows, direction, u32(sweep_wrapped(low + 1.0, size.y))) + u32(start);
    let here = vec2<f32>(swept[first], swept[second]);
    let next = vec2<f32>(swept[first + 1u], swept[second + 1u]);
    let between = mix(here, next, along - start);
    return mix(between.x, between.y, across - low) / way.per_metre;
}

// Brought to 0 to size. Rounded quotients may be off by one.
fn sweep_wrapped(place: f32, size: f32) -> f32 {
    let within = place - size * floor(place / size);
    return select(select(within, within - size, within >= size), within + size, within < 0.0);
}
