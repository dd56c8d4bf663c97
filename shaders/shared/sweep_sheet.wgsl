// What a sweep counts of a layer over a flat base.

// Cloud is counted in so many parts of the way from start to start: whole numbers, whose sums are the same in any order.
const SWEEP_PARTS: f32 = 65536.0;

// Adds the cloud between the lines i and i + 1, over which its column goes from one to the other.
fn sweep_add(row: Row, i: i32, first: vec4<f32>, other: vec4<f32>, per_metre: f32) {
    let between = i32(disc.between);
    let start = i * between;
    let seen_from = vec2<f32>(f32(start), f32(start + between)) - vec2<f32>(first.x, other.x) * per_metre;
    sweep_ramp(row, seen_from, between * i32(SWEEP_PARTS));
    // Rays that start within it meet what remains of it, those beyond nothing.
    sweep_count(row, start + 1, -i32(SWEEP_PARTS));
    sweep_count(row, start + between + 1, i32(SWEEP_PARTS));
}
