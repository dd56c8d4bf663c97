//! The sun's disc in a picture of the sky: how bright each texel of it is.
//!
//! A disc of half a degree is a fraction of a texel in most panoramas, and thousands of texels in a telescope's picture. In both
//! the radiance of a texel is the mean over it, so that the sum of radiance times solid angle is the beam's irradiance: texels are
//! cut into ever smaller parts where the disc's edge runs.

use crate::projection::{Sphere, SphereLayout};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Exponents of the limb darkening at 650, 550 and 450 nm: the radiance goes with mu^a, a = -0.023 + 0.292 / wavelength in
/// micrometres, mu being the cosine of the angle to the sun's surface (D. Hestroffer and C. Magnan, "Wavelength dependency of
/// the solar limb darkening", Astron. Astrophys. 333, 338-342, 1998).
const LIMB: [f64; 3] = [-0.023 + 0.292 / 0.65, -0.023 + 0.292 / 0.55, -0.023 + 0.292 / 0.45];

/// Radius of a sun that is a point, radians: no texel is as small.
const POINT: f64 = 1e-6;
/// Rings of equal area, and places on each, over which the disc's own light is summed.
const RINGS: u32 = 256;
const PLACES: u32 = 64;
/// Parts of texels as large as this part of the radius show one radiance; at the edge they are smaller.
const PART: f64 = 1.0 / 12.0;
const EDGE_PART: f64 = 1.0 / 256.0;
/// A part of a texel at the edge, of the texel, at most.
const EDGE_PARTS: f64 = 1.0 / 16.0;
/// Texels a side of the squares that are looked at as a whole, and places looked at on each.
const SQUARE: u32 = 16;
const LOOKS: u32 = 5;
/// Corners of a part are looked at so little within it: on the edge of a cube's face lies the next face.
const INSET: f64 = 1e-9;

/// The sun as an eye sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Disc {
    /// Unit vector towards its middle, where it appears (east, north, up).
    pub(crate) towards: [f64; 3],
    /// Irradiance of all of it that is above the horizon on a plane that faces it, at the eye, where `beam_sets`; else of all of
    /// it, whether or not the ground hides a part.
    pub(crate) beam: [f64; 3],
    /// Whether the beam is that of the part above the horizon.
    pub(crate) beam_sets: bool,
    /// Across it, radians; 0 is a point.
    pub(crate) diameter: f64,
    /// What air leaves of its light, at elevations (radians) spread evenly from its lower edge to its upper one, in any unit.
    pub(crate) through: [[f64; 3]; Self::LEVELS],
    /// Sine of the elevation at which the ground ends.
    pub(crate) horizon: f64,
}

impl Disc {
    /// Elevations of `through`.
    pub(crate) const LEVELS: usize = 9;

    fn radius(&self) -> f64 {
        (0.5 * self.diameter).max(POINT)
    }

    /// Elevation of a level of `through` for a middle at an elevation, radians.
    pub(crate) fn level(middle: f64, diameter: f64, level: usize) -> f64 {
        middle + diameter * (level as f64 / (Self::LEVELS - 1) as f64 - 0.5)
    }

    /// Radiance in a direction before it is brought to the beam; `None` beside the disc.
    fn shape(&self, direction: [f64; 3]) -> Option<[f64; 3]> {
        let out = distance(direction, self.towards) / self.radius();
        if out >= 1.0 {
            return None;
        }
        if direction[2] < self.horizon {
            return Some([0.0; 3]);
        }
        let low = Self::level(self.towards[2].clamp(-1.0, 1.0).asin(), 2.0 * self.radius(), 0);
        let last = (Self::LEVELS - 1) as f64;
        let at = ((direction[2].clamp(-1.0, 1.0).asin() - low) / (2.0 * self.radius()) * last).clamp(0.0, last);
        let below = (at as usize).min(Self::LEVELS - 2);
        let part = at - below as f64;
        let mu = (1.0 - out * out).sqrt();
        Some(std::array::from_fn(|c| {
            let through = self.through[below][c] * (1.0 - part) + self.through[below + 1][c] * part;
            mu.powf(LIMB[c]) * through
        }))
    }

