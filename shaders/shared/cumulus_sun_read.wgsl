// Depth towards the sun from a place on a view ray that is nowhere near the sun, as shared/cumulus_sun_rays.wgsl finds it: software
// devices run through what a branch skips.
fn cumulus_towards_sun(ray: CloudRay, place: vec3<f32>, depth: f32) -> f32 {
    return max(textureSampleLevel(sun_depth, around, cumulus_cube(place), 0.0).x, 0.0);
}
