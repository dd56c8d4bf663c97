// Bilinear samples by hand, for devices that do not filter 32-bit floats. Three to four times slower.

fn blend_texels(map: texture_2d<f32>, low: vec2<i32>, high: vec2<i32>, part: vec2<f32>, level: u32) -> vec4<f32> {
    let top = mix(textureLoad(map, low, level), textureLoad(map, vec2<i32>(high.x, low.y), level), part.x);
    let bottom = mix(textureLoad(map, vec2<i32>(low.x, high.y), level), textureLoad(map, high, level), part.x);
    return mix(top, bottom, part.y);
}

fn sample_periodic(map: texture_2d<f32>, repeat: sampler, uv: vec2<f32>, level: u32) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(map, level));
    let place = fract(uv) * vec2<f32>(size) - 0.5;
    let low = vec2<i32>(floor(place));
    return blend_texels(map, (low + size) % size, (low + 1) % size, place - floor(place), level);
}

// The four texels about a cell's middle: at its low corner (inside the map), east of it, south of it, and opposite.
fn gather_periodic(map: texture_2d<f32>, repeat: sampler, cell: vec2<f32>) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(map));
    let low = vec2<i32>(cell);
    let high = (low + 1) % size;
    return vec4<f32>(textureLoad(map, low, 0).x, textureLoad(map, vec2<i32>(high.x, low.y), 0).x,
        textureLoad(map, vec2<i32>(low.x, high.y), 0).x, textureLoad(map, high, 0).x);
}

fn sample_clamped(map: texture_2d<f32>, clamped: sampler, uv: vec2<f32>) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(map));
    let place = clamp(uv * vec2<f32>(size) - 0.5, vec2<f32>(0.0), vec2<f32>(size - 1));
    let low = vec2<i32>(floor(place));
    return blend_texels(map, low, min(low + 1, size - 1), place - floor(place), 0u);
}

// Between two mip levels too.
fn sample_level(map: texture_2d<f32>, trilinear: sampler, uv: vec2<f32>, level: f32) -> vec4<f32> {
    let most = f32(textureNumLevels(map)) - 1.0;
    let fine = clamp(floor(level), 0.0, most);
    let coarse = min(fine + 1.0, most);
    return mix(sample_periodic(map, trilinear, uv, u32(fine)), sample_periodic(map, trilinear, uv, u32(coarse)),
        clamp(level - fine, 0.0, 1.0));
}
