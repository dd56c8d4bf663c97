// Vertical extent of cloud in a cumulus layer, metres, added to that of other layers.
@group(0) @binding(6) var<uniform> view: View;
@group(0) @binding(7) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let at = id.y * view.size.x + id.x;
    let place = texel_place(view, id.xy) - 0.5;
    let start = vec3<f32>(vec2<f32>(place.x, -place.y) * cumulus.extent_m - cumulus.offset_m, cumulus.low_m);
    let upright = vec3<f32>(0.0, 0.0, 1.0);
    let ray = CloudRay(start, upright, upright, 0.0);
    let length_m = cumulus_length(ray, 0.0, cumulus.top_m - cumulus.low_m, 1e9, 0.0);
    output[at] = select(output[at], 0.0, view.first == 1u) + length_m;
}
