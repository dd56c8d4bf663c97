// Look-ups in the slab's tables, and its first orders of scattering in closed form.
//
// Tables run over log2 of the optical depth at 550 nm (their rows hold each channel at its own, proportional depth) and
// over the square root of the cosine of zenith.

const SLAB_LOG2_DEPTH_MIN: f32 = -16.0;
const SLAB_NODES_PER_OCTAVE: f32 = 8.0;
const SLAB_DEPTH_NODES: f32 = 265.0;
const SLAB_ROOT_COSINE_MIN: f32 = 0.01;
const SLAB_COSINE_NODES: f32 = 65.0;
const SLAB_DEPTH_MIN: f32 = 1.52587890625e-5; // exp2(SLAB_LOG2_DEPTH_MIN)

// Texture coordinate of an optical depth.
fn slab_depth_coordinate(depth: f32) -> f32 {
    let node = (log2(max(depth, SLAB_DEPTH_MIN)) - SLAB_LOG2_DEPTH_MIN) * SLAB_NODES_PER_OCTAVE;
    return (node + 0.5) / SLAB_DEPTH_NODES;
}

fn slab_cosine_coordinate(cosine: f32) -> f32 {
    let root = sqrt(clamp(cosine, MIN_COSINE, 1.0));
    let node = (root - SLAB_ROOT_COSINE_MIN) / (1.0 - SLAB_ROOT_COSINE_MIN) * (SLAB_COSINE_NODES - 1.0);
    return (node + 0.5) / SLAB_COSINE_NODES;
}

// Below the table's first depth everything is proportional to depth.
fn slab_thin_share(depth: f32) -> f32 {
    return min(depth / SLAB_DEPTH_MIN, 1.0);
}

// Transmitted part of a beam, unscattered light included.
fn slab_transmittance(map: texture_2d<f32>, clamped: sampler, depth: f32, cosine: f32) -> vec3<f32> {
    let uv = vec2<f32>(slab_cosine_coordinate(cosine), slab_depth_coordinate(depth));
    return mix(vec3<f32>(1.0), sample_clamped(map, clamped, uv).rgb, slab_thin_share(depth));
}

// Reflected part of a beam.
fn slab_reflectance(map: texture_2d<f32>, clamped: sampler, depth: f32, cosine: f32) -> vec3<f32> {
    let uv = vec2<f32>(slab_cosine_coordinate(cosine), slab_depth_coordinate(depth));
    return sample_clamped(map, clamped, uv).rgb * slab_thin_share(depth);
}

// Transmitted part of light that comes evenly from a hemisphere.
fn slab_transmittance_diffuse(map: texture_2d<f32>, clamped: sampler, depth: f32) -> vec3<f32> {
    let value = sample_clamped(map, clamped, vec2<f32>(slab_depth_coordinate(depth), 0.25)).rgb;
    return mix(vec3<f32>(1.0), value, slab_thin_share(depth));
}

// One minus the reflected part of light that comes evenly from a hemisphere: tabulated as such, because the difference
// would be lost for thick clouds.
fn slab_not_reflected_diffuse(map: texture_2d<f32>, clamped: sampler, depth: f32) -> vec3<f32> {
    let value = sample_clamped(map, clamped, vec2<f32>(slab_depth_coordinate(depth), 0.75)).rgb;
    return mix(vec3<f32>(1.0), value, slab_thin_share(depth));
}

// (1 - exp(-x)) / x, safe at 0. Three colours at once, as everything that follows.
fn slab_phi1(x: vec3<f32>) -> vec3<f32> {
    let series = 1.0
        - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0 - x / 5040.0)))));
    return select((1.0 - exp(-x)) / x, series, x < vec3<f32>(0.3));
}

// (1 - (1 + x) exp(-x)) / x, safe at 0. The closed form loses digits as x^2, so the series goes far.
fn slab_phi2(x: vec3<f32>) -> vec3<f32> {
    let series = x
        * (0.5 - x * (1.0 / 3.0 - x * (0.125 - x * (1.0 / 30.0 - x * (1.0 / 144.0 - x / 840.0)))));
    return select((1.0 - (1.0 + x) * exp(-x)) / x, series, x < vec3<f32>(0.3));
}

// First order, reflected: radiance per irradiance facing the sun, but for the phase function over 4 pi.
// path_l, path_v: optical depth along the sun's and the view ray.
fn slab_order1_reflected(path_l: vec3<f32>, path_v: vec3<f32>) -> vec3<f32> {
    return path_v * slab_phi1(path_l + path_v);
}

fn slab_order1_transmitted(path_l: vec3<f32>, path_v: vec3<f32>) -> vec3<f32> {
    return path_v * exp(-min(path_l, path_v)) * slab_phi1(abs(path_l - path_v));
}

// Second order: the same, but for the phase function convolved with itself.
fn slab_order2_reflected(path_l: vec3<f32>, path_v: vec3<f32>) -> vec3<f32> {
    return 0.5 * path_v * slab_phi2(path_l + path_v);
}

fn slab_order2_transmitted(path_l: vec3<f32>, path_v: vec3<f32>) -> vec3<f32> {
    let shorter = min(path_l, path_v);
    let apart = abs(path_l - path_v);
    return 0.5 * path_v * exp(-shorter) * (shorter * slab_phi1(apart) + slab_phi2(apart));
}

const PHASE_COLUMNS: f32 = 2048.0;
// Rows of the phase functions: scattered once and twice without the forward peak; the whole function.
const PHASE_ROWS: f32 = 3.0;

// Texture coordinate of a scattering angle, given sin and cos of its half: fine at 0 and at 180 degrees, and without
// inverse functions, which drivers compute badly.
fn phase_coordinate(half_sin: f32, half_cos: f32) -> f32 {
    let forward = 0.5 * sqrt(half_sin * 1.41421356);
    let backward = 1.0 - 0.5 * sqrt(half_cos * 1.41421356);
    let place = select(backward, forward, half_sin < half_cos);
    return (place * (PHASE_COLUMNS - 1.0) + 0.5) / PHASE_COLUMNS;
}
