// Four octaves of tiling noise, one a channel: what does not change with time, made once a field.
@group(0) @binding(0) var<uniform> octaves: Octaves;
@group(0) @binding(1) var noise_out: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= octaves.width || id.y >= octaves.width {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(octaves.width);
    var noise = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let octave = octaves.first + i;
        if octave < octaves.count {
            let period = NOISE_LOWEST_PERIOD << octave;
            noise[i] = noise_gradient(uv * f32(period), period, octaves.seed + octave);
        }
    }
    textureStore(noise_out, id.xy, noise);
}
