// Light at the cloud base before any of it has met the ground, mean over each texel of the exchange grid: the sun's
// beam, diffuse light, and how much of diffuse light from below the cloud does not send back.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> exchange: Exchange;
@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var transmittance: texture_2d<f32>;
@group(0) @binding(4) var diffuse: texture_2d<f32>;
@group(0) @binding(5) var repeat: sampler;
@group(0) @binding(6) var clamped: sampler;
@group(0) @binding(7) var beam_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(8) var diffuse_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(9) var not_reflected_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= exchange.texels || id.y >= exchange.texels {
        return;
    }
    var beam = vec3<f32>(0.0);
    var scattered = vec3<f32>(0.0);
    var not_reflected = vec3<f32>(0.0);
    let samples = f32(exchange.samples);
    for (var i = 0u; i < exchange.samples * exchange.samples; i++) {
        let inside = vec2<f32>(f32(i % exchange.samples), f32(i / exchange.samples)) + 0.5;
        let uv = (vec2<f32>(id.xy) + inside / samples) / f32(exchange.texels);
        let path_m = path_in_layer(thickness, repeat, frame, uv, frame.sun.xyz);
        let through = sun_through(path_m);
        beam += through.beam;
        let column = frame.extinction.w * sample_periodic(thickness, repeat, uv + frame.offset_uv, 0u).x;
        let sky = PI * frame.sky_light.rgb * slab_transmittance_diffuse(diffuse, clamped, column);
        scattered += through.total - through.beam + sky;
        not_reflected += slab_not_reflected_diffuse(diffuse, clamped, column);
    }
    let share = 1.0 / (samples * samples);
    textureStore(beam_out, id.xy, vec4<f32>(beam * share, 0.0));
    textureStore(diffuse_out, id.xy, vec4<f32>(scattered * share, 0.0));
    textureStore(not_reflected_out, id.xy, vec4<f32>(not_reflected * share, 0.0));
}
