// Bilinear samples by the device's filter.

fn sample_periodic(map: texture_2d<f32>, repeat: sampler, uv: vec2<f32>, level: u32) -> vec4<f32> {
    return textureSampleLevel(map, repeat, uv, f32(level));
}

fn sample_clamped(map: texture_2d<f32>, clamped: sampler, uv: vec2<f32>) -> vec4<f32> {
    return textureSampleLevel(map, clamped, uv, 0.0);
}