    /// What brings the shape to the beam; 0 where nothing of the sun is up.
    fn gain(&self) -> [f64; 3] {
        let [east, north, up] = self.towards;
        // Two directions across it.
        let level = east.hypot(north);
        let right = if level > 0.0 { [north / level, -east / level, 0.0] } else { [1.0, 0.0, 0.0] };
        let top =
            [right[1] * up - right[2] * north, right[2] * east - right[0] * up, right[0] * north - right[1] * east];
        let whole = Self { horizon: if self.beam_sets { self.horizon } else { -2.0 }, ..*self };
        let mut sum = [0.0; 3];
        for (ring, place) in (0..RINGS).flat_map(|ring| (0..PLACES).map(move |place| (ring, place))) {
            let out = self.radius() * ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt();
            let (sin, cos) = (TAU * f64::from(place) / f64::from(PLACES)).sin_cos();
            let direction = unit(std::array::from_fn(|i| self.towards[i] + out * (cos * right[i] + sin * top[i])));
            let shape = whole.shape(direction).unwrap_or([0.0; 3]);
            (0..3).for_each(|c| sum[c] += shape[c]);
        }
        let each = PI * self.radius() * self.radius() / f64::from(RINGS * PLACES);
        std::array::from_fn(|c| if sum[c] > 0.0 { self.beam[c] / (sum[c] * each) } else { 0.0 })
    }

    /// Texels that show some of it, by their number from the first row of a band on, and the radiance that it adds to each.
    pub(crate) fn texels(&self, sphere: &Sphere, size: [u32; 2], first_row: u32, rows: u32) -> Vec<(usize, [f64; 3])> {
        let gain = self.gain();
        if gain == [0.0; 3] {
            return Vec::new();
        }
        let picture = Picture { sphere, size, disc: self };
        let end = first_row + rows;
        let squares: Vec<[u32; 2]> = (first_row..end)
            .step_by(SQUARE as usize)
            .flat_map(|y| (0..size[0]).step_by(SQUARE as usize).map(move |x| [x, y]))
            .collect();
        let texel = |x: u32, y: u32| {
            let light = picture.light([f64::from(x), f64::from(y)], [1.0; 2])?;
            let angle = picture.solid_angle([x, y]);
            let number = (y - first_row) as usize * size[0] as usize + x as usize;
            (angle > 0.0).then(|| (number, std::array::from_fn(|c| gain[c] * light[c] / angle)))
        };
        squares
            .into_par_iter()
            .filter(|corner| picture.may_meet(*corner))
            .flat_map_iter(|[left, top]| {
                let ends = [size[0].min(left + SQUARE), end.min(top + SQUARE)];
                (top..ends[1]).flat_map(move |y| (left..ends[0]).map(move |x| (x, y)))
            })
            .filter_map(|(x, y)| texel(x, y))
            .collect()
    }
}

/// A picture, and the disc in it.
struct Picture<'a> {
    sphere: &'a Sphere,
    size: [u32; 2],
    disc: &'a Disc,
}

