// The sun's light at cloud base and top, mean over each texel of the maps of sunlight, as parts of the horizontal
// irradiance above all layers. Twice: along the slanted ray that ends at the base, and by columns that are lit by what
// enters around them: the map of entry, blurred where the cloud is thick against the transport length.
//
// What goes on to a layer below counts as its sun's light: the beam with all that turned by less than 25 degrees. Below the
// lowest layer it is what that layer turns by less than 5.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var thickness: texture_2d<f32>;
@group(0) @binding(2) var bounds: texture_2d<f32>;
@group(0) @binding(3) var transmittance: texture_2d<f32>;
@group(0) @binding(4) var reflectance: texture_2d<f32>;
@group(0) @binding(5) var entry: texture_2d<f32>;
@group(0) @binding(6) var blurred: texture_2d<f32>;
@group(0) @binding(7) var above: texture_2d<f32>;
@group(0) @binding(8) var repeat: sampler;
@group(0) @binding(9) var clamped: sampler;
@group(0) @binding(10) var beam_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(11) var tilted_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(12) var entered_out: texture_storage_2d<rgba32float, write>;
@group(0) @binding(13) var reflected_out: texture_storage_2d<rgba32float, write>;

// Light spreads in clouds deeper than a third of a transport length (measured against Monte Carlo in three dimensions).
const SPREADING: f32 = 3.0;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.maps.texels || id.y >= frame.maps.texels {
        return;
    }
    let centre = (vec2<f32>(id.xy) + 0.5) / f32(frame.maps.texels);
    // What the layers above let go on.
    let lit = max(sample_periodic(above, repeat, centre + frame.place.above_uv, 0u).rgb, vec3<f32>(LEAST_LIT));
    let at_place = textureLoad(entry, id.xy, 0).x;
    let around = textureLoad(blurred, id.xy, 0).x;
    var entering_sum = 0.0;
    var beam = vec3<f32>(0.0);
    var tilted = vec3<f32>(0.0);
    var entered = vec3<f32>(0.0);
    var reflected = vec3<f32>(0.0);
    var sent_up = vec3<f32>(0.0);
    for (var i = 0u; i < SUNLIGHT_SAMPLES; i++) {
        let uv = sunlight_sample(frame, id.xy, i);
        let height_m = sample_periodic(thickness, repeat, uv + frame.place.offset_uv, 0u).x;
        let column_m = height_m / frame.sun.slant_cosine;
        var path_m = column_m;
        if frame.maps.columns != 1u {
            path_m = path_across(thickness, bounds, frame, uv, frame.sun.towards, 0.0);
        }
        let along = sun_through(path_m);
        let goes_on = going_on(along);
        beam += goes_on;
        tilted += along.total - goes_on;
        sent_up += slab_reflectance(reflectance, clamped, frame.medium.extinction_550 * path_m * frame.sun.slant_cosine, frame.sun.slant_cosine);
        // Light leaves a thin cloud where it came in.
        let spread = 1.0 - exp(-SPREADING * frame.medium.transport_550 * frame.medium.extinction_550 * height_m);
        let entering = mix(at_place, around, spread);
        entering_sum += entering;
        let down = sun_through(column_m);
        entered += entering * (down.total - going_on(down));
        reflected += entering
            * slab_reflectance(reflectance, clamped, frame.medium.extinction_550 * column_m * frame.sun.slant_cosine, frame.sun.slant_cosine);
    }
    let share = lit / f32(SUNLIGHT_SAMPLES);
    // What the slanted ray sends up is needed for its mean alone: it travels in the fourth channels, and so does entry.
    sent_up *= share;
    textureStore(beam_out, id.xy, vec4<f32>(beam * share, sent_up.r));
    textureStore(tilted_out, id.xy, vec4<f32>(tilted * share, sent_up.g));
    textureStore(entered_out, id.xy, vec4<f32>(entered * share, sent_up.b));
    textureStore(reflected_out, id.xy, vec4<f32>(reflected * share, entering_sum / f32(SUNLIGHT_SAMPLES)));
}

fn going_on(through: SunThrough) -> vec3<f32> {
    return select(through.forward, through.beam, frame.place.lowest == 1u);
}
