// Slabs of all depths as a parallel view shows them, a depth an invocation. Uses the function sunlight of the method's file.

alias CloudView = View;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> view: CloudView;
@group(0) @binding(2) var transmittance: texture_2d<f32>;
@group(0) @binding(3) var reflectance: texture_2d<f32>;
@group(0) @binding(4) var clamped: sampler;
@group(0) @binding(5) var<storage, read_write> output: array<vec4<f32>>;
// The method's own bindings begin here.
const METHOD_BINDING: u32 = 6u;

// Depths in a row of invocations.
const SLABS_ACROSS: u32 = 64u;

fn cloud_texel(at: vec2<u32>) {
    let number = at.y * SLABS_ACROSS + at.x;
    if at.x >= SLABS_ACROSS || number >= SLABS_COUNT {
        return;
    }
    let depth = exp2(SLAB_LOG2_DEPTH_MIN + f32(number) / SLABS_PER_OCTAVE);
    let above = view.from_above == 1u;
    let cosine = clamp(select(-view.towards.z, view.towards.z, above), MIN_COSINE, 1.0);
    let path_m = depth / (frame.medium.extinction_550 * cosine);
    let none = vec2<f32>(0.0);
    let ray = ViewRay(view.towards, none, none, cosine, path_m, depth, above, 0.0, frame.place.depth_m, none, 0.0, 1.0);
    var light = vec3<f32>(0.0);
    if frame.sun.cosine > 0.0 {
        light = sunlight(ray);
    }
    output[3u * number] = vec4<f32>(slab_reflectance(reflectance, clamped, depth, cosine), 0.0);
    output[3u * number + 1u] = vec4<f32>(slab_transmittance(transmittance, clamped, depth, cosine), 0.0);
    output[3u * number + 2u] = vec4<f32>(light, 0.0);
}
