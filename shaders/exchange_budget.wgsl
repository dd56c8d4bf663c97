// The factor by which all light between ground and cloud must be multiplied so that as much leaves as enters, and the
// largest change since the last pass. Balance of the mean over the domain: what enters (source) leaves by absorption in
// the ground, or goes up through the cloud base and does not come back. Both terms are products of small factors that
// are known exactly, never differences: albedo 1 under a thick cloud stays accurate.
@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var irradiance: texture_2d<f32>;
@group(0) @binding(2) var previous: texture_2d<f32>;
@group(0) @binding(3) var albedo: texture_2d<f32>;
@group(0) @binding(4) var arriving: texture_2d<f32>;
@group(0) @binding(5) var not_reflected: texture_2d<f32>;
@group(0) @binding(6) var<storage, read_write> budget: Budget;

const THREADS: u32 = 256u;
var<workgroup> entering: array<vec3<f32>, THREADS>;
var<workgroup> leaving: array<vec3<f32>, THREADS>;
var<workgroup> total: array<vec3<f32>, THREADS>;
var<workgroup> change: array<vec3<f32>, THREADS>;

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_index) thread: u32) {
    let size = textureDimensions(source);
    let last_scale = budget.scale.rgb;
    var enter = vec3<f32>(0.0);
    var leave = vec3<f32>(0.0);
    var sum = vec3<f32>(0.0);
    var most = vec3<f32>(0.0);
    for (var i = thread; i < size.x * size.y; i += THREADS) {
        let p = vec2<u32>(i % size.x, i / size.x);
        let now = textureLoad(irradiance, p, 0).rgb;
        enter += textureLoad(source, p, 0).rgb;
        leave += (1.0 - textureLoad(albedo, p, 0).rgb) * now
            + textureLoad(not_reflected, p, 0).rgb * textureLoad(arriving, p, 0).rgb;
        sum += now;
        most = max(most, abs(now - last_scale * textureLoad(previous, p, 0).rgb));
    }
    entering[thread] = enter;
    leaving[thread] = leave;
    total[thread] = sum;
    change[thread] = most;
    workgroupBarrier();
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            entering[thread] += entering[thread + half];
            leaving[thread] += leaving[thread + half];
            total[thread] += total[thread + half];
            change[thread] = max(change[thread], change[thread + half]);
        }
        workgroupBarrier();
    }
    if thread == 0u {
        let dark = leaving[0] <= vec3<f32>(0.0);
        budget.scale = vec4<f32>(select(entering[0] / leaving[0], vec3<f32>(1.0), dark), 0.0);
        let mean = total[0] / f32(size.x * size.y);
        budget.change = vec4<f32>(select(change[0] / mean, vec3<f32>(0.0), mean <= vec3<f32>(0.0)), 0.0);
    }
}
