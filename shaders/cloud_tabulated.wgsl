// Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha. Method "tabulated".
//
// Sunlight: single scattering is exact, with the whole phase function at the delta-M scaled depth; everything after it
// is smooth and comes from a table of the exact solution, cut at this frame's sun: one 3-D fetch for three colours. What
// the two lack near the sun is a third term (src/slab/radiance tells all of it).
@group(0) @binding(METHOD_BINDING) var slice: texture_3d<f32>;
@group(0) @binding(METHOD_BINDING + 1) var near_sun: texture_2d<f32>;
@group(0) @binding(METHOD_BINDING + 2) var linear: sampler;
@group(0) @binding(METHOD_BINDING + 3) var<uniform> remainder: Remainder;
@group(0) @binding(METHOD_BINDING + 4) var phase: texture_2d<f32>;

// What comes after these.
const METHOD_NEXT: u32 = METHOD_BINDING + 5u;

// The slice's axis of optical depth: octaves of remainder.depths_per_octave nodes up to SPARSE, then of one.
const SLICE_LOG2_DEPTH_MIN: f32 = -5.0;
const SLICE_LOG2_DEPTH_SPARSE: f32 = 7.0;
// Its axis of view zenith ends here, radians (89.9 degrees), and is denser towards the horizon.
const SLICE_ZENITH_MAX: f32 = 1.5690509975429023;
const SLICE_COSINE_MIN: f32 = 0.0017453283658983088;
const SLICE_DENSER: f32 = 0.12;
// The table of the correction near the sun: log2 of the optical path from -6, 4 rows an octave; sin of half the angle up
// to 30 degrees.
const NEAR_SUN_ROWS: f32 = 53.0;
const NEAR_SUN_COLUMNS: f32 = 256.0;
const NEAR_SUN_LOG2_MIN: f32 = -6.0;
const NEAR_SUN_ROWS_PER_OCTAVE: f32 = 4.0;
const NEAR_SUN_HALF_SIN_MAX: f32 = 0.25881905;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    cloud_texel(id.xy);
}

// Texture coordinate of node k of n.
fn node_coordinate(node: f32, nodes: f32) -> f32 {
    return (node + 0.5) / nodes;
}

// Square root of the scaled remainder, three colours.
fn slice_root(ray: ViewRay) -> vec3<f32> {
    let octave = log2(max(ray.depth, 1e-30));
    let dense = (min(octave, SLICE_LOG2_DEPTH_SPARSE) - SLICE_LOG2_DEPTH_MIN) * remainder.depths_per_octave;
    let depth_node = clamp(dense + max(octave - SLICE_LOG2_DEPTH_SPARSE, 0.0), 0.0, remainder.depths - 1.0);
    // Arcs of tangents: drivers compute those of sines and cosines badly.
    let t = min(atan2(length(ray.seen.xy), ray.cosine) / SLICE_ZENITH_MAX, 1.0);
    let t4 = t * t * t * t;
    let zenith_node = ((1.0 - SLICE_DENSER) * t + SLICE_DENSER * t4 * t4 * t4) * (remainder.zeniths - 1.0);
    // Azimuth of the light's travel against that of the sunlight.
    let along = -dot(frame.sun.towards.xy, ray.seen.xy);
    let across = frame.sun.towards.x * ray.seen.y - frame.sun.towards.y * ray.seen.x;
    let straight = max(abs(along), abs(across)) < 1e-9;
    let azimuth = select(abs(atan2(across, along)), 0.0, straight);
    let azimuth_node = azimuth / PI * (remainder.azimuths - 1.0);
    let place = vec3<f32>(node_coordinate(depth_node, remainder.depths),
        node_coordinate(zenith_node, remainder.zeniths), node_coordinate(azimuth_node, remainder.azimuths));
    return textureSampleLevel(slice, linear, place, 0.0).rgb;
}

// Scattered sunlight, per irradiance facing the sun.
fn sunlight(ray: ViewRay) -> vec3<f32> {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = min(0.5 * length(ray.seen + frame.sun.towards), 1.0);
    let half_cos = min(0.5 * length(ray.seen - frame.sun.towards), 1.0);
    let row = vec2<f32>(phase_coordinate(half_sin, half_cos), 2.5 / PHASE_ROWS);
    let once = remainder.order1_albedo * sample_clamped(phase, clamped, row).rgb;
    let root = slice_root(ray);

    let view_cosine = max(ray.cosine, SLICE_COSINE_MIN);
    let sun_cosine = max(frame.sun.slant_cosine, SLICE_COSINE_MIN);
    let grazing = 1.0 / view_cosine + 1.0 / sun_cosine;
    let depth = frame.medium.extinction * (ray.path_m * ray.cosine);
    let scaled = remainder.depth_scale * depth;
    let x = scaled * grazing;
    let rise = x * slab_phi2(x) / (view_cosine + sun_cosine);
    let rest = frame.sun.slant_cosine / PI * rise * root * root;
    let path_v = remainder.depth_scale * frame.medium.extinction * ray.path_m;
    let path_l = scaled / frame.sun.slant_cosine;
    if ray.from_above {
        return rest + once * slab_order1_reflected(path_l, path_v);
    }
    // Light through a thick slab dies away as c k / sinh(k (depth + c)).
    let extended = scaled + remainder.extrapolation;
    let u = remainder.decay * extended;
    let fall = remainder.extrapolation / extended * exp(-u) / slab_phi1(2.0 * u);
    var single = once;
    if !SKY_PLAIN && half_sin < NEAR_SUN_HALF_SIN_MAX {
        single += near_sun_light(half_sin, 0.5 * depth * (1.0 / ray.cosine + 1.0 / frame.sun.slant_cosine));
    }
    return max(rest * fall + slab_order1_transmitted(path_l, path_v) * single, vec3<f32>(0.0));
}

// What is added to single scattering near the sun, for an optical path of each colour.
fn near_sun_light(half_sin: f32, path: vec3<f32>) -> vec3<f32> {
    let column = sqrt(half_sin / NEAR_SUN_HALF_SIN_MAX) * (NEAR_SUN_COLUMNS - 1.0);
    let u = node_coordinate(column, NEAR_SUN_COLUMNS);
    let row = (log2(max(path, vec3<f32>(1e-9))) - NEAR_SUN_LOG2_MIN) * NEAR_SUN_ROWS_PER_OCTAVE;
    let table = vec3<f32>(
        sample_clamped(near_sun, clamped, vec2<f32>(u, node_coordinate(row.r, NEAR_SUN_ROWS))).r,
        sample_clamped(near_sun, clamped, vec2<f32>(u, node_coordinate(row.g, NEAR_SUN_ROWS))).g,
        sample_clamped(near_sun, clamped, vec2<f32>(u, node_coordinate(row.b, NEAR_SUN_ROWS))).b);
    return path / (1.0 + path) * table;
}
