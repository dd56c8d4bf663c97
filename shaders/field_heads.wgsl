// Ice at the height where it forms: a lognormal field of generating cells, smeared over one step of the trails that
// `field_trails.wgsl` draws from it, so that these have no beads. Made once a field.
@group(0) @binding(0) var<uniform> trails: Trails;
@group(0) @binding(1) var low: texture_2d<f32>;
@group(0) @binding(2) var middle: texture_2d<f32>;
@group(0) @binding(3) var high: texture_2d<f32>;
@group(0) @binding(4) var repeat: sampler;
@group(0) @binding(5) var heads_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= trails.width || id.y >= trails.width {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(trails.width);
    let step_uv = trails.along_uv / f32(trails.steps);
    var sum = 0.0;
    for (var i = 0u; i < trails.parts; i++) {
        let place = uv + step_uv * ((f32(i) + 0.5) / f32(trails.parts) - 0.5);
        var value = dot(trails.low, sample_periodic(low, repeat, place, 0u));
        value += dot(trails.middle, sample_periodic(middle, repeat, place, 0u));
        value += dot(trails.high, sample_periodic(high, repeat, place, 0u));
        sum += exp(value);
    }
    textureStore(heads_out, id.xy, vec4<f32>(sum / f32(trails.parts), 0.0, 0.0, 0.0));
}
