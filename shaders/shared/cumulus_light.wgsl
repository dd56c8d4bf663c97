// Light of a cumulus layer along a view ray, by the lattice. Twin: src/reference/cumulus.rs.
@group(0) @binding(6) var light_red: texture_3d<f32>; // of each colour: mean radiance, moments along x, y, z
@group(0) @binding(7) var light_green: texture_3d<f32>;
@group(0) @binding(8) var light_blue: texture_3d<f32>;
@group(0) @binding(9) var sun_depth: texture_3d<f32>;
@group(0) @binding(10) var dressed: texture_2d<f32>;  // light scattered once: angle, path
@group(0) @binding(11) var linear: sampler;

// Shares of the light that are looked at along a ray, about.
const CUMULUS_SHARES: f32 = 8.0;
// Pieces of a ray, at most.
const CUMULUS_PIECES: u32 = 64u;
// Optical depth, after the forward peak counts as not scattered, beyond which nothing is seen.
const CUMULUS_OPAQUE: f32 = 6.0;
// Within this angle of the sun its depth is that of a ray of its own, as long as the path to the eye is no longer than this.
const CUMULUS_NEAR_SUN: f32 = 0.819152;
const CUMULUS_NEAR_SUN_DEPTH: f32 = 12.0;
// What a path counts more than its length.
const CUMULUS_DETOUR: f32 = 0.005;
const CUMULUS_PATH_SCALE: f32 = 0.2;
const CUMULUS_PATH_LOG: f32 = 6.39859493; // ln 601

// What is seen along a ray.
struct CumulusSeen {
    radiance: vec3<f32>, // that the cloud sends, without what shines through unscattered
    depth: f32,          // optical depth at 550 nm
}

// A piece of a ray that is shaded as one.
fn cumulus_piece(ray: CloudRay, angle: f32, at_m: f32, before: f32, piece: f32) -> vec3<f32> {
    let place = cumulus_place(ray, at_m);
    let size = vec3<f32>(textureDimensions(light_red));
    let corner = vec3<f32>(-0.5 * cumulus.extent_m, -0.5 * cumulus.extent_m, cumulus.lattice_floor_m);
    let uvw = (place - corner) / (size * cumulus.cell_m);
    let red = textureSampleLevel(light_red, around, uvw, 0.0);
    let green = textureSampleLevel(light_green, around, uvw, 0.0);
    let blue = textureSampleLevel(light_blue, around, uvw, 0.0);
    let towards = ray.towards + vec3<f32>(0.0, 0.0, ray.bend * at_m);
    let middle = before + 0.5 * piece;
    var towards_sun = textureSampleLevel(sun_depth, around, uvw, 0.0).x;
    if dot(ray.towards, cumulus.sun) > CUMULUS_NEAR_SUN && middle < CUMULUS_NEAR_SUN_DEPTH {
        let sun_ray = CloudRay(place, cumulus.sun, 0.0);
        let enough_m = 2.0 * CUMULUS_NEAR_SUN_DEPTH / cumulus.extinction.g;
        towards_sun = cumulus.extinction.g * cumulus_length(sun_ray, 0.0, cumulus_leaves(place, cumulus.sun), enough_m, 0.0);
    }
    let ratio = cumulus.extinction / cumulus.extinction.g;
    let path = ratio * (middle + max(towards_sun, 0.0));
    let stretched = path * (1.0 + CUMULUS_DETOUR * path);
    let table = vec2<f32>(textureDimensions(dressed));
    let u = (sqrt(angle / PI) * (table.x - 1.0) + 0.5) / table.x;
    let v = (log(1.0 + stretched / CUMULUS_PATH_SCALE) / CUMULUS_PATH_LOG * (table.y - 1.0) + 0.5) / table.y;
    let once = vec3<f32>(
        textureSampleLevel(dressed, linear, vec2<f32>(u, v.r), 0.0).r,
        textureSampleLevel(dressed, linear, vec2<f32>(u, v.g), 0.0).g,
        textureSampleLevel(dressed, linear, vec2<f32>(u, v.b), 0.0).b,
    );
    let kept = cumulus.kept * ratio;
    let share = exp(-kept * before) - exp(-kept * (before + piece));
    let mean = vec3<f32>(red.x, green.x, blue.x);
    let flux = vec3<f32>(dot(red.yzw, towards), dot(green.yzw, towards), dot(blue.yzw, towards));
    return cumulus.irradiance * once * ratio * piece + share * cumulus.albedo * max(mean - cumulus.asymmetry * flux, vec3<f32>(0.0));
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
    let total = seen.depth * cumulus.extinction / cumulus.extinction.g;
    seen.radiance += background * (exp(-cumulus.kept * total) - exp(-total));
    return seen;
}

// 1 - exp(-depth), with all digits where the cloud is thin: colour may be divided by it.
fn cumulus_alpha(depth: f32) -> f32 {
    return select(1.0 - exp(-depth), depth * (1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667))), depth < 0.1);
}
