// Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha. Method "forward".
//
// Sunlight: a lobe around its way, as wide as what was scattered forward alone, and even light of all the rest, each with the
// exact flux (src/slab/veil.rs).
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: CloudView;
// Bindings 2 and 3: the cloud's shape, as the view looks at it.
@group(0) @binding(4) var transmittance: texture_2d<f32>;
@group(0) @binding(5) var reflectance: texture_2d<f32>;
@group(0) @binding(6) var from_below: texture_2d<f32>;
@group(0) @binding(7) var from_above: texture_2d<f32>;
@group(0) @binding(8) var sun_share: texture_2d<f32>;
@group(0) @binding(9) var repeat: sampler;
@group(0) @binding(10) var clamped: sampler;
@group(0) @binding(11) var<storage, read_write> output: array<f32>;
@group(0) @binding(12) var behind: texture_2d<f32>; // even light beyond all layers that are drawn
@group(0) @binding(13) var<storage, read_write> held: array<vec3<f32>>; // by what lies before: see left_of
@group(0) @binding(METHOD_BINDING) var veil: texture_2d<f32>;

// What comes after these.
const METHOD_NEXT: u32 = METHOD_BINDING + 1u;

// Rows of the veil's texture: glare, exponent, light from the zenith, reflected light.
const VEIL_ROWS: f32 = 4.0;
// Exponent of the cosine of the view's zenith below thick slabs.
const VEIL_THICK: f32 = 0.45;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    cloud_texel(id.xy);
}

fn veil_row(row: f32, coordinate: f32) -> vec3<f32> {
    return sample_clamped(veil, clamped, vec2<f32>(coordinate, (row + 0.5) / VEIL_ROWS)).rgb;
}

// Scattered sunlight, per irradiance facing the sun.
fn sunlight(ray: ViewRay) -> vec3<f32> {
    let coordinate = slab_depth_coordinate(ray.depth);
    let thin = slab_thin_share(ray.depth);
    if ray.from_above {
        return thin * veil_row(3.0, coordinate);
    }
    let even = veil_row(2.0, coordinate) * pow(ray.cosine, VEIL_THICK);
    // Photons travel along -sun and leave along seen. From half the angle: near 1 the product of the two has no digits left.
    let half_sin = 0.5 * length(ray.seen + frame.sun.towards);
    let cosine = 1.0 - 2.0 * half_sin * half_sin;
    if cosine <= 0.0 {
        return thin * even;
    }
    return thin * (veil_row(0.0, coordinate) * exp(veil_row(1.0, coordinate) * log(cosine)) + even);
}
