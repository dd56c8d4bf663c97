// A view ray in pieces of about equal shares of what is seen. Twin: src/reference/cumulus.rs.
@group(0) @binding(6) var sun_depth: texture_3d<f32>;

// Shares of the light that are looked at along a ray, about.
const CUMULUS_SHARES: f32 = 8.0;
// Pieces of a ray, at most.
const CUMULUS_PIECES: u32 = 64u;
// Optical depth, after the forward peak counts as not scattered, beyond which nothing is seen.
const CUMULUS_OPAQUE: f32 = 6.0;

// Mean depth, in parts of a stretch that lets exp(-x) through, at which its light is scattered: 1/2 in a thin one, 1/x in a deep one.
fn cumulus_mean_depth(x: f32) -> f32 {
    return select(1.0 / max(x, 0.3) - 1.0 / (exp(min(x, 80.0)) - 1.0), 0.5 - x / 12.0 + x * x * x / 720.0, x < 0.3);
}

// Optical depth before the middle of a piece, as it is seen.
fn cumulus_middle(before: f32, piece: f32) -> f32 {
    return before + piece * cumulus_mean_depth(cumulus.kept.g * piece);
}

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
    // What was marched through beyond the end of a piece: optical depth, where it begins, and how long it is.
    var rest = vec3<f32>(0.0);
    // A piece is shaded once it is whole: software devices would shade at every step. They run through a loop's body once more where
    // it is left at its head, so these are left at their ends.
    loop {
        // Pieces end where their share is seen, within steps: where whole steps made pieces, their number drew contour lines.
        let left = CUMULUS_SHARES * exp(-cumulus.kept.g * seen.depth);
        let room = select(1e9, -log(max(1.0 - 1.0 / left, 1e-6)) / cumulus.kept.g, left > 1.0);
        let first = min(rest.x, room);
        let first_m = rest.z * first / max(rest.x, 1e-12);
        let kept = cumulus.kept.g;
        var piece = first;
        // Weighted places and weights.
        var met = cumulus_alpha(kept * first) * vec2<f32>(rest.y + first_m * cumulus_mean_depth(kept * first), 1.0);
        rest = vec3<f32>(rest.x - first, rest.y + first_m, rest.z - first_m);
        var whole = rest.x > 0.0;
        loop {
            if !whole {
                let from_m = march.at_m;
                march = cumulus_march(scale, ray, march, far_m, cone * from_m + wide_m);
                let added = cumulus.extinction.g * march.density * march.length_m;
                let taken = min(added, room - piece);
                let taken_m = march.length_m * taken / max(added, 1e-12);
                // A gap ends a piece: what comes next has another place.
                whole = piece + taken > 0.0 && (added == 0.0 || taken < added);
                let middle_m = from_m + taken_m * cumulus_mean_depth(kept * taken);
                met += exp(-kept * piece) * cumulus_alpha(kept * taken) * vec2<f32>(middle_m, 1.0);
                piece += taken;
                rest = vec3<f32>(added - taken, from_m + taken_m, march.length_m - taken_m);
                step++;
            }
            continuing {
                break if whole || step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m;
            }
        }
        // The least piece may have no weight in single precision.
        if met.y > 0.0 {
            seen.radiance += cumulus_piece(ray, angle, met.x / met.y, seen.depth, piece);
            seen.depth += piece;
        }
        continuing {
            pieces++;
            let hidden = cumulus.kept.g * seen.depth >= CUMULUS_OPAQUE;
            let marched = step >= CUMULUS_VIEW_STEPS || march.at_m >= far_m;
            break if hidden || pieces >= CUMULUS_PIECES || (marched && rest.x <= 0.0);
        }
    }
    seen.radiance += cumulus_behind(seen.depth, background);
    return seen;
}
