// Bounds of the blocks of a map that are twice as wide as those of the level before.
@group(0) @binding(0) var fine: texture_2d<f32>;
@group(0) @binding(1) var coarse: texture_storage_2d<rg32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(coarse)) {
        return;
    }
    var ends = textureLoad(fine, 2u * id.xy, 0).xy;
    for (var i = 1u; i < 4u; i++) {
        let here = textureLoad(fine, 2u * id.xy + vec2<u32>(i & 1u, i >> 1u), 0).xy;
        ends = vec2<f32>(min(ends.x, here.x), max(ends.y, here.y));
    }
    textureStore(coarse, id.xy, vec4<f32>(ends, 0.0, 0.0));
}
