// Rays towards one place of the sun from all over a layer's base, in rows: each follows the rays' way over the map, from line to line across
// the axis along which they go faster. A row looks at the columns where it crosses a line, where the map is linear between texels; from line to
// line heights are taken to change evenly. Uses the binding disc of the pass.

// Rows whose numbers are side by side: a line of a cache.
const SWEEP_STRIP: u32 = 16u;

// Lines along a row, and rows.
fn sweep_size(map: texture_2d<f32>, way: DiscWay) -> vec2<i32> {
    let size = textureDimensions(map);
    return vec2<i32>(select(size, size.yx, way.flipped == 1u) * vec2<u32>(disc.lines, disc.fine));
}

// Where the number of a start is. A row has those of the rays that start in it, of one more, where the row is in the next tile, and one
// to which goes what lies beyond. Those of a strip of rows are side by side, as invocations are, then come those of the next start: what a strip of
// invocations adds to lies close together in memory.
fn sweep_number(rows: u32, direction: u32, row: u32, start: u32) -> u32 {
    return (direction * rows + row / SWEEP_STRIP * SWEEP_STRIP) * disc.row_numbers + start * SWEEP_STRIP + row % SWEEP_STRIP;
}

// Rows of each direction that are kept: whole strips.
fn sweep_rows(map: texture_2d<f32>) -> u32 {
    let size = textureDimensions(map);
    return (disc.fine * max(size.x, size.y) + SWEEP_STRIP - 1u) / SWEEP_STRIP * SWEEP_STRIP;
}
