// A view ray in pieces of about equal shares of what is seen. Twin: src/reference/cumulus.rs.
@group(0) @binding(6) var sun_depth: texture_3d<f32>;

// Shares of the light that are looked at along a ray, about.
const CUMULUS_SHARES: f32 = 8.0;
// Pieces of a ray, at most.
const CUMULUS_PIECES: u32 = 64u;
// Optical depth, after the forward peak counts as not scattered, beyond which nothing is seen.
const CUMULUS_OPAQUE: f32 = 6.0;

// Where a place is in the lattice's textures.
fn cumulus_cube(place: vec3<f32>) -> vec3<f32> {
    let size = vec3<f32>(textureDimensions(sun_depth));
    let corner = vec3<f32>(-0.5 * cumulus.extent_m, -0.5 * cumulus.extent_m, cumulus.lattice_floor_m);
    return (place - corner) / (size * cumulus.cell_m);
}

// cone: width of what a texel shows, per metre of distance; wide_m: the same at any distance.
fn cumulus_seen(ray: CloudRay, near_m: f32, far_m: f32, cone: f32, wide_m: f32, background: vec3<f32>) -> CumulusSeen {
    let angle = 2.0 * atan2(length(ray.towards - cumulus.sun), length(ray.towards + cumulus.sun));
    var seen = CumulusSeen(vec3<f32>(0.0), 0.0);
    let scale = cumulus_scale();
    var march = CloudMarch(near_m, CUMULUS_UNKNOWN, 0.0, 0.0);
    var step = 0u;
    var pieces = 0u;
    // A piece is shaded once it is whole: software devices would shade at every step. They run through a loop's body once more where
    // it is left at its head, so these are left at their ends.
    loop {
        let shown = exp(-cumulus.kept.g * seen.depth);
        var piece = 0.0;
        var moment = 0.0;
        loop {
            let from_m = march.at_m;
            march = cumulus_march(scale, ray, march, far_m, cone * from_m + wide_m);
            let added = cumulus.extinction.g * march.density * march.length_m;
            piece += added;
            moment += added * (from_m + 0.5 * march.length_m);
            // A gap ends a piece: what comes next has another place.
            let share = shown * (1.0 - exp(-cumulus.kept.g * piece));
            let ends = piece > 0.0 && (added == 0.0 || share > 1.0 / CUMULUS_SHARES);
            continuing {
                step++;
                break if ends || step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m;
            }
        }
        if piece > 0.0 {
            seen.radiance += cumulus_piece(ray, angle, moment / piece, seen.depth, piece);
            seen.depth += piece;
        }
        continuing {
            pieces++;
            let hidden = cumulus.kept.g * seen.depth >= CUMULUS_OPAQUE;
            break if hidden || pieces >= CUMULUS_PIECES || step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m;
        }
    }
    seen.radiance += cumulus_behind(seen.depth, background);
    return seen;
}
