//! Rays among concentric spheres, in forms that keep their digits.
//!
//! Heights are metres above sea level, cosines are those of the angle between the ray and the local zenith. The
//! textbook forms subtract numbers of the size of the planet's radius squared; these subtract heights.

/// Radius of the planet at sea level, m.
pub const PLANET_RADIUS_M: f64 = 6_371_000.0;
/// Height at which the air ends, m.
pub const TOP_M: f64 = 100_000.0;
/// An eye or a table never comes nearer to the top than this, m: there the ray to the top has no direction.
const TOP_MARGIN_M: f64 = 1.0;

/// Distance from the centre of the planet, m.
#[must_use]
pub fn radius_m(height_m: f64) -> f64 {
    PLANET_RADIUS_M + height_m
}

/// A height inside the air: clamped to what lies between the lower boundary and just below the top.
#[must_use]
pub fn inside(height_m: f64, floor_m: f64) -> f64 {
    height_m.min(TOP_M - TOP_MARGIN_M).max(floor_m)
}

/// Height at `distance_m` along a ray that starts at `height_m` with the given cosine.
#[must_use]
pub fn height_along(height_m: f64, cosine: f64, distance_m: f64) -> f64 {
    let r = radius_m(height_m);
    let change = distance_m * (2.0 * r * cosine + distance_m);
    height_m + change / (r + (r * r + change).max(0.0).sqrt())
}

/// Square of the distance from `upper_m` to the horizon of the sphere at `lower_m`, m2.
fn horizon_square(lower_m: f64, upper_m: f64) -> f64 {
    (upper_m - lower_m) * (2.0 * PLANET_RADIUS_M + upper_m + lower_m)
}

/// Distance from a height to the horizon of the sphere at `floor_m`, m; 0 at or below the floor.
#[must_use]
pub fn horizon_distance(height_m: f64, floor_m: f64) -> f64 {
    horizon_square(floor_m, height_m).max(0.0).sqrt()
}

/// Sine of the horizon's dip: a ray with a cosine below minus this meets the sphere at `floor_m`.
#[must_use]
pub fn sin_dip(height_m: f64, floor_m: f64) -> f64 {
    horizon_distance(height_m, floor_m) / radius_m(height_m)
}

/// Distance to the sphere at `floor_m` at or below the start; `None` where the ray misses it.
#[must_use]
pub fn distance_down(height_m: f64, cosine: f64, floor_m: f64) -> Option<f64> {
    if cosine >= -sin_dip(height_m, floor_m) {
        return None;
    }
    let down = -radius_m(height_m) * cosine;
    let square = horizon_square(floor_m, height_m).max(0.0);
    Some(square / (down + (down * down - square).max(0.0).sqrt()))
}

/// Distance to the sphere at `ceiling_m` at or above the start, m.
#[must_use]
pub fn distance_up(height_m: f64, cosine: f64, ceiling_m: f64) -> f64 {
    let along = radius_m(height_m) * cosine;
    let square = horizon_square(height_m, ceiling_m).max(0.0);
    let root = (along * along + square).sqrt();
    if along > 0.0 { square / (along + root) } else { root - along }
}

/// Cosine of an angle to the zenith after `distance_m` along a ray.
///
/// `direction_zenith` is the cosine at the start between the direction in question and the zenith, `direction_ray`
/// that between the direction and the ray: with the ray itself this is the ray's own local cosine, with the sun the
/// local sun's.
#[must_use]
pub fn cosine_along(height_m: f64, direction_zenith: f64, direction_ray: f64, distance_m: f64, there_m: f64) -> f64 {
    let cosine = (radius_m(height_m) * direction_zenith + distance_m * direction_ray) / radius_m(there_m);
    cosine.clamp(-1.0, 1.0)
}
