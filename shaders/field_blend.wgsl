// A Gaussian field of mean about 0 and standard deviation about 1 at one moment: octaves and cells, read where each of the
// two layers of displacement has carried them from. Weights hold the layers' own, the amplitude of each octave, and
// what restores the variance that blending two displaced copies takes from it.
@group(0) @binding(0) var<uniform> blend: Blend;
@group(0) @binding(1) var displacement: texture_2d<f32>;
@group(0) @binding(2) var low: texture_2d<f32>;
@group(0) @binding(3) var middle: texture_2d<f32>;
@group(0) @binding(4) var high: texture_2d<f32>;
@group(0) @binding(5) var cells: texture_2d<f32>;
@group(0) @binding(6) var repeat: sampler;
@group(0) @binding(7) var<storage, read_write> field: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= blend.width || id.y >= blend.height {
        return;
    }
    // Eddies ride with the mean wind.
    let place = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(f32(blend.width), f32(blend.height)) + blend.offset_uv;
    let moved = sample_periodic(displacement, repeat, place, 0u);
    var sum = 0.0;
    // A loop and no function called twice: a software driver compiles the longer shader anew at every dispatch.
    for (var layer = 0u; layer < 2u; layer++) {
        let weight = select(blend.second, blend.first, layer == 0u);
        let uv = place - select(moved.zw, moved.xy, layer == 0u);
        var value = dot(blend.low, sample_periodic(low, repeat, uv, 0u));
        value += dot(blend.middle, sample_periodic(middle, repeat, uv, 0u));
        value += dot(blend.high, sample_periodic(high, repeat, uv, 0u));
        sum += weight * (value + blend.cells * sample_periodic(cells, repeat, uv, 0u).x);
    }
    field[id.y * blend.width + id.x] = sum;
}
