// Depth towards the sun from a place on a view ray: near the sun that of a ray of its own.
// From this angle of the sun on, its cosine, and from this path to the eye on, its depth is more and more that of a ray of its own, all within these.
const CUMULUS_NEAR_SUN: f32 = 0.819152; // 35 degrees
const CUMULUS_AT_SUN: f32 = 0.891007;   // 27 degrees
const CUMULUS_NEAR_SUN_DEPTH: f32 = 12.0;
const CUMULUS_AT_SUN_DEPTH: f32 = 8.0;

// Optical depth towards the sun from a place on a ray, behind a depth towards the eye.
fn cumulus_towards_sun(ray: CloudRay, place: vec3<f32>, depth: f32) -> f32 {
    let of_cubes = textureSampleLevel(sun_depth, around, cumulus_cube(place), 0.0).x;
    let near = (dot(ray.towards, cumulus.sun) - CUMULUS_NEAR_SUN) / (CUMULUS_AT_SUN - CUMULUS_NEAR_SUN);
    let shallow = (CUMULUS_NEAR_SUN_DEPTH - depth) / (CUMULUS_NEAR_SUN_DEPTH - CUMULUS_AT_SUN_DEPTH);
    let own = clamp(near, 0.0, 1.0) * clamp(shallow, 0.0, 1.0);
    var of_ray = 0.0;
    if own > 0.0 {
        let sun_ray = CloudRay(place, cumulus.sun, cumulus.sun, 0.0);
        let enough_m = 2.0 * CUMULUS_NEAR_SUN_DEPTH / cumulus.extinction.g;
        of_ray = cumulus.extinction.g * cumulus_length(sun_ray, 0.0, cumulus_leaves(place, cumulus.sun), enough_m, 0.0);
    }
    return mix(max(of_cubes, 0.0), of_ray, own);
}
