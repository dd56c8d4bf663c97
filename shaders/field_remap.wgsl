// Thickness of an image's field: values are brought to the places that they have in the image's own distribution, so that
// two copies blended into each other keep its coverage and its mean.
@group(0) @binding(0) var<uniform> histogram: Histogram;
@group(0) @binding(1) var<storage, read_write> field: array<f32>;
@group(0) @binding(2) var<storage, read> edges: array<f32>;
@group(0) @binding(3) var thickness: texture_storage_2d<r32float, write>;

const BINS: u32 = 2048u;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(thickness);
    if any(id.xy >= size) {
        return;
    }
    let place = (field[id.y * size.x + id.x] - histogram.low) * histogram.per_unit;
    let inside = clamp(place, 0.0, f32(BINS));
    let low = min(u32(inside), BINS - 1u);
    let height_m = mix(edges[low], edges[low + 1u], inside - f32(low));
    textureStore(thickness, id.xy, vec4<f32>(height_m, 0.0, 0.0, 0.0));
}
