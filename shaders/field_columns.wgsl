// Columns (shared/columns.wgsl) from a Gaussian field: the path of cloud of the layer's extinction by the rank of the value, the
// thickness of adiabatic cloud of that path, and edges that go with it. Where columns are thin their base lies higher, so
// that cloud ends as a lens and not as a hill; or all hang from one top.
@group(0) @binding(0) var<uniform> law: Columns;
@group(0) @binding(1) var<storage, read_write> field: array<f32>;
@group(0) @binding(2) var<storage, read> edges: array<f32>; // path at the edges of the bins, metres
@group(0) @binding(3) var columns: texture_storage_2d<rgba32float, write>;

const BINS: u32 = 2048u;
// Optical depth of adiabatic cloud goes with its thickness to the power of 5/3.
const THICKNESS_POWER: f32 = 0.6;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(columns);
    if any(id.xy >= size) {
        return;
    }
    let place = (field[id.y * size.x + id.x] - law.low) * law.per_unit;
    let inside = clamp(place, 0.0, f32(BINS));
    let low = min(u32(inside), BINS - 1u);
    let path_m = mix(edges[low], edges[low + 1u], inside - f32(low));
    let free_m = select(0.0, law.scale_m * pow(max(path_m, 1e-20), THICKNESS_POWER), path_m > 0.0);
    let ratio = free_m / max(law.clip_m, 1e-6);
    let thickness_m = free_m / sqrt(sqrt(1.0 + ratio * ratio * ratio * ratio));
    let hangs = law.hang_m > 0.0;
    let base_m = select(law.lift_m * exp(-thickness_m / max(law.over_m, 1e-6)), law.hang_m - thickness_m, hangs);
    let top_m = select(base_m + thickness_m, law.hang_m, hangs);
    textureStore(columns, id.xy, vec4<f32>(path_m, top_m, base_m, f32(law.grows)));
}
