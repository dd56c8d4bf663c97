// Convective cells, brought to mean 0 and standard deviation 1 (constants measured over many lattices). Their points move
// with time. Between two whole numbers of cells a side the one lattice fades into the other, so that the size of a cell
// has no steps.
@group(0) @binding(0) var<uniform> cells: Cells;
@group(0) @binding(1) var cells_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= cells.width || id.y >= cells.width {
        return;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / f32(cells.width);
    var value = 0.0;
    if cells.coarser > 0.0 {
        value += cells.coarser * lattice(uv, i32(cells.count));
    }
    if cells.finer > 0.0 {
        value += cells.finer * lattice(uv, i32(cells.count) + 1);
    }
    textureStore(cells_out, id.xy, vec4<f32>(value, 0.0, 0.0, 0.0));
}

fn lattice(uv: vec2<f32>, period: i32) -> f32 {
    let place = uv * f32(period);
    let bend = vec2<f32>(warp(place, period, 101u), warp(place, period, 202u));
    let edge = noise_cell_edge(place + 0.22 * bend, period, cells.seed + 303u, cells.turns);
    if cells.kind == 0u {
        return (smoothstep(0.0, 0.45, edge) - CLOSED_MEAN) / CLOSED_STD;
    }
    return (exp(-(edge / 0.2) * (edge / 0.2)) - OPEN_MEAN) / OPEN_STD;
}

const CLOSED_MEAN: f32 = 0.529;
const CLOSED_STD: f32 = 0.382;
const OPEN_MEAN: f32 = 0.385;
const OPEN_STD: f32 = 0.371;

// Three smooth octaves that bend the cells; more or rougher ones would destroy them.
fn warp(place: vec2<f32>, period: i32, salt: u32) -> f32 {
    let seed = cells.seed + salt;
    let sum = noise_gradient(place, period, seed)
        + 0.4 * noise_gradient(2.0 * place, 2 * period, seed + 1u)
        + 0.16 * noise_gradient(4.0 * place, 4 * period, seed + 2u);
    // 1.0888 = sqrt(1 + 0.4^2 + 0.16^2)
    return sum / (1.0888 * GRADIENT_NOISE_STD);
}
