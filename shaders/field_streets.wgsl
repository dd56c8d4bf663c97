// Cloud streets of mean 0 and standard deviation 1: plane waves of whole cycles a tile. Made once a field.
@group(0) @binding(0) var<uniform> streets: Streets;
@group(0) @binding(1) var streets_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= streets.width || id.y >= streets.width {
        return;
    }
    // Places in halves of a texel are whole numbers, and so are cycles: no digits are lost however many there are.
    let place = 2 * vec2<i32>(id.xy) + 1;
    let tile = 2 * i32(streets.width);
    var sum = 0.0;
    for (var i = 0u; i < streets.count; i++) {
        let wave = streets.waves[i];
        let cycles = vec2<i32>(wave.xy);
        let turns = f32((cycles.x * place.x + cycles.y * place.y) % tile) / f32(tile) + wave.z;
        sum += wave.w * cos(2.0 * PI * (turns - round(turns)));
    }
    textureStore(streets_out, id.xy, vec4<f32>(sum, 0.0, 0.0, 0.0));
}
