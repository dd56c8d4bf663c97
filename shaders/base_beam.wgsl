// The sun's beam on the ground, with its 5-degree peak, as far as a layer and those above it leave it: mean over each texel
// of the maps of sunlight, at the layer's base. Fourth channel: optical depth of transport at 550 nm of those layers on the way
// to the sun.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var thickness: texture_2d<f32>;
@group(0) @binding(2) var bounds: texture_2d<f32>;
@group(0) @binding(3) var transmittance: texture_2d<f32>;
@group(0) @binding(4) var above: texture_2d<f32>;
@group(0) @binding(5) var repeat: sampler;
@group(0) @binding(6) var clamped: sampler;
@group(0) @binding(7) var beam_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.maps.texels || id.y >= frame.maps.texels {
        return;
    }
    let centre = (vec2<f32>(id.xy) + 0.5) / f32(frame.maps.texels);
    let lit = sample_periodic(above, repeat, centre + frame.place.above_uv, 0u);
    var beam = vec3<f32>(0.0);
    var sum_m = 0.0;
    for (var i = 0u; i < SUNLIGHT_SAMPLES; i++) {
        let uv = sunlight_sample(frame, id.xy, i);
        var path_m = sample_periodic(thickness, repeat, uv + frame.place.offset_uv, 0u).x / frame.sun.slant_cosine;
        if frame.maps.columns != 1u {
            path_m = path_across(thickness, bounds, frame, uv, frame.sun.towards, 0.0);
        }
        beam += sun_through(path_m).beam;
        sum_m += path_m;
    }
    let depth = frame.medium.transport_550 * frame.medium.extinction_550 * frame.sun.slant_cosine * sum_m;
    textureStore(beam_out, id.xy, vec4<f32>(beam * lit.rgb, depth) / f32(SUNLIGHT_SAMPLES) + vec4<f32>(0.0, 0.0, 0.0, lit.w));
}
