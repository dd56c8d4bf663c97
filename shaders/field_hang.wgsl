// Columns from a map of thickness, which hang down from a flat top or stand on the base plane: see shared/columns.wgsl.
@group(0) @binding(0) var thickness: texture_2d<f32>;
@group(0) @binding(1) var law: texture_2d<f32>; // one texel: height of the flat top above the base plane; 1 where they hang from it; how extinction changes
@group(0) @binding(2) var columns: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(columns)) {
        return;
    }
    let height_m = textureLoad(thickness, id.xy, 0).x;
    let edge = textureLoad(law, vec2<u32>(0u), 0);
    let top_m = select(height_m, edge.x, edge.y > 0.0);
    textureStore(columns, id.xy, vec4<f32>(height_m, top_m, top_m - height_m, edge.z));
}
