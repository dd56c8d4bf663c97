// Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha. Method "forward".
//
// Sunlight: scattered once, with the whole phase function, at a depth that counts what is scattered forwards as hardly scattered; and
// even light of all the rest, so that each side has its exact flux (src/slab/veil.rs).
@group(0) @binding(METHOD_BINDING) var veil: texture_2d<f32>;
@group(0) @binding(METHOD_BINDING + 1) var phase: texture_2d<f32>;

// What comes after these.
const METHOD_NEXT: u32 = METHOD_BINDING + 2u;

// Rows of the veil's texture: factor of single scattering, even light, first of reflected light; part of the depth that counts; factor of
// transmitted light without the forward peak.
const VEIL_ROWS: f32 = 6.0;
// Exponent of the cosine of the view's zenith below thick slabs, and the scaled depth at which half of it is reached.
const VEIL_THICK: f32 = 0.45;
const VEIL_THICK_FROM: f32 = 2.5;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    cloud_texel(id.xy);
}

fn veil_row(row: f32, coordinate: f32) -> vec3<f32> {
    return sample_clamped(veil, clamped, vec2<f32>(coordinate, (row + 0.5) / VEIL_ROWS)).rgb;
}

// Scattered sunlight, per irradiance facing the sun.
fn sunlight(ray: ViewRay) -> vec3<f32> {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = min(0.5 * length(ray.seen + frame.sun.towards), 1.0);
    let half_cos = min(0.5 * length(ray.seen - frame.sun.towards), 1.0);
    let angle = phase_coordinate(half_sin, half_cos);
    let coordinate = slab_depth_coordinate(ray.depth);
    let first_row = select(2.0, 0.0, ray.from_above);
    let whole = sample_clamped(phase, clamped, vec2<f32>(angle, 2.5 / PHASE_ROWS)).rgb;
    let once = veil_row(first_row, coordinate) * whole;
    let path_v = veil_row(4.0, coordinate) * frame.medium.extinction * ray.path_m;
    let path_l = path_v * (ray.cosine / frame.sun.slant_cosine);
    let even = veil_row(first_row + 1.0, coordinate) * slab_thin_share(ray.depth) * path_v * slab_phi1(path_v);
    if ray.from_above {
        return once * slab_order1_reflected(path_l, path_v) + even;
    }
    let smooth_part = sample_clamped(phase, clamped, vec2<f32>(angle, 0.5 / PHASE_ROWS)).rgb;
    let all = once + veil_row(5.0, coordinate) * smooth_part;
    let scaled = path_v * ray.cosine;
    let narrowing = exp(VEIL_THICK * log(ray.cosine) * scaled / (scaled + VEIL_THICK_FROM));
    return all * slab_order1_transmitted(path_l, path_v) + even * narrowing;
}
