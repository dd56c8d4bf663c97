// What a sweep counts of a layer over a flat base.

// Cloud is counted in so many parts of a texel along: whole numbers, whose sums are the same in any order.
const SWEEP_PARTS: f32 = 65536.0;

// Adds the cloud between the lines i and i + 1, over which its column goes from one to the other.
fn sweep_add(row: u32, last: i32, i: i32, first: vec4<f32>, other: vec4<f32>, per_metre: f32) {
    let seen_from = vec2<f32>(f32(i), f32(i + 1)) - vec2<f32>(first.x, other.x) * per_metre;
    sweep_ramp(row, last, seen_from, i32(SWEEP_PARTS));
    // No ray that starts beyond it meets it.
    sweep_count(row, last, i + 1, -i32(SWEEP_PARTS));
    sweep_count(row, last, i + 2, i32(SWEEP_PARTS));
}
