// Tries what the other passes rely on.
@group(0) @binding(0) var pixels: texture_2d<f32>;
@group(0) @binding(1) var repeat: sampler;
@group(0) @binding(2) var<storage, read_write> result: array<f32>;

@compute @workgroup_size(1)
fn main() {
    var count = 0u;
    for (var i = 0u; i < 200000u; i++) {
        count += 1u + (result_is_negative(i));
    }
    result[0] = f32(count);
    result[1] = sample_periodic(pixels, repeat, vec2<f32>(0.375, 0.25), 0u).x;
    result[2] = exp2(0.5 + result[3]);
    result[3] = sqrt(2.0 + result[3]);
}

// Never true: keeps the compiler from counting the loop itself.
fn result_is_negative(i: u32) -> u32 {
    return select(0u, i, result[3] < 0.0);
}
