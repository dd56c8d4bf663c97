// Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha. Method "analytic".
//
// Sunlight: light scattered once and twice by the medium without its forward peak, in closed form; light that met the
// peak alone (order 0); and all higher orders as even radiance, closed against the exact fluxes.
@group(0) @binding(METHOD_BINDING) var closure: texture_2d<f32>;
@group(0) @binding(METHOD_BINDING + 1) var aureole: texture_2d<f32>;
@group(0) @binding(METHOD_BINDING + 2) var phase: texture_2d<f32>;

// What comes after these.
const METHOD_NEXT: u32 = METHOD_BINDING + 3u;

// Rows of the closure texture: factors of orders 1 and 2 and the flux of the higher ones; first reflected light.
const CLOSURE_ROWS: f32 = 6.0;
// The aureole's table: log2 of the optical path from -8, 4 rows an octave; sin of half the angle up to 20 degrees.
const AUREOLE_ROWS: f32 = 61.0;
const AUREOLE_LOG2_MIN: f32 = -8.0;
const AUREOLE_ROWS_PER_OCTAVE: f32 = 4.0;
const AUREOLE_HALF_SIN_MAX: f32 = 0.34202014;
const AUREOLE_COLUMNS: f32 = 256.0;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    cloud_texel(id.xy);
}

fn closure_row(row: f32, coordinate: f32) -> vec3<f32> {
    return sample_clamped(closure, clamped, vec2<f32>(coordinate, (row + 0.5) / CLOSURE_ROWS)).rgb;
}

// Scattered sunlight, per irradiance facing the sun.
fn sunlight(ray: ViewRay) -> vec3<f32> {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = min(0.5 * length(ray.seen + frame.sun.towards), 1.0);
    let half_cos = min(0.5 * length(ray.seen - frame.sun.towards), 1.0);
    let angle = phase_coordinate(half_sin, half_cos);
    let once = frame.medium.smooth_albedo * sample_clamped(phase, clamped, vec2<f32>(angle, 0.5 / PHASE_ROWS)).rgb;
    let twice = frame.medium.smooth_albedo * frame.medium.smooth_albedo
        * sample_clamped(phase, clamped, vec2<f32>(angle, 1.5 / PHASE_ROWS)).rgb;

    let coordinate = slab_depth_coordinate(ray.depth);
    let first_row = select(3.0, 0.0, ray.from_above);
    let factor1 = closure_row(first_row, coordinate);
    let factor2 = closure_row(first_row + 1.0, coordinate);
    let higher = closure_row(first_row + 2.0, coordinate) * slab_thin_share(ray.depth);

    let path_v = frame.medium.smooth_part * frame.medium.extinction * ray.path_m;
    let path_l = path_v * (ray.cosine / frame.sun.slant_cosine);
    var order1: vec3<f32>;
    var order2: vec3<f32>;
    if ray.from_above {
        order1 = slab_order1_reflected(path_l, path_v);
        order2 = slab_order2_reflected(path_l, path_v);
    } else {
        order1 = slab_order1_transmitted(path_l, path_v);
        order2 = slab_order2_transmitted(path_l, path_v);
    }
    var light = factor1 * once * order1 + factor2 * twice * order2 + higher * (frame.sun.slant_cosine / PI);
    if !ray.from_above && half_sin < AUREOLE_HALF_SIN_MAX {
        light += forward_light(half_sin, frame.medium.extinction * ray.path_m, path_v);
    }
    return light;
}

// Light that met the forward peak alone.
fn forward_light(half_sin: f32, path: vec3<f32>, smooth_path: vec3<f32>) -> vec3<f32> {
    let column = sqrt(half_sin / AUREOLE_HALF_SIN_MAX) * (AUREOLE_COLUMNS - 1.0);
    let u = (column + 0.5) / AUREOLE_COLUMNS;
    var light: vec3<f32>;
    for (var i = 0; i < 3; i++) {
        let row = (log2(max(path[i], 1e-9)) - AUREOLE_LOG2_MIN) * AUREOLE_ROWS_PER_OCTAVE;
        let shape = sample_clamped(aureole, clamped, vec2<f32>(u, (row + 0.5) / AUREOLE_ROWS))[i];
        light[i] = shape * path[i] * exp(-smooth_path[i]);
    }
    return light;
}
