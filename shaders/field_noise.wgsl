// A Gaussian field of mean about 0 and standard deviation about 1: tiling, with a -5/3 spectrum and convective cells.
@group(0) @binding(0) var<uniform> pattern: Pattern;
@group(0) @binding(1) var<storage, read_write> field: array<f32>;

// Cycles per domain of the lowest octave.
const LOWEST_PERIOD: i32 = 3;
// Amplitude per octave: 2^(-1/3) gives a -5/3 spectrum.
const OCTAVE_GAIN: f32 = 0.7937005;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= pattern.width || id.y >= pattern.width {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(pattern.width);
    var gain = 1.0;
    var period = LOWEST_PERIOD;
    var noise = 0.0;
    for (var octave = 0u; octave < pattern.octaves; octave++) {
        noise += gain * noise_gradient(uv * f32(period), period, pattern.seed + octave);
        gain *= OCTAVE_GAIN;
        period *= 2;
    }
    let value = noise * pattern.noise_scale;
    let share = pattern.cell_share;
    let mixed = sqrt(1.0 - share * share) * value + share * cells(uv);
    field[id.y * pattern.width + id.x] = mixed;
}

// Cells, brought to mean 0 and standard deviation 1 (constants measured over many lattices).
fn cells(uv: vec2<f32>) -> f32 {
    if pattern.kind == 2u {
        return 0.0;
    }
    let period = i32(pattern.cells);
    let place = uv * f32(period);
    let bend = vec2<f32>(warp(place, period, 101u), warp(place, period, 202u));
    let edge = noise_cell_edge(place + 0.22 * bend, period, pattern.seed + 303u);
    if pattern.kind == 0u {
        return (smoothstep(0.0, 0.45, edge) - 0.529) / 0.382;
    }
    return (exp(-(edge / 0.2) * (edge / 0.2)) - 0.385) / 0.371;
}

// Three smooth octaves that bend the cells; more or rougher ones would destroy them.
fn warp(place: vec2<f32>, period: i32, salt: u32) -> f32 {
    let seed = pattern.seed + salt;
    let sum = noise_gradient(place, period, seed)
        + 0.4 * noise_gradient(2.0 * place, 2 * period, seed + 1u)
        + 0.16 * noise_gradient(4.0 * place, 4 * period, seed + 2u);
    // 1.0888 = sqrt(1 + 0.4^2 + 0.16^2)
    return sum / (1.0888 * GRADIENT_NOISE_STD);
}
