// Output: geometric thickness, metres, of all layers together.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var repeat: sampler;
@group(0) @binding(4) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let uv = texel_place(view, id.xy);
    let at = id.y * view.size.x + id.x;
    let before = select(output[at], 0.0, view.first == 1u);
    output[at] = before + column_thickness(sample_periodic(thickness, repeat, uv + frame.place.offset_uv, 0u));
}
