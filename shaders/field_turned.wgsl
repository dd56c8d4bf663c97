// Four octaves of tiling noise, one a channel, without the axes of a lattice: each is the sum of two whose lattices stand at
// half a right angle to each other, over the root of two, so that its variance is that of one. Made once a field.
@group(0) @binding(0) var<uniform> octaves: Turned;
@group(0) @binding(1) var noise_out: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= octaves.width || id.y >= octaves.width {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(octaves.width);
    var noise = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let octave = octaves.first + i;
        if octave < octaves.count {
            let turns = octaves.turns[i];
            // A loop and no function called twice: a software driver compiles the longer shader anew at every dispatch.
            for (var j = 0u; j < 2u; j++) {
                let turn = select(turns.zw, turns.xy, j == 0u);
                noise[i] += noise_turned(uv, turn, octaves.seed + octave + TURNED_SEEDS * j);
            }
        }
    }
    textureStore(noise_out, id.xy, 0.7071068 * noise);
}

// Seeds of the second lattices lie so far from those of the first.
const TURNED_SEEDS: u32 = 1000u;