impl Picture<'_> {
    fn at(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        self.sphere.direction([x, y], self.size)
    }

    /// Whether a square of texels may show some of the disc: it is no farther from one of the places that are looked at than
    /// these are from each other.
    fn may_meet(&self, corner: [u32; 2]) -> bool {
        let mut before: [Option<[f64; 3]>; LOOKS as usize] = [None; LOOKS as usize];
        let (mut nearest, mut apart) = (f64::INFINITY, 0.0_f64);
        for row in 0..LOOKS {
            let mut left: Option<[f64; 3]> = None;
            for column in 0..LOOKS {
                let at = |axis: usize, step: u32| {
                    let side = SQUARE.min(self.size[axis] - corner[axis]);
                    f64::from(corner[axis]) + f64::from(step * side) / f64::from(LOOKS - 1)
                };
                // Beside a disc that is the picture nothing is known.
                let Some(place) = self.at(at(0, column), at(1, row)) else { return true };
                nearest = nearest.min(distance(place, self.disc.towards));
                for near in [left, before[column as usize]].into_iter().flatten() {
                    apart = apart.max(distance(place, near));
                }
                (left, before[column as usize]) = (Some(place), Some(place));
            }
        }
        nearest <= self.disc.radius() + 1.5 * apart
    }

    /// Light of the disc, before its gain, in a part of a texel: radiance times solid angle.
    fn light(&self, [x, y]: [f64; 2], [wide, high]: [f64; 2]) -> Option<[f64; 3]> {
        let (radius, horizon) = (self.disc.radius(), self.disc.horizon);
        let inner = [wide, high].map(|side| side * (1.0 - INSET));
        let middle = self.at(x + 0.5 * wide, y + 0.5 * high);
        let corners = [[0.0, 0.0], [inner[0], 0.0], inner, [0.0, inner[1]]].map(|[u, v]| self.at(x + u, y + v));
        let mut split_across = wide >= high;
        if let (Some(middle), [Some(a), Some(b), Some(c), Some(d)]) = (middle, corners) {
            let reach = [a, b, c, d].into_iter().map(|corner| distance(middle, corner)).fold(0.0, f64::max);
            let away = distance(middle, self.disc.towards);
            if away > radius + 1.2 * reach || middle[2] + reach < horizon {
                return None;
            }
            let inside = away + reach < radius && middle[2] - reach > horizon;
            let small = reach < radius * EDGE_PART && wide * high <= EDGE_PARTS;
            if small || (inside && reach < radius * PART) {
                let angle = triangle(a, b, c) + triangle(a, c, d);
                return self.disc.shape(middle).map(|shape| shape.map(|value| value * angle));
            }
            // Near straight up and down, texels of an equirectangular picture are slivers.
            split_across = distance(a, b).max(distance(c, d)) >= distance(b, c).max(distance(d, a));
        } else if wide * high < LEAST_PART || (middle.is_none() && corners.iter().all(Option::is_none)) {
            return None;
        }
        let [first, second, size] = match split_across {
            true => [[x, y], [x + 0.5 * wide, y], [0.5 * wide, high]],
            false => [[x, y], [x, y + 0.5 * high], [wide, 0.5 * high]],
        };
        let sum = |sum: [f64; 3], part: [f64; 3]| std::array::from_fn(|c| sum[c] + part[c]);
        [first, second].into_iter().filter_map(|part| self.light(part, size)).reduce(sum)
    }

    /// Solid angle of a texel, steradians.
    fn solid_angle(&self, [x, y]: [u32; 2]) -> f64 {
        if self.sphere.layout == SphereLayout::Equirect {
            let sine = |row: u32| (0.5 * PI * (1.0 - 2.0 * f64::from(row) / f64::from(self.size[1]))).sin();
            return TAU / f64::from(self.size[0]) * (sine(y) - sine(y + 1));
        }
        let [x, y] = [f64::from(x), f64::from(y)];
        // All corners of a texel may be one direction, as those of an octahedron of one.
        let wide = match [0.0, 0.5, 1.0 - INSET].map(|step| self.at(x + step, y + step)) {
            [Some(one), Some(middle), Some(other)] => distance(one, middle) + distance(middle, other),
            _ => 1.0,
        };
        // Sides of parts are nearly straight.
        let parts = (wide / STRAIGHT).ceil().clamp(1.0, 64.0) as u32;
        let side = 1.0 / f64::from(parts);
        let part = |column: u32, row: u32| {
            // At the rim of a round picture only the middle may be in it: its surroundings stand for the part.
            let within = |half: f64| {
                let at = |right: f64, down: f64| {
                    let place = |step: u32, by: f64| (f64::from(step) + 0.5 + by * half * (1.0 - INSET)) * side;
                    self.at(x + place(column, right), y + place(row, down))
                };
                let [a, b, c, d] = [at(-1.0, -1.0)?, at(1.0, -1.0)?, at(1.0, 1.0)?, at(-1.0, 1.0)?];
                Some((triangle(a, b, c) + triangle(a, c, d)) / (4.0 * half * half))
            };
            within(0.5).or_else(|| within(0.01))
        };
        (0..parts).flat_map(|row| (0..parts).filter_map(move |column| part(column, row))).sum()
    }
}

/// Smallest part of a texel at the edge of a round picture.
const LEAST_PART: f64 = 1.0 / 1024.0;
/// Radians over which a curved side is as good as straight.
const STRAIGHT: f64 = 0.02;

/// Solid angle of a triangle of unit vectors (A. van Oosterom and J. Strackee, 1983).
fn triangle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // From the differences: of small triangles the vectors themselves would leave nothing.
    let less = |one: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| one[i] - a[i]) };
    let ([p, q, r], [u, v, w]) = (less(b), less(c));
    let volume = dot(a, [q * w - r * v, r * u - p * w, p * v - q * u]);
    2.0 * volume.abs().atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a))
}

fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn unit(vector: [f64; 3]) -> [f64; 3] {
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    vector.map(|part| part / length)
}
