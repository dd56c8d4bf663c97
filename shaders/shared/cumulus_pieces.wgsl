// A view ray in pieces of about equal shares of what is seen. Twin: src/reference/cumulus.rs.
@group(0) @binding(6) var sun_depth: texture_3d<f32>;

// Shares of the light that are looked at along a ray, about.
const CUMULUS_SHARES: f32 = 8.0;
// Pieces of a ray, at most.
const CUMULUS_PIECES: u32 = 64u;
// Optical depth, after the forward peak counts as not scattered, beyond which nothing is seen.
const CUMULUS_OPAQUE: f32 = 6.0;
// Within this angle of the sun its depth is that of a ray of its own, as long as the path to the eye is no longer than this.
const CUMULUS_NEAR_SUN: f32 = 0.819152;
const CUMULUS_NEAR_SUN_DEPTH: f32 = 12.0;

// Where a place is in the lattice's textures.
fn cumulus_cube(place: vec3<f32>) -> vec3<f32> {
    let size = vec3<f32>(textureDimensions(sun_depth));
    let corner = vec3<f32>(-0.5 * cumulus.extent_m, -0.5 * cumulus.extent_m, cumulus.lattice_floor_m);
    return (place - corner) / (size * cumulus.cell_m);
}

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

// cone: width of what a texel shows, per metre of distance; wide_m: the same at any distance.
fn cumulus_seen(ray: CloudRay, near_m: f32, far_m: f32, cone: f32, wide_m: f32, background: vec3<f32>) -> CumulusSeen {
    let angle = 2.0 * atan2(length(ray.towards - cumulus.sun), length(ray.towards + cumulus.sun));
    var seen = CumulusSeen(vec3<f32>(0.0), 0.0);
    var march = CloudMarch(near_m, CUMULUS_UNKNOWN, 0.0, 0.0);
    var step = 0u;
    // A piece is shaded once it is whole: software devices would shade at every step.
    for (var i = 0u; i < CUMULUS_PIECES && march.at_m < far_m && cumulus.kept.g * seen.depth < CUMULUS_OPAQUE; i++) {
        var piece = 0.0;
        var moment = 0.0;
        var ends = false;
        for (; step < CUMULUS_VIEW_STEPS && march.at_m < far_m && !ends; step++) {
            let from_m = march.at_m;
            march = cumulus_march(ray, march, far_m, cone * from_m + wide_m);
            let added = cumulus.extinction.g * march.density * march.length_m;
            piece += added;
            moment += added * (from_m + 0.5 * march.length_m);
            // A gap ends a piece: what comes next has another place.
            let share = exp(-cumulus.kept.g * seen.depth) * (1.0 - exp(-cumulus.kept.g * piece));
            ends = piece > 0.0 && (added == 0.0 || share > 1.0 / CUMULUS_SHARES);
        }
        if piece > 0.0 {
            seen.radiance += cumulus_piece(ray, angle, moment / piece, seen.depth, piece);
            seen.depth += piece;
        }
    }
    seen.radiance += cumulus_behind(seen.depth, background);
    return seen;
}
