// How many values of a field lie in each of many equal bins; what is beyond the ends counts in the outermost ones. Whole
// numbers, so that the order of the additions does not matter.
@group(0) @binding(0) var<uniform> histogram: Histogram;
@group(0) @binding(1) var<storage, read_write> field: array<f32>;
@group(0) @binding(2) var<storage, read_write> bins: array<atomic<u32>>;

const BINS: u32 = 2048u;
const THREADS: u32 = 256u;
var<workgroup> counted: array<atomic<u32>, BINS>;

@compute @workgroup_size(256)
fn main(
    @builtin(local_invocation_index) thread: u32,
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    for (var bin = thread; bin < BINS; bin += THREADS) {
        atomicStore(&counted[bin], 0u);
    }
    workgroupBarrier();
    for (var i = id.x; i < histogram.count; i += THREADS * groups.x) {
        let place = (field[i] - histogram.low) * histogram.per_unit;
        let bin = u32(clamp(place, 0.0, f32(BINS) - 0.5));
        atomicAdd(&counted[bin], 1u);
    }
    workgroupBarrier();
    for (var bin = thread; bin < BINS; bin += THREADS) {
        let count = atomicLoad(&counted[bin]);
        if count > 0u {
            atomicAdd(&bins[bin], count);
        }
    }
}
