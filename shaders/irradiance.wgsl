// Output: downward irradiance on the ground, or a part of it.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<uniform> exchange: Exchange;
@group(0) @binding(3) var thickness: texture_2d<f32>;
@group(0) @binding(4) var transmittance: texture_2d<f32>;
@group(0) @binding(5) var down: texture_2d<f32>;
@group(0) @binding(6) var repeat: sampler;
@group(0) @binding(7) var clamped: sampler;
@group(0) @binding(8) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size || id.y >= view.rows {
        return;
    }
    let uv = (vec2<f32>(f32(id.x), f32(id.y + view.first_row)) + 0.5) / f32(view.size);
    let path_m = path_in_layer(thickness, repeat, frame, uv + exchange.shift_uv, frame.sun.xyz);
    let beam = sun_through(path_m).beam;
    let total = beam + gather_light(down, repeat, exchange, uv);
    let unscattered = frame.sun_light.rgb * frame.sun_light.w * exp(-frame.extinction.rgb * path_m);
    let direct = select(min(unscattered, beam), beam, view.peak == 1u);
    var light = total;
    if view.part == 1u {
        light = direct;
    } else if view.part == 2u {
        light = total - direct;
    }
    let at = 3u * (id.y * view.size + id.x);
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
}
