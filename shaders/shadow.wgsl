// Output: the part of the sun's beam that reaches the ground, at 550 nm.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> beam: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> output: array<f32>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let at = id.y * view.size.x + id.x;
    output[at] = select(0.0, beam[at].w, frame.sun.cosine > 0.0);
}
