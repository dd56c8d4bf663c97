// Cirrus of mean about 0 and standard deviation about 1: the logarithm of the ice in a column, which fell from heads downwind of
// it. Made once a field.
@group(0) @binding(0) var<uniform> trails: Trails;
@group(0) @binding(1) var low: texture_2d<f32>;
@group(0) @binding(2) var heads: texture_2d<f32>;
@group(0) @binding(3) var repeat: sampler;
@group(0) @binding(4) var trails_out: texture_storage_2d<r32float, write>;

// Part of a trail over which ice reaches its most.
const TRAIL_RISE: f32 = 0.2;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= trails.width || id.y >= trails.width {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(trails.width);
    // The longest waves of the noise push trails aside, so that they are not straight.
    let waves = sample_periodic(low, repeat, uv, 0u);
    let foot = uv + trails.aside_uv * (waves.x + 0.5 * waves.y);
    var ice = 0.0;
    var weights = 0.0;
    for (var i = 0u; i < trails.steps; i++) {
        let part = (f32(i) + 0.5) / f32(trails.steps);
        let left = 1.0 - part;
        let weight = min(part / TRAIL_RISE, 1.0) * left * left;
        let place = foot + trails.along_uv * part + trails.bend_uv * (part * part);
        ice += weight * sample_periodic(heads, repeat, place, 0u).x;
        weights += weight;
    }
    let value = (log(ice / weights) - trails.centre) * trails.per_unit;
    textureStore(trails_out, id.xy, vec4<f32>(value, 0.0, 0.0, 0.0));
}
