// One mip level from the one below it: the mean of 2 x 2 texels, so that means are kept exactly.
@group(0) @binding(0) var fine: texture_2d<f32>;
@group(0) @binding(1) var coarse: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(coarse)) {
        return;
    }
    let p = 2u * id.xy;
    let top = textureLoad(fine, p, 0) + textureLoad(fine, p + vec2<u32>(1u, 0u), 0);
    let bottom = textureLoad(fine, p + vec2<u32>(0u, 1u), 0) + textureLoad(fine, p + vec2<u32>(1u, 1u), 0);
    textureStore(coarse, id.xy, 0.25 * (top + bottom));
}
