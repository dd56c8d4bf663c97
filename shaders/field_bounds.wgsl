// Heights between which cloud ends over blocks of a layer's periodic map: least and greatest thickness, or lowest base and
// highest top. Blocks are of BOUNDS_TEXELS squares between texel centres a side, so that a block ends with the texels that the next one begins with. Nothing that is sampled between them lies
// outside. Where blocks do not divide the map, the last ones reach over its edge.
@group(0) @binding(0) var map: texture_2d<f32>;
@group(0) @binding(1) var bounds_out: texture_storage_2d<rg32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(bounds_out)) {
        return;
    }
    let size = textureDimensions(map);
    var ends = column_ends(textureLoad(map, BOUNDS_TEXELS * id.xy, 0));
    var counts = false;
    for (var y = 0u; y <= BOUNDS_TEXELS; y++) {
        for (var x = 0u; x <= BOUNDS_TEXELS; x++) {
            let texel = textureLoad(map, (BOUNDS_TEXELS * id.xy + vec2<u32>(x, y)) % size, 0);
            let here = column_ends(texel);
            ends = vec2<f32>(min(ends.x, here.x), max(ends.y, here.y));
            counts = counts || column_counts(texel);
        }
    }
    // Nothing lies above the one and below the other where there is no cloud.
    textureStore(bounds_out, id.xy, vec4<f32>(select(vec2<f32>(0.0, -1.0), ends, counts), 0.0, 0.0));
}
