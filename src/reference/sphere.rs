//! Directions of the texels of a view of the whole sky, and rays over a curved Earth. Twin of `shaders/shared/sphere.wgsl`.

use super::frame::vec3;
use crate::gpu::layout::SkyView;
use glam::{DVec2, DVec3, dvec2, dvec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Radius of the Earth, metres.
pub const EARTH_RADIUS_M: f64 = 6_371_000.0;
/// A ray that rises by less over a layer is taken to rise so much, metres.
pub const LEAST_RISE_M: f64 = 0.01;
/// Nearer to the eye nothing drifts, metres; nor within half a domain.
pub const DRIFT_FROM_M: f64 = 10_000.0;

/// Direction at a place of the picture, in texels from its upper left corner: east, north, up. `None` where the picture shows
/// none.
pub fn sphere_direction(view: &SkyView, texels: DVec2) -> Option<DVec3> {
    let place = texels / dvec2(view.size[0].into(), view.size[1].into());
    let (right, top) = (2.0 * place.x - 1.0, 1.0 - 2.0 * place.y);
    let turns = f64::from(view.turns);
    let [axis_x, axis_y, axis_z] = [view.axis_x, view.axis_y, view.axis_z].map(vec3);
    let vector = match view.kind {
        0 => {
            let (east, north) = (TAU * (f64::from(view.first_turn) + turns * place.x)).sin_cos();
            let (up, level) = (0.5 * PI * top).sin_cos();
            dvec3(level * east, level * north, up)
        }
        1 => {
            let up = 1.0 - right.abs() - top.abs();
            let folded = |value: f64| value - (-up).max(0.0).copysign(value);
            dvec3(folded(right), folded(top), up)
        }
        2 => {
            let face = (6.0 * place.y).floor().min(5.0);
            let down = 2.0 * (6.0 * place.y - face) - 1.0;
            let axis = match face as u32 {
                0 => dvec3(1.0, -down, -right),
                1 => dvec3(-1.0, -down, right),
                2 => dvec3(right, 1.0, down),
                3 => dvec3(right, -1.0, -down),
                4 => dvec3(right, -down, 1.0),
                _ => dvec3(-right, -down, -1.0),
            };
            axis_x * axis.x + axis_y * axis.y + axis_z * axis.z
        }
        3 => {
            let flat = dvec2(right, top);
            let out = flat.length();
            if out > 1.0 {
                return None;
            }
            let (level, up) = (TAU * turns * out).sin_cos();
            (flat.normalize_or_zero() * level).extend(up)
        }
        kind => {
            assert_eq!(kind, 4, "no such view of the sky");
            axis_z + axis_x * (right * f64::from(view.half_width)) + axis_y * (top * f64::from(view.half_height))
        }
    };
    Some(vector.normalize())
}

/// How much of the sphere a texel shows, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// From its lower edge to its upper one.
    pub rise: f64,
    /// Root of its solid angle.
    pub side: f64,
}

/// What a texel shows whose middle is a direction.
pub fn sphere_cone(view: &SkyView, direction: DVec3) -> Cone {
    let texel = 2.0 / f64::from(view.size[0]);
    let even = |side: f64| Cone { rise: side, side };
    match view.kind {
        0 => {
            let rise = PI / f64::from(view.size[1]);
            Cone { rise, side: rise * (1.0 - direction.z * direction.z).max(1e-6).powf(0.25) }
        }
        1 => even(texel * direction.abs().element_sum().powf(1.5)),
        3 => {
            let (rise, zenith) = (TAU * f64::from(view.turns) * texel, direction.z.clamp(-1.0, 1.0).acos());
            let around = if zenith > 0.0 { zenith.sin().max(1e-3) / zenith } else { 1.0 };
            Cone { rise, side: rise * around.sqrt() }
        }
        2 => {
            let near = direction.abs().max_element();
            Cone { rise: texel * near, side: texel * near.powf(1.5) }
        }
        _ => even(f64::from(view.half_width) * texel * direction.dot(vec3(view.axis_z)).powf(1.5)),
    }
}

/// Half the difference of the distances to the two places on a ray from height `h_m` that are at height `to_m`.
fn half_chord_m(h_m: f64, up: f64, to_m: f64) -> f64 {
    let (from, to) = (EARTH_RADIUS_M + h_m, EARTH_RADIUS_M + to_m);
    (to * to - from * from * (1.0 - up * up)).max(0.0).sqrt()
}

