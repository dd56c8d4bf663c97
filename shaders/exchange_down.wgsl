// Diffuse light that leaves the cloud base downwards: that of sun and sky, and what the cloud sends back of the
// ground's light. Also the balanced light that arrives from the ground, for shading.
@group(0) @binding(0) var<storage, read> budget: Budget;
@group(0) @binding(1) var diffuse: texture_2d<f32>;
@group(0) @binding(2) var not_reflected: texture_2d<f32>;
@group(0) @binding(3) var arriving: texture_2d<f32>;
@group(0) @binding(4) var down_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var upwelling_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(down_out)) {
        return;
    }
    let upwelling = budget.scale * textureLoad(arriving, id.xy, 0);
    let back = upwelling * (1.0 - textureLoad(not_reflected, id.xy, 0));
    textureStore(down_out, id.xy, textureLoad(diffuse, id.xy, 0) + back);
    textureStore(upwelling_out, id.xy, upwelling);
}
