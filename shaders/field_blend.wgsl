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

fn value(uv: vec2<f32>) -> f32 {
    var sum = dot(blend.low, sample_periodic(low, repeat, uv, 0u)) + blend.cells * sample_periodic(cells, repeat, uv, 0u).x;
    if any(blend.middle != vec4<f32>(0.0)) {
        sum += dot(blend.middle, sample_periodic(middle, repeat, uv, 0u));
    }
    if any(blend.high != vec4<f32>(0.0)) {
        sum += dot(blend.high, sample_periodic(high, repeat, uv, 0u));
    }
    return sum;
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= blend.width || id.y >= blend.height {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(f32(blend.width), f32(blend.height));
    // Eddies ride with the mean wind.
    let place = uv + blend.offset_uv;
    let moved = sample_periodic(displacement, repeat, place, 0u);
    var sum = 0.0;
    if blend.first > 0.0 {
        sum += blend.first * value(place - moved.xy);
    }
    if blend.second > 0.0 {
        sum += blend.second * value(place - moved.zw);
    }
    field[id.y * blend.width + id.x] = sum;
}
