// The sun's beam on the ground: what one layer leaves of it at each texel, multiplied with what the others leave. Means
// over the sun's disc, so that shadows have penumbras.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var bounds: texture_2d<f32>;
@group(0) @binding(4) var transmittance: texture_2d<f32>;
@group(0) @binding(5) var repeat: sampler;
@group(0) @binding(6) var clamped: sampler;
// rgb: parts left of the beam with its 5-degree peak; w: the same at 550 nm, however little comes through in all.
@group(0) @binding(7) var<storage, read_write> beam: array<vec4<f32>>;
// rgb: unscattered parts; w: at 550 nm.
@group(0) @binding(8) var<storage, read_write> unscattered: array<vec4<f32>>;

const PATH_SEEN: bool = false;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= view.rows {
        return;
    }
    let uv = texel_place(view, id.xy);
    var with_peak = vec4<f32>(0.0);
    var without = vec4<f32>(0.0);
    var count = 0.0;
    var i = 0u;
    loop {
        let towards = disc_direction(i);
        if towards.z > 0.0 || i == 0u {
            let cosine = max(towards.z, MIN_COSINE);
            // From the shift of the disc's middle, which the host wraps in double precision.
            let apart = (towards.xy / cosine - frame.sun.towards.xy / frame.sun.slant_cosine) * (frame.place.base_m / frame.place.extent_m);
            let base_uv = uv + frame.place.shift_uv + select(vec2<f32>(0.0), vec2<f32>(apart.x, -apart.y), frame.sun.discs > 1u);
            let path_m = path_while_lit(thickness, bounds, repeat, base_uv, towards);
            with_peak += vec4<f32>(sun_through(path_m).beam, exp(-frame.medium.beam_550 * frame.medium.extinction_550 * path_m));
            without += vec4<f32>(exp(-frame.medium.extinction * path_m), exp(-frame.medium.extinction_550 * path_m));
            count += 1.0;
        }
        continuing {
            i++;
            break if i >= frame.sun.discs;
        }
    }
    with_peak /= count;
    without = min(without / count, vec4<f32>(with_peak.rgb, 1.0));
    let at = id.y * view.size.x + id.x;
    if view.first == 0u {
        with_peak *= beam[at];
        without *= unscattered[at];
    }
    beam[at] = with_peak;
    unscattered[at] = without;
}

// Direction towards a place on the sun's disc: a spiral of equal areas (Vogel 1979); one place is the middle.
fn disc_direction(i: u32) -> vec3<f32> {
    let sun = frame.sun.towards;
    let radius = select(0.0, frame.sun.radius * sqrt((f32(i) + 0.5) / f32(frame.sun.discs)), frame.sun.discs > 1u);
    let angle = 2.3999632 * f32(i);
    let flat = vec2<f32>(-sun.y, sun.x);
    let side = select(vec3<f32>(flat / max(length(flat), 1e-9), 0.0), vec3<f32>(1.0, 0.0, 0.0), length(flat) < 1e-6);
    let up = cross(sun, side);
    return normalize(sun + radius * (cos(angle) * side + sin(angle) * up));
}