/// Distance along a ray from height `h_m` to where it is at `to_m`, rising (or from its lowest point on).
pub fn rising_distance(h_m: f64, up: f64, to_m: f64) -> f64 {
    half_chord_m(h_m, up, to_m) - (EARTH_RADIUS_M + h_m) * up
}

/// The same, sinking.
pub fn sinking_distance(h_m: f64, up: f64, to_m: f64) -> f64 {
    (-(EARTH_RADIUS_M + h_m) * up - half_chord_m(h_m, up, to_m)).max(0.0)
}

/// Height of the lowest point of a ray: below 0 if it meets the ground.
pub fn lowest_m(h_m: f64, up: f64) -> f64 {
    if up >= 0.0 { h_m } else { (EARTH_RADIUS_M + h_m) * (1.0 - up * up).max(0.0).sqrt() - EARTH_RADIUS_M }
}

/// Whether a ray misses the ground; a level one of an eye on the ground does.
pub fn misses_ground(h_m: f64, up: f64) -> bool {
    up >= 0.0 || lowest_m(h_m, up) > 0.0
}

/// Way over the ground below a point of a ray.
pub fn ground_way(h_m: f64, direction: DVec3, distance_m: f64) -> f64 {
    let level = distance_m * direction.truncate().length();
    EARTH_RADIUS_M * level.atan2(EARTH_RADIUS_M + h_m + distance_m * direction.z)
}

/// Cosine of a ray's zenith where it has come so far, in the upright there.
pub fn cosine_at(h_m: f64, up: f64, distance_m: f64, at_m: f64) -> f64 {
    ((EARTH_RADIUS_M + h_m) * up + distance_m) / (EARTH_RADIUS_M + at_m)
}

/// Direction of one of a texel's rays: places are a Kronecker sequence (Roberts, 2018). Those that fall beside the picture look
/// where the texel's middle does.
pub fn scattered_direction(view: &SkyView, middle: DVec2, direction: DVec3, ray: u32) -> DVec3 {
    let place = (f64::from(ray) + 0.5) * dvec2(0.754_877_67, 0.569_840_29);
    sphere_direction(view, middle + place.fract() - 0.5).unwrap_or(direction)
}

/// Cycles a domain of each wave of the drift, east and north, and what of one has passed in the middle.
const DRIFT_WAVES: [[f64; 3]; 4] =
    [[0.043_87, 0.163_72, 0.05], [-0.1931, 0.034_05, 0.27], [-0.221_65, 0.264_15, 0.65], [0.315_06, 0.220_61, 0.81]];

/// What of the domain a sky shows far from the eye lies so far from the place that is looked at, metres.
pub fn drift_m(view: &SkyView, extent_m: f64, place_m: DVec2) -> DVec2 {
    let away_m = (place_m - vec3(view.eye).truncate()).length();
    let far = ((away_m - DRIFT_FROM_M.max(0.5 * extent_m)) / extent_m).clamp(0.0, 1.0);
    let most_m = f64::from(view.drift) * extent_m * far * far * (3.0 - 2.0 * far);
    let wave = |[east, north, passed]: [f64; 3]| {
        let wave = dvec2(east, north);
        (TAU * (place_m.dot(wave) / extent_m + passed)).sin() * wave.perp() / wave.length_squared()
    };
    most_m * DRIFT_WAVES.into_iter().map(wave).sum::<DVec2>()
}

/// The rows of a picture of the sky that a view asks for: `texel` is called with its number in the band, and its middle in
/// texels.
pub fn sky_image<const CHANNELS: usize>(
    view: &SkyView,
    texel: impl Fn(usize, DVec2) -> [f64; CHANNELS] + Sync,
) -> Vec<f64> {
    let (across, texel) = (view.size[0] as usize, &texel);
    let middle = |x: usize, y: usize| dvec2(x as f64, (y + view.first_row as usize) as f64) + 0.5;
    let row = |y: usize| (0..across).flat_map(move |x| texel(y * across + x, middle(x, y)));
    (0..view.rows as usize).into_par_iter().flat_map_iter(row).collect()
}
