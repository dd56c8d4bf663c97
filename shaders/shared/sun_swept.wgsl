// Cloud along a ray towards the sun, between those that were swept (sun_sweep). Uses the bindings frame, disc and thickness of the
// pass.
@group(0) @binding(9) var<storage, read> swept: array<f32>;

// Height crossed in cloud of the layer's extinction.
fn height_to_sun(direction: u32, base_uv: vec2<f32>) -> f32 {
    let sweep = sweep_towards(thickness, disc.towards[direction].xyz);
    let texels = fract(base_uv + frame.place.offset_uv) * vec2<f32>(textureDimensions(thickness) * disc.fine) - 0.5;
    let place = select(texels, texels.yx, sweep.flipped);
    let length = f32(sweep.size.x);
    let along = (select(place.x, length - 1.0 - place.x, sweep.backwards) + length) % length;
    let line = min(floor(along), length - 1.0);
    let across = place.y - sweep.across * along;
    let low = floor(across);
    let rows = vec2<i32>(i32(low), i32(low) + 1) % sweep.size.y;
    let row = vec2<u32>(select(rows, rows + sweep.size.y, rows < vec2<i32>(0)));
    let first = sweep_row(sweep, direction, row.x) + u32(line);
    let second = sweep_row(sweep, direction, row.y) + u32(line);
    let here = vec2<f32>(swept[first], swept[second]);
    let next = vec2<f32>(swept[first + 1u], swept[second + 1u]);
    let between = mix(here, next, along - line);
    return mix(between.x, between.y, across - low) / sweep.per_metre;
}
