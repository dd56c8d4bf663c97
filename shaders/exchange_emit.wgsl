// Light that the ground sends up: albedo times irradiance.
@group(0) @binding(0) var albedo: texture_2d<f32>;
@group(0) @binding(1) var irradiance: texture_2d<f32>;
@group(0) @binding(2) var up_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(up_out)) {
        return;
    }
    textureStore(up_out, id.xy, textureLoad(albedo, id.xy, 0) * textureLoad(irradiance, id.xy, 0));
}
