// Diffuse light that a point on one horizontal plane gets from another one above or below it: four rings of four taps
// on the mip levels of the light leaving that plane. The weights are a least-squares fit to the exact kernel
// h^2 / (pi (r^2 + h^2)^2) and add up to 1, so that even light stays even. Mip levels are blended by hand: drivers
// round the fraction of a level.
fn gather_taps(map: texture_2d<f32>, repeat: sampler, uv: vec2<f32>, away: f32, level: u32) -> vec3<f32> {
    return 0.25 * (sample_periodic(map, repeat, uv + vec2<f32>(away, away), level).rgb
        + sample_periodic(map, repeat, uv + vec2<f32>(-away, away), level).rgb
        + sample_periodic(map, repeat, uv + vec2<f32>(away, -away), level).rgb
        + sample_periodic(map, repeat, uv + vec2<f32>(-away, -away), level).rgb);
}

fn gather_light(map: texture_2d<f32>, repeat: sampler, exchange: Exchange, uv: vec2<f32>) -> vec3<f32> {
    let top = textureNumLevels(map) - 1u;
    var sum = vec3<f32>(0.0);
    for (var ring = 0u; ring < 4u; ring++) {
        let level = exchange.levels[ring];
        let low = min(u32(level), top);
        let high = min(low + 1u, top);
        let away = exchange.offsets_uv[ring];
        let light = mix(gather_taps(map, repeat, uv, away, low), gather_taps(map, repeat, uv, away, high), fract(level));
        sum += exchange.weights[ring] * light;
    }
    return sum;
}
