// What the column above each texel of the maps of sunlight makes of light: transmitted part of the sun's, transmitted and
// not reflected part of even light.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var thickness: texture_2d<f32>;
@group(0) @binding(2) var transmittance: texture_2d<f32>;
@group(0) @binding(3) var diffuse: texture_2d<f32>;
@group(0) @binding(4) var repeat: sampler;
@group(0) @binding(5) var clamped: sampler;
@group(0) @binding(6) var column_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(7) var through_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(8) var not_reflected_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.maps.texels || id.y >= frame.maps.texels {
        return;
    }
    var column = vec3<f32>(0.0);
    var through = vec3<f32>(0.0);
    var not_reflected = vec3<f32>(0.0);
    for (var i = 0u; i < SUNLIGHT_SAMPLES; i++) {
        let uv = sunlight_sample(frame, id.xy, i);
        let depth = frame.medium.extinction_550 * sample_periodic(thickness, repeat, uv + frame.place.offset_uv, 0u).x;
        column += slab_transmittance(transmittance, clamped, depth, frame.sun.slant_cosine);
        through += slab_transmittance_diffuse(diffuse, clamped, depth);
        not_reflected += slab_not_reflected_diffuse(diffuse, clamped, depth);
    }
    let share = 1.0 / f32(SUNLIGHT_SAMPLES);
    textureStore(column_out, id.xy, vec4<f32>(column * share, 0.0));
    textureStore(through_out, id.xy, vec4<f32>(through * share, 0.0));
    textureStore(not_reflected_out, id.xy, vec4<f32>(not_reflected * share, 0.0));
}
