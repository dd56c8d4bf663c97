// Water path and thickness from the Gaussian field: a lognormal water path above a threshold, adiabatic thickness as
// its root, softly clipped.
@group(0) @binding(0) var<uniform> transfer: Transfer;
@group(0) @binding(1) var<storage, read_write> field: array<f32>;
@group(0) @binding(2) var thickness: texture_storage_2d<r32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= transfer.width || id.y >= transfer.height {
        return;
    }
    let water = exp(transfer.spread * field[id.y * transfer.width + id.x]) - transfer.threshold;
    let free_m = transfer.scale_m * sqrt(max(water, 0.0));
    let ratio = free_m / max(transfer.clip_m, 1e-6);
    let height_m = free_m / sqrt(sqrt(1.0 + ratio * ratio * ratio * ratio));
    textureStore(thickness, id.xy, vec4<f32>(height_m, 0.0, 0.0, 0.0));
}
