// The beam of a sun so high that nothing within its 5-degree cone points upwards.
fn beam_bounded(beam: vec3<f32>, path_m: f32) -> vec3<f32> {
    return beam;
}
