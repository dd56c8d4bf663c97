// The sun's light of a layer relative to a slab's under the open sun, as the maps of sunlight have it.
fn sun_reaches(ray: ViewRay, share: vec4<f32>) -> vec3<f32> {
    return share.rgb;
}
