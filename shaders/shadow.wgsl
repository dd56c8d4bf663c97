// Output: the part of the sun's beam that reaches the ground, at 550 nm.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<uniform> exchange: Exchange;
@group(0) @binding(3) var thickness: texture_2d<f32>;
@group(0) @binding(4) var repeat: sampler;
@group(0) @binding(5) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size || id.y >= view.rows {
        return;
    }
    let uv = (vec2<f32>(f32(id.x), f32(id.y + view.first_row)) + 0.5) / f32(view.size);
    let path_m = path_in_layer(thickness, repeat, frame, uv + exchange.shift_uv, frame.sun.xyz);
    let part = select(1.0, frame.beam.w, view.peak == 1u);
    let light = exp(-part * frame.extinction.w * path_m);
    output[id.y * view.size + id.x] = select(0.0, light, frame.sun_light.w > 0.0);
}
