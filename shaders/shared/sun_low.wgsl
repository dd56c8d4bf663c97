// The beam of a sun so low that part of its 5-degree cone points upwards: it can't hold more than what comes through.
@group(0) @binding(SUN_NEXT) var transmittance: texture_2d<f32>;
@group(0) @binding(SUN_NEXT + 1u) var clamped: sampler;

fn beam_bounded(beam: vec3<f32>, path_m: f32) -> vec3<f32> {
    let depth = frame.medium.extinction_550 * path_m * frame.sun.slant_cosine;
    return min(beam, slab_transmittance(transmittance, clamped, depth, frame.sun.slant_cosine));
}
