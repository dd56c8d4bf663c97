// Where sunlight enters the cloud: irradiance of its top per horizontal irradiance above it, mean over each texel of the
// maps of sunlight. Faces that look at the sun get more, those in the shadow of others only what comes through these as a
// beam. 0 where there is no cloud. Of independent columns it is 1 everywhere, so that thin cloud beside a gap is lit as it
// would be without one; and views read it at the mean place of what they show, which may lie between two clouds.
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var thickness: texture_2d<f32>;
@group(0) @binding(2) var bounds: texture_2d<f32>;
@group(0) @binding(3) var repeat: sampler;
@group(0) @binding(4) var entry_out: texture_storage_2d<r32float, write>;

// A face at grazing sun gets up to 1 / cosine: bounded, so that no single texel outshines the map.
const MOST: f32 = 30.0;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.maps.texels || id.y >= frame.maps.texels {
        return;
    }
    if frame.maps.columns == 1u {
        textureStore(entry_out, id.xy, vec4<f32>(1.0));
        return;
    }
    let texel = 0.5 / vec2<f32>(textureDimensions(thickness));
    var sum = 0.0;
    for (var i = 0u; i < SUNLIGHT_SAMPLES; i++) {
        let uv = sunlight_sample(frame, id.xy, i);
        let place = uv + frame.place.offset_uv;
        let column = sample_periodic(thickness, repeat, place, 0u);
        if column.x > 0.0 {
            let height_m = column_top(column);
            let east = top_at(place + vec2<f32>(texel.x, 0.0)) - top_at(place - vec2<f32>(texel.x, 0.0));
            let north = top_at(place - vec2<f32>(0.0, texel.y)) - top_at(place + vec2<f32>(0.0, texel.y));
            let slope = vec2<f32>(east, north) / (2.0 * texel * frame.place.extent_m);
            let facing = 1.0 - dot(slope, frame.sun.towards.xy) / frame.sun.slant_cosine;
            var seen = 1.0;
            if frame.maps.columns == 0u && facing > 0.0 {
                let path_m = path_across(thickness, bounds, frame, uv, frame.sun.towards, height_m);
                seen = exp(-frame.medium.beam_550 * frame.medium.extinction_550 * path_m);
            }
            sum += seen * clamp(facing, 0.0, MOST);
        }
    }
    textureStore(entry_out, id.xy, vec4<f32>(sum / f32(SUNLIGHT_SAMPLES), 0.0, 0.0, 0.0));
}

// Height of the cloud's top above the base plane at a place of the map.
fn top_at(place: vec2<f32>) -> f32 {
    return column_top(sample_periodic(thickness, repeat, place, 0u));
}
