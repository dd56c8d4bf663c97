// Columns that hang down from a flat top, from a map of thickness: see shared/columns.wgsl.
@group(0) @binding(0) var thickness: texture_2d<f32>;
@group(0) @binding(1) var top: texture_2d<f32>; // one texel: its height above the base plane
@group(0) @binding(2) var columns: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(columns)) {
        return;
    }
    let height_m = textureLoad(thickness, id.xy, 0).x;
    let top_m = textureLoad(top, vec2<u32>(0u), 0).x;
    textureStore(columns, id.xy, vec4<f32>(height_m, top_m, top_m - height_m, 0.0));
}
