// What a sweep counts of a layer whose columns have bases, tops and extinctions of their own.

// Cloud is counted in so many parts of the way from start to start: whole numbers, whose sums are the same in any order.
const SWEEP_PARTS: f32 = 16384.0;
// Cloud denser than this, relative to the layer's extinction, counts as so dense and as deeper: then the longest ray's sum has a
// number.
const SWEEP_DENSITY: f32 = 16.0;
// Slices of a column whose extinction grows with height, each of one extinction.
const SWEEP_SLICES: u32 = 5u;

// Adds the cloud between the lines i and i + 1, over which its column goes from one to the other.
fn sweep_add(row: Row, i: i32, first: vec4<f32>, other: vec4<f32>, per_metre: f32) {
    let path_m = 0.5 * (first.x + other.x);
    let least_m = path_m / SWEEP_DENSITY;
    let bases = vec2<f32>(first.z, other.z);
    let tops = max(vec2<f32>(first.y, other.y), bases + least_m);
    let deep_m = 0.5 * (tops.x + tops.y - bases.x - bases.y);
    let starts = f32(disc.between) * vec2<f32>(f32(i), f32(i + 1));
    let even = path_m / deep_m * f32(disc.between) * SWEEP_PARTS;
    let slices = select(1u, SWEEP_SLICES, COLUMN_GROWS);
    // What is above the next edge, from the base up.
    var above = 0;
    for (var k = 0u; k <= slices; k++) {
        let parts = vec2<f32>(f32(k), f32(k + 1u)) / f32(slices);
        var weight = even;
        if COLUMN_GROWS {
            weight *= column_growth(min(parts, vec2<f32>(1.0)));
        }
        let counts = select(i32(round(weight)), 0, k == slices);
        sweep_ramp(row, starts - mix(bases, tops, parts.x) * per_metre, above - counts);
        above = counts;
    }
}
