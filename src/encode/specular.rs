//! Levels of a cube map for reflections: each is the sky as a rougher mirror shows it.
//!
//! The mirror's slopes are those of Trowbridge and Reitz (GGX: Walter et al. 2007, Eurographics Symposium on Rendering, equation 33) with alpha the square of the
//! roughness, and it is seen from straight above, as the "split sum" of renderers takes it (Karis 2013, Real Shading in Unreal Engine 4): the light of a direction
//! at an angle t from the normal counts D(cos(t / 2)) cos(t). That is a mean around the normal, the same for all normals, so white stays white.
//! Level `i` of `n` has the roughness `i / (n - 1)`, as glTF viewers and Bevy look it up.

use rayon::prelude::*;

use super::mips::{self, Level};

/// Rings of places around a normal, and places in a ring, of the two first rough levels and of the others, which have few texels
/// and wide lobes. What is between two places is in the coarser levels that are looked up there.
const OF_FINE: [usize; 2] = [16, 12];
const OF_COARSE: [usize; 2] = [24, 16];
/// How many levels finer than that: a lookup between texels smears by a texel.
const SHARPER: f64 = 1.0;
/// Angles at which the weight is summed up.
const STEPS: usize = 4096;

/// All levels of the six faces of a cube, the faces themselves first.
pub(super) fn levels(faces: Vec<Level>, channels: usize) -> Vec<Vec<Level>> {
    let means = Means { levels: mips::levels_of_faces(faces, channels, false), channels };
    let count = means.levels.len();
    let rough: Vec<_> = (1..count).map(|i| means.seen_in(i, i as f64 / (count - 1) as f64)).collect();
    means.levels.into_iter().take(1).chain(rough).collect()
}

/// Means of the light over ever larger texels.
struct Means {
    /// Faces of each level.
    levels: Vec<Vec<Level>>,
    channels: usize,
}

/// A place beside a normal.
struct Place {
    /// Along two axes across it, and along itself.
    beside: [f64; 3],
    /// The level whose texels are as large as what it stands for.
    level: f64,
    /// All of them sum to 1.
    weight: f64,
}

impl Means {
    /// The faces of a level, in a mirror of a roughness.
    fn seen_in(&self, level: usize, roughness: f64) -> Vec<Level> {
        let side = self.levels[level][0].width;
        let places = self.places(level, roughness);
        let row = |face: usize, y: usize| {
            let mut row = Vec::with_capacity(side * self.channels);
            for x in 0..side {
                let normal = unit(direction(face, [coordinate(x as i64, side), coordinate(y as i64, side)]));
                let [across, along] = beside(normal);
                let mut sum = [0.0; 4];
                for Place { beside: [u, v, w], level, weight } in &places {
                    let direction = [0, 1, 2].map(|k| u * across[k] + v * along[k] + w * normal[k]);
                    self.add(direction, (*level, *weight), &mut sum);
                }
                row.extend(sum[..self.channels].iter().map(|sum| *sum as f32));
            }
            row
        };
        let face = |face: usize| Level {
            width: side,
            height: side,
            data: (0..side).into_par_iter().flat_map_iter(|y| row(face, y)).collect(),
        };
        (0..self.levels[level].len()).map(face).collect()
    }

    /// Places around a normal.
    fn places(&self, level: usize, roughness: f64) -> Vec<Place> {
        let [rings, in_ring] = if level < 3 { OF_FINE } else { OF_COARSE };
        let texels = (6 * self.levels[0][0].width * self.levels[0][0].width) as f64;
        let coarsest = (self.levels.len() - 1) as f64;
        let lobe = Lobe::new(roughness);
        let mut places = Vec::with_capacity(rings * in_ring);
        for ring in 0..rings {
            // The last rings, far from the normal, cover most of the sky for little of the light: they are made finer.
            let share = |part: f64| 1.0 - (1.0 - (ring as f64 + part) / rings as f64).powi(2);
            let [inner, outer] = [share(0.0), share(1.0)];
            let cosine = lobe.cosine(0.5 * (inner + outer));
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            let solid_angle = std::f64::consts::TAU * (lobe.cosine(inner) - lobe.cosine(outer)) / in_ring as f64;
            let own = 0.5 * (solid_angle * texels / (4.0 * std::f64::consts::PI)).log2() - SHARPER;
            for step in 0..in_ring {
                // Each ring is turned against the one before by the golden angle, so that no spokes form.
                let turn = (step as f64 / in_ring as f64 + ring as f64 * 0.381_966).fract() * std::f64::consts::TAU;
                places.push(Place {
                    beside: [sine * turn.cos(), sine * turn.sin(), cosine],
                    level: own.clamp(0.0, coarsest),
                    weight: (outer - inner) / in_ring as f64,
                });
            }
        }
        places
    }

