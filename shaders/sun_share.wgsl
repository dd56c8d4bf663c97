// How much of the sun the cloud of each texel gets, relative to a slab of its thickness under the open sun: factors for
// the light seen from below (what really comes through, against the column's own transmittance) and from above (what
// enters around it). The layers above are left out of them: the fourth channel is their optical depth of transport.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> share: Share;
@group(0) @binding(2) var beam: texture_2d<f32>;
@group(0) @binding(3) var tilted: texture_2d<f32>;
@group(0) @binding(4) var entered: texture_2d<f32>;
@group(0) @binding(5) var column: texture_2d<f32>;
@group(0) @binding(6) var reflected: texture_2d<f32>;
@group(0) @binding(7) var above: texture_2d<f32>;
@group(0) @binding(8) var above_beam: texture_2d<f32>;
@group(0) @binding(9) var repeat: sampler;
@group(0) @binding(10) var below_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(11) var above_out: texture_storage_2d<rgba32float, write>;

// More than a column's own light counts as a part of no less than this: droplets that absorb leave it next to nothing, of which any light around it would be
// a million times as much.
const LEAST_OWN: f32 = 0.02;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.maps.texels || id.y >= frame.maps.texels {
        return;
    }
    let centre = (vec2<f32>(id.xy) + 0.5) / f32(frame.maps.texels);
    let place = centre + frame.place.above_uv;
    let lit = max(sample_periodic(above, repeat, place, 0u).rgb, vec3<f32>(LEAST_LIT));
    let depth = sample_periodic(above_beam, repeat, place, 0u).w;
    let diffuse = mix(textureLoad(tilted, id.xy, 0).rgb, share.entry_scale * textureLoad(entered, id.xy, 0).rgb,
        share.entry_weight);
    let through = textureLoad(beam, id.xy, 0).rgb + diffuse;
    let own = textureLoad(column, id.xy, 0).rgb;
    let gets = through / lit;
    let reaches = select(1.0 + (gets - own) / LEAST_OWN, gets / max(own, vec3<f32>(LEAST_OWN)), own >= vec3<f32>(LEAST_OWN));
    textureStore(below_out, id.xy, vec4<f32>(share.in_air * max(reaches, vec3<f32>(0.0)), depth));
    let entering = textureLoad(reflected, id.xy, 0).w;
    textureStore(above_out, id.xy, vec4<f32>(entering * share.reflect_scale, depth));
}
