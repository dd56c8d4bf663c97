// Output: radiance of the ground, a matt reflector.
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var albedo: texture_2d<f32>;
@group(0) @binding(2) var repeat: sampler;
@group(0) @binding(3) var<storage, read> irradiance: array<f32>;
@group(0) @binding(4) var ground_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.size.y {
        return;
    }
    let at = 3u * (id.y * view.size.x + id.x);
    let light = vec3<f32>(irradiance[at], irradiance[at + 1u], irradiance[at + 2u]);
    let reflected = sample_periodic(albedo, repeat, texel_place(view, id.xy), 0u).rgb;
    textureStore(ground_out, id.xy, vec4<f32>(reflected * light / PI, 1.0));
}