    /// Adds the light from a direction, between two levels and four texels of each.
    fn add(&self, direction: [f64; 3], (level, weight): (f64, f64), sum: &mut [f64; 4]) {
        let (face, place) = on_face(direction);
        let lower = level.floor() as usize;
        let part = level - level.floor();
        for (level, share) in [(lower, 1.0 - part), (lower + 1, part)] {
            if share <= 0.0 {
                continue;
            }
            let side = self.levels[level][face].width;
            let [x, y] = place.map(|place| 0.5 * (place + 1.0) * side as f64 - 0.5);
            let (left, top) = (x.floor(), y.floor());
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let between = |offset: i32, part: f64| if offset == 0 { 1.0 - part } else { part };
                let weight = weight * share * between(dx, x - left) * between(dy, y - top);
                let texel = self.texel(level, face, [left as i64 + i64::from(dx), top as i64 + i64::from(dy)]);
                for (sum, value) in sum.iter_mut().zip(texel) {
                    *sum += weight * f64::from(*value);
                }
            }
        }
    }

    /// A texel of a face, or, beyond its edges, of the face there.
    fn texel(&self, level: usize, face: usize, place: [i64; 2]) -> &[f32] {
        let side = self.levels[level][face].width;
        let is_inside = place.iter().all(|place| (0..side as i64).contains(place));
        let (face, [x, y]) = if is_inside {
            (face, place.map(|place| place as usize))
        } else {
            let (face, place) = on_face(direction(face, place.map(|place| coordinate(place, side))));
            (face, place.map(|place| ((0.5 * (place + 1.0) * side as f64) as usize).min(side - 1)))
        };
        let at = (y * side + x) * self.channels;
        &self.levels[level][face].data[at..at + self.channels]
    }
}

/// How the light of a mirror that is seen from above is spread over angles from its normal.
struct Lobe {
    /// The part of it within an angle, at even steps from 0 to a right angle.
    within: Vec<f64>,
}

impl Lobe {
    fn new(roughness: f64) -> Self {
        let step = std::f64::consts::FRAC_PI_2 / STEPS as f64;
        let mut within = vec![0.0];
        let mut sum = 0.0;
        for i in 0..STEPS {
            let angle = step * (i as f64 + 0.5);
            sum += weight(roughness, angle.cos()) * angle.sin();
            within.push(sum);
        }
        within.iter_mut().for_each(|part| *part /= sum);
        Self { within }
    }

    /// The cosine of the angle within which a part of the light is, 0 to 1.
    fn cosine(&self, part: f64) -> f64 {
        let above = self.within.partition_point(|within| *within < part).clamp(1, STEPS);
        let [low, high] = [self.within[above - 1], self.within[above]];
        let between = if high > low { ((part - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        ((above as f64 - 1.0 + between) * std::f64::consts::FRAC_PI_2 / STEPS as f64).cos()
    }
}

/// Weight of the light from an angle with a cosine, in any unit.
fn weight(roughness: f64, cosine: f64) -> f64 {
    let alpha2 = roughness.powi(4);
    // The half vector's squared cosine is (1 + cosine) / 2.
    let slope = 1.0 - 0.5 * (1.0 + cosine) * (1.0 - alpha2);
    alpha2 / (slope * slope) * cosine.max(0.0)
}

/// Where the middle of a texel is on a face, -1 to 1 within it.
fn coordinate(texel: i64, side: usize) -> f64 {
    2.0 * (texel as f64 + 0.5) / side as f64 - 1.0
}

/// A direction, of any length, to a place on a face: the table of the Khronos and of Direct3D.
fn direction(face: usize, [s, t]: [f64; 2]) -> [f64; 3] {
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}

/// The face that a direction meets, and where.
fn on_face([x, y, z]: [f64; 3]) -> (usize, [f64; 2]) {
    let [along_x, along_y, along_z] = [x, y, z].map(f64::abs);
    if along_x >= along_y && along_x >= along_z {
        (usize::from(x < 0.0), [-z / x, -y / along_x])
    } else if along_y >= along_z {
        (2 + usize::from(y < 0.0), [x / along_y, z / y])
    } else {
        (4 + usize::from(z < 0.0), [x / z, -y / along_z])
    }
}

fn unit(vector: [f64; 3]) -> [f64; 3] {
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    vector.map(|part| part / length)
}

/// Two axes across a normal (Duff et al. 2017, Journal of Computer Graphics Techniques 6).
fn beside([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    let sign = 1.0_f64.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}
