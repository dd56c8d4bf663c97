// Output: downward irradiance on the ground, or a part of it: the sun's beam, texel by texel, and the light of the cloud
// base, which the exchange has gathered on its grid.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> with_peak: array<vec4<f32>>;
// What counts as the beam: with its 5-degree peak or without.
@group(0) @binding(3) var<storage, read> beam: array<vec4<f32>>;
@group(0) @binding(4) var gathered: texture_2d<f32>;
@group(0) @binding(5) var repeat: sampler;
@group(0) @binding(6) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let uv = texel_place(view, id.xy);
    let at = id.y * view.size.x + id.x;
    let horizontal = frame.sun.irradiance * frame.sun.cosine * frame.sun.through_air;
    let diffuse = max(sample_periodic(gathered, repeat, uv, 0u).rgb + view.added, vec3<f32>(0.0));
    let total = horizontal * with_peak[at].rgb + diffuse;
    let direct = horizontal * beam[at].rgb;
    var light = total;
    if view.part == 1u {
        light = direct;
    } else if view.part == 2u {
        light = total - direct;
    }
    output[3u * at] = light.r;
    output[3u * at + 1u] = light.g;
    output[3u * at + 2u] = light.b;
}
