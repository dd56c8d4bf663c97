// Rays towards one place of the sun from all over a layer's base, in rows: each follows the rays' way over the map, from line to line
// between the texels along the axis on which they go faster. Where a ray crosses such a line the map is linear between two
// texels; from line to line heights are taken to change evenly. Uses the bindings frame and disc of the pass.
struct Sweep {
    size: vec2<i32>,    // texels of the map along the axis and across
    flipped: bool,      // the axis is the second: southwards
    backwards: bool,    // rays go towards smaller texels
    across: f32,        // texels that they go across for each along
    per_metre: f32,     // texels along for each metre of height
}

fn sweep_towards(map: texture_2d<f32>, up: vec3<f32>) -> Sweep {
    let slope = path_slope(frame, up);
    let size = textureDimensions(map) * disc.fine;
    // As a marched ray does: a ray that would be cut too often goes a shorter way.
    let texels = slope * vec2<f32>(size) / max(1.0, path_excess(map, frame, slope));
    let flipped = abs(texels.y) > abs(texels.x);
    let along = select(texels, texels.yx, flipped);
    let per_metre = max(abs(along.x), 1e-9);
    return Sweep(vec2<i32>(select(size, size.yx, flipped)), flipped, along.x < 0.0, along.y / per_metre, per_metre);
}

// First of the numbers of a row. They are those of the lines that it starts from, of one more, where the row is in the next tile, and one
// to which goes what lies beyond.
fn sweep_row(sweep: Sweep, direction: u32, row: u32) -> u32 {
    let most = u32(max(sweep.size.x, sweep.size.y));
    return (direction * most + row) * (most + 2u);
}
