//! Tiling noise on hashed lattices. Twin of `shaders/shared/noise.wgsl`; the hash is the same integer arithmetic.

use glam::{DVec2, IVec2, UVec2, dvec2, ivec2, uvec2};
use std::f64::consts::TAU;

/// Standard deviation of [`noise_gradient`], measured over many lattices.
pub const GRADIENT_NOISE_STD: f64 = 0.2151;

/// Cycles per domain of the lowest octave of a field.
pub const NOISE_LOWEST_PERIOD: i32 = 3;

/// Hash of a lattice point (Jarzynski and Olano 2020, "pcg2d").
pub fn noise_hash(x: u32, y: u32) -> UVec2 {
    const A: u32 = 1_664_525;
    const C: u32 = 1_013_904_223;
    let mut x = x.wrapping_mul(A).wrapping_add(C);
    let mut y = y.wrapping_mul(A).wrapping_add(C);
    x = x.wrapping_add(y.wrapping_mul(A));
    y = y.wrapping_add(x.wrapping_mul(A));
    (x, y) = (x ^ (x >> 16), y ^ (y >> 16));
    x = x.wrapping_add(y.wrapping_mul(A));
    y = y.wrapping_add(x.wrapping_mul(A));
    uvec2(x ^ (x >> 16), y ^ (y >> 16))
}

/// Two uniform numbers in [0, 1) for a point of a lattice that repeats after `period` points.
pub fn noise_pair(cell: IVec2, period: i32, seed: u32) -> DVec2 {
    debug_assert!(period > 0, "a lattice repeats after {period}");
    let wrapped = cell.rem_euclid(IVec2::splat(period)).as_uvec2();
    let salt = noise_hash(seed, 0x9e37_79b9);
    let bits = noise_hash(wrapped.x ^ salt.x, wrapped.y ^ salt.y);
    (bits >> UVec2::splat(8)).as_dvec2() / 16_777_216.0
}

/// Value at `from_cell` (lattice units) of the random slope of a lattice point.
pub fn noise_slope(cell: IVec2, period: i32, seed: u32, from_cell: DVec2) -> f64 {
    DVec2::from_angle(TAU * noise_pair(cell, period, seed).x).dot(from_cell)
}

/// Gradient noise (Perlin 2002: quintic fade), mean 0, at a place in lattice units.
pub fn noise_gradient(place: DVec2, period: i32, seed: u32) -> f64 {
    let cell = place.floor().as_ivec2();
    let t = place - place.floor();
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let a = noise_slope(cell, period, seed, t);
    let b = noise_slope(cell + ivec2(1, 0), period, seed, t - dvec2(1.0, 0.0));
    let c = noise_slope(cell + ivec2(0, 1), period, seed, t - dvec2(0.0, 1.0));
    let d = noise_slope(cell + ivec2(1, 1), period, seed, t - dvec2(1.0, 1.0));
    mix(mix(a, b, fade.x), mix(c, d, fade.x), fade.y)
}

/// Gradient noise on a turned lattice: `[a, b]` of its steps along a row of the tile, without a common divisor. `uv`: part of the
/// tile.
pub fn noise_turned(uv: DVec2, [a, b]: [i32; 2], seed: u32) -> f64 {
    let [along, across] = [a, b].map(f64::from);
    let place = dvec2(along * uv.x - across * uv.y, across * uv.x + along * uv.y);
    let cell = place.floor().as_ivec2();
    let t = place - place.floor();
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let salt = noise_hash(seed, 0x9e37_79b9);
    let slope = |corner: IVec2| {
        let step = cell + corner;
        let point = (b * step.x - a * step.y).rem_euclid(a * a + b * b);
        let bits = noise_hash(point as u32 ^ salt.x, salt.y);
        DVec2::from_angle(TAU * f64::from(bits.x >> 8) / 16_777_216.0).dot(t - corner.as_dvec2())
    };
    let low = mix(slope(ivec2(0, 0)), slope(ivec2(1, 0)), fade.x);
    mix(low, mix(slope(ivec2(0, 1)), slope(ivec2(1, 1)), fade.x), fade.y)
}

/// Feature point of a cell, inside it. It goes round in a circle, one to three times in either sense while the slowest
/// goes once.
pub fn noise_point(cell: IVec2, period: i32, seed: u32, turns: f64) -> DVec2 {
    let way = noise_pair(cell, period, seed.wrapping_add(1));
    let times = (1.0 + (3.0 * way.x).floor()) * if way.y < 0.5 { 1.0 } else { -1.0 };
    let angle = TAU * (2.0 * way.y + times * turns);
    0.15 + 0.7 * noise_pair(cell, period, seed) + 0.15 * DVec2::from_angle(angle)
}

/// Distance to the second nearest feature point minus that to the nearest, cell units (Worley 1996).
pub fn noise_cell_edge(place: DVec2, period: i32, seed: u32, turns: f64) -> f64 {
    let cell = place.floor().as_ivec2();
    let t = place - place.floor();
    let (mut nearest, mut second) = (9.0_f64, 9.0_f64);
    for y in -1..=1 {
        for x in -1..=1 {
            let neighbour = ivec2(x, y);
            let away = (neighbour.as_dvec2() + noise_point(cell + neighbour, period, seed, turns) - t).length();
            second = second.min(nearest.max(away));
            nearest = nearest.min(away);
        }
    }
    second - nearest
}

fn mix(a: f64, b: f64, part: f64) -> f64 {
    a + (b - a) * part
}
