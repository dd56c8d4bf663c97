// What comes through cloud along the sun's ray, as parts of the irradiance above it. Uses the bindings frame,
// transmittance and clamped of the pass: what it takes is the same in each.
struct SunThrough {
    total: vec3<f32>, // all of it
    beam: vec3<f32>,  // what left the beam by less than 5 degrees, or not at all
    forward: vec3<f32>, // by less than 25: what goes on as the sun's light to the next layer
}

fn sun_through(path_m: f32) -> SunThrough {
    let depth = frame.medium.extinction_550 * path_m * frame.sun.slant_cosine;
    let total = slab_transmittance(transmittance, clamped, depth, frame.sun.slant_cosine);
    // At grazing sun part of the 5-degree cone points upwards: the beam can't hold more than what comes through.
    let beam = min(exp(-frame.medium.beam * frame.medium.extinction * path_m), total);
    let forward = min(exp(-frame.medium.forward * frame.medium.extinction * path_m), total);
    return SunThrough(total, beam, forward);
}
