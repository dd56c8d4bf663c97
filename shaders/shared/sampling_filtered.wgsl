// Bilinear samples by the device's filter.

fn sample_periodic(map: texture_2d<f32>, repeat: sampler, uv: vec2<f32>, level: u32) -> vec4<f32> {
    return textureSampleLevel(map, repeat, uv, f32(level));
}

// The four texels about a cell's middle: at its low corner (inside the map), east of it, south of it, and opposite.
fn gather_periodic(map: texture_2d<f32>, repeat: sampler, cell: vec2<f32>) -> vec4<f32> {
    return textureGather(0, map, repeat, (cell + 1.0) / vec2<f32>(textureDimensions(map))).wzxy;
}

fn sample_clamped(map: texture_2d<f32>, clamped: sampler, uv: vec2<f32>) -> vec4<f32> {
    return textureSampleLevel(map, clamped, uv, 0.0);
}

// Between two mip levels too: the sampler blends them.
fn sample_level(map: texture_2d<f32>, trilinear: sampler, uv: vec2<f32>, level: f32) -> vec4<f32> {
    return textureSampleLevel(map, trilinear, uv, level);
}
