// Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha.
//
// Method "analytic": a texel is a slab as deep as the view ray's cloud. Sunlight: light scattered once and twice by the
// medium without its forward peak, in closed form; light that met the peak alone (order 0); and all higher orders as
// even radiance, closed against the exact fluxes. Light of sky and ground is even, so by reciprocity its scattered
// part is the plane albedo or transmittance at the view angle.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var transmittance: texture_2d<f32>;
@group(0) @binding(4) var reflectance: texture_2d<f32>;
@group(0) @binding(5) var closure: texture_2d<f32>;
@group(0) @binding(6) var phase: texture_2d<f32>;
@group(0) @binding(7) var aureole: texture_2d<f32>;
@group(0) @binding(8) var upwelling: texture_2d<f32>;
@group(0) @binding(9) var repeat: sampler;
@group(0) @binding(10) var clamped: sampler;
@group(0) @binding(11) var<storage, read_write> output: array<f32>;

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
    if id.x >= view.size || id.y >= view.rows {
        return;
    }
    let place = (vec2<f32>(f32(id.x), f32(id.y + view.first_row)) + 0.5) / f32(view.size) - 0.5;
    let from_above = view.from_above == 1u;
    let plane_m = select(frame.base_m, view.top_m, from_above);
    let position = vec3<f32>(vec2<f32>(place.x, -place.y) * frame.extent_m, plane_m);
    let to_eye = view.eye.xyz - position;
    let seen = select(view.towards.xyz, to_eye / max(length(to_eye), 1e-6), view.towards.w > 0.5);
    // The view ray, climbing through the layer.
    let up = select(-seen, seen, from_above);
    let cosine = clamp(up.z, MIN_COSINE, 1.0);
    let sunk_m = select(0.0, view.top_m - frame.base_m, from_above);
    let base_uv = domain_uv(position.xy - up.xy / cosine * sunk_m, frame.extent_m);
    let path_m = path_in_layer(thickness, repeat, frame, base_uv, up);

    let clear = exp(-frame.extinction.w * path_m);
    let depth = frame.extinction.w * path_m * cosine;
    let reflected = slab_reflectance(reflectance, clamped, depth, cosine);
    let transmitted = max(slab_transmittance(transmittance, clamped, depth, cosine) - clear, vec3<f32>(0.0));
    let ground = sample_periodic(upwelling, repeat, base_uv, 0u).rgb / PI;
    var light = select(frame.sky_light.rgb * transmitted + ground * reflected,
        frame.sky_light.rgb * reflected + ground * transmitted, from_above);
    if frame.sun_light.w > 0.0 {
        light += sunlight(seen, path_m, cosine, depth, from_above);
    }
    let at = 4u * (id.y * view.size + id.x);
    output[at] = light.r;
    output[at + 1u] = light.g;
    output[at + 2u] = light.b;
    output[at + 3u] = 1.0 - clear;
}

fn closure_row(row: f32, coordinate: f32) -> vec3<f32> {
    return sample_clamped(closure, clamped, vec2<f32>(coordinate, (row + 0.5) / CLOSURE_ROWS)).rgb;
}

fn sunlight(seen: vec3<f32>, path_m: f32, cosine: f32, depth: f32, from_above: bool) -> vec3<f32> {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = min(0.5 * length(seen + frame.sun.xyz), 1.0);
    let half_cos = min(0.5 * length(seen - frame.sun.xyz), 1.0);
    let angle = phase_coordinate(half_sin, half_cos);
    let once = frame.smooth_albedo.rgb * sample_clamped(phase, clamped, vec2<f32>(angle, 0.25)).rgb;
    let twice = frame.smooth_albedo.rgb * frame.smooth_albedo.rgb
        * sample_clamped(phase, clamped, vec2<f32>(angle, 0.75)).rgb;

    let coordinate = slab_depth_coordinate(depth);
    let first_row = select(3.0, 0.0, from_above);
    let factor1 = closure_row(first_row, coordinate);
    let factor2 = closure_row(first_row + 1.0, coordinate);
    let higher = closure_row(first_row + 2.0, coordinate) * slab_thin_share(depth);

    let path_v = frame.smooth_part.rgb * frame.extinction.rgb * path_m;
    let path_l = path_v * (cosine / frame.sun.w);
    var order1: vec3<f32>;
    var order2: vec3<f32>;
    for (var i = 0; i < 3; i++) {
        if from_above {
            order1[i] = slab_order1_reflected(path_l[i], path_v[i]);
            order2[i] = slab_order2_reflected(path_l[i], path_v[i]);
        } else {
            order1[i] = slab_order1_transmitted(path_l[i], path_v[i]);
            order2[i] = slab_order2_transmitted(path_l[i], path_v[i]);
        }
    }
    var light = factor1 * once * order1 + factor2 * twice * order2 + higher * (frame.sun.w / PI);
    if !from_above && half_sin < AUREOLE_HALF_SIN_MAX {
        light += forward_light(half_sin, frame.extinction.rgb * path_m, path_v);
    }
    return frame.sun_light.rgb * light;
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
