// An image's thickness at one moment, read where each of the two layers of displacement has carried it from, metres.
@group(0) @binding(0) var<uniform> blend: Blend;
@group(0) @binding(1) var displacement: texture_2d<f32>;
@group(0) @binding(2) var image: texture_2d<f32>;
@group(0) @binding(3) var repeat: sampler;
@group(0) @binding(4) var<storage, read_write> field: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= blend.width || id.y >= blend.height {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(f32(blend.width), f32(blend.height));
    // Eddies ride with the mean wind.
    let place = uv + blend.offset_uv;
    let moved = sample_periodic(displacement, repeat, place, 0u);
    let first = blend.first * sample_periodic(image, repeat, place - moved.xy, 0u).x;
    let second = blend.second * sample_periodic(image, repeat, place - moved.zw, 0u).x;
    field[id.y * blend.width + id.x] = first + second;
}
