// The sun's light at cloud base and top by a lattice in three dimensions, mean over each texel of the maps of sunlight, as
// parts of the horizontal irradiance above all layers: what base_light writes, so that the same passes go on.
//
// The lattice knows scattered light on its own grid. What is not scattered is that of the marched ray. Both together, times
// what makes the lattice exact where the cloud is even.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> lattice: LatticeLight;
@group(0) @binding(2) var thickness: texture_2d<f32>;
@group(0) @binding(3) var bounds: texture_2d<f32>;
@group(0) @binding(4) var transmittance: texture_2d<f32>;
@group(0) @binding(5) var reflectance: texture_2d<f32>;
@group(0) @binding(6) var scattered_down: texture_2d<f32>;
@group(0) @binding(7) var scattered_up: texture_2d<f32>;
@group(0) @binding(8) var factors: texture_2d<f32>;
@group(0) @binding(9) var above: texture_2d<f32>;
@group(0) @binding(10) var repeat: sampler;
@group(0) @binding(11) var clamped: sampler;
@group(0) @binding(12) var beam_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(13) var tilted_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(14) var entered_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(15) var reflected_out: texture_storage_2d<rgba32float, write>;

// A column that reflects less than this is next to none, and shows no more than this many times its own light.
const LEAST_REFLECTED: f32 = 1e-4;
const MOST_ENTERING: f32 = 8.0;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.maps.texels || id.y >= frame.maps.texels {
        return;
    }
    let centre = (vec2<f32>(id.xy) + 0.5) / f32(frame.maps.texels);
    // What the layers above let go on.
    let lit = max(sample_periodic(above, repeat, centre + frame.place.above_uv, 0u).rgb, vec3<f32>(LEAST_LIT));
    var entering = 0.0;
    var beam = vec3<f32>(0.0);
    var scattered = vec3<f32>(0.0);
    var reflected = vec3<f32>(0.0);
    for (var i = 0u; i < SUNLIGHT_SAMPLES; i++) {
        let uv = sunlight_sample(frame, id.xy, i);
        let place = uv + frame.place.offset_uv;
        let height_m = sample_periodic(thickness, repeat, place, 0u).x;
        let path_m = path_across(thickness, bounds, frame, uv, frame.sun.towards, 0.0);
        let through = sun_through(path_m);
        let goes_on = select(through.forward, through.beam, frame.place.lowest == 1u);
        let depth = frame.medium.extinction_550 * path_m * frame.sun.slant_cosine;
        let direct = exp(-lattice.kept * frame.medium.extinction * path_m);
        let down = factor(depth, 0.25) * (direct + sample_periodic(scattered_down, repeat, place, 0u).rgb);
        beam += goes_on;
        scattered += max(down - goes_on, vec3<f32>(0.0));
        let own_depth = frame.medium.extinction_550 * height_m;
        let up = factor(own_depth, 0.75) * sample_periodic(scattered_up, repeat, place, 0u).rgb;
        let own = slab_reflectance(reflectance, clamped, own_depth, frame.sun.slant_cosine);
        reflected += up;
        entering += min(up.g / max(own.g, LEAST_REFLECTED), MOST_ENTERING);
    }
    let share = lit / f32(SUNLIGHT_SAMPLES);
    // The fourth channels bring what is sent up to its mean: it has that already.
    reflected *= share;
    scattered *= share;
    textureStore(beam_out, id.xy, vec4<f32>(beam * share, reflected.r));
    textureStore(tilted_out, id.xy, vec4<f32>(scattered, reflected.g));
    textureStore(entered_out, id.xy, vec4<f32>(scattered, reflected.b));
    textureStore(reflected_out, id.xy, vec4<f32>(reflected, entering / f32(SUNLIGHT_SAMPLES)));
}

// Row of transmitted or of reflected light at an optical depth.
fn factor(depth: f32, row: f32) -> vec3<f32> {
    let nodes = f32(textureDimensions(factors).x);
    let node = sqrt(min(depth / lattice.reach, 1.0)) * (nodes - 1.0);
    return sample_clamped(factors, clamped, vec2<f32>((node + 0.5) / nodes, row)).rgb;
}
