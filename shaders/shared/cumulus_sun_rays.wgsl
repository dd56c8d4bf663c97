// Depth towards the sun from a place on a view ray: near the sun that of a ray of its own.
// Within this angle of the sun its depth is that of a ray of its own, as long as the path to the eye is no longer than this.
const CUMULUS_NEAR_SUN: f32 = 0.819152;
const CUMULUS_NEAR_SUN_DEPTH: f32 = 12.0;

// Optical depth towards the sun from a place on a ray, behind a depth towards the eye.
fn cumulus_towards_sun(ray: CloudRay, place: vec3<f32>, depth: f32) -> f32 {
    var towards_sun = textureSampleLevel(sun_depth, around, cumulus_cube(place), 0.0).x;
    if dot(ray.towards, cumulus.sun) > CUMULUS_NEAR_SUN && depth < CUMULUS_NEAR_SUN_DEPTH {
        let sun_ray = CloudRay(place, cumulus.sun, 0.0);
        let enough_m = 2.0 * CUMULUS_NEAR_SUN_DEPTH / cumulus.extinction.g;
        towards_sun = cumulus.extinction.g * cumulus_length(sun_ray, 0.0, cumulus_leaves(place, cumulus.sun), enough_m, 0.0);
    }
    return max(towards_sun, 0.0);
}
