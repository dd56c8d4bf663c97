// What a cumulus layer leaves of the sun's beam on the ground, multiplied with what other layers leave. The penumbra is that of
// a surface which is drawn over the width of the sun's disc.
@group(0) @binding(6) var<uniform> view: View;
@group(0) @binding(7) var<storage, read_write> beam: array<vec4<f32>>;

// Optical depth beyond which it is dark.
const CUMULUS_DARK: f32 = 40.0;
// A sun nearer to the horizon is taken as here.
const CUMULUS_LEAST_UP: f32 = 0.01;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let at = id.y * view.size.x + id.x;
    let place = texel_place(view, id.xy) - 0.5;
    let towards = normalize(vec3<f32>(cumulus.sun.xy, max(cumulus.sun.z, CUMULUS_LEAST_UP)));
    // From the ground to the layer at once.
    let low_m = max(cumulus.low_m, 0.0);
    let start = vec3<f32>(vec2<f32>(place.x, -place.y) * cumulus.extent_m - cumulus.offset_m, 0.0);
    let ray = CloudRay(start, towards, towards, 0.0);
    let near_m = low_m / towards.z;
    let far_m = cumulus.top_m / towards.z;
    let length_m = cumulus_length(ray, near_m, far_m, CUMULUS_DARK / cumulus.extinction.g, 2.0 * cumulus.sun_radius);
    let out_of_beam = select(vec3<f32>(1.0), cumulus.beam, view.peak == 1u);
    let left = exp(-out_of_beam * cumulus.extinction * length_m);
    beam[at] = select(beam[at], vec4<f32>(1.0), view.first == 1u) * vec4<f32>(left, left.g);
}
