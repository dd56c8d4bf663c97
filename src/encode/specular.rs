//! Levels of a cube map for reflections: each is the sky as a rougher mirror shows it.
//!
//! The mirror's slopes are those of Trowbridge and Reitz (GGX: Walter et al. 2007, Eurographics Symposium on Rendering, equation 33) with alpha the square of the
//! roughness, and it is seen from straight above, as the "split sum" of renderers takes it (Karis 2013, Real Shading in Unreal Engine 4): the light of a direction
//! at an angle t from the normal counts D(cos(t / 2)) cos(t). That is a mean around the normal, the same for all normals, so white stays white.
//! Level `i` of `n` has the roughness `i / (n - 1)`, as glTF viewers and Bevy look it up.

use glam::{Vec2, Vec3A, Vec4};
use rayon::prelude::*;

use super::mips::{self, Level, View};

/// Rings of places around a normal, and places in a ring, of the two first rough levels and of the others, which have few texels
/// and wide lobes. What is between two places is in the coarser levels that are looked up there.
const OF_FINE: [usize; 2] = [14, 11];
const OF_COARSE: [usize; 2] = [24, 16];
/// How many levels finer than that: a lookup between texels smears by a texel.
const SHARPER: f64 = 1.0;
/// Angles at which the weight is summed up.
const STEPS: usize = 4096;

/// The levels of the six faces of a cube below the faces themselves.
pub(super) fn further(faces: &[View<'_>], channels: usize) -> Vec<Vec<Level>> {
    let mut means = mips::further_of_faces(faces, channels, false);
    let mut levels = vec![Bordered::of(faces, channels)];
    for faces in &means {
        let faces: Vec<View<'_>> = faces.iter().map(Level::view).collect();
        levels.push(Bordered::of(&faces, channels));
    }
    let bordered = Means { levels, channels };
    let roughest = means.len();
    for (level, faces) in means.iter_mut().enumerate() {
        *faces = bordered.seen_in(level + 1, (level + 1) as f64 / roughest as f64);
    }
    means
}

/// Means of the light over ever larger texels.
struct Means {
    /// Faces of each level.
    levels: Vec<Vec<Bordered>>,
    channels: usize,
}

/// A face with a border of one texel from the faces beside it, so that what lies between texels is looked up without asking where a face
/// ends; four channels, as a vector unit takes them.
struct Bordered {
    /// Texels a side, without the border.
    side: usize,
    texels: Vec<Vec4>,
}

impl Bordered {
    fn of(faces: &[View<'_>], channels: usize) -> Vec<Self> {
        let bordered = |face: usize| {
            let side = faces[face].width;
            let all = -1..=side as i64;
            let row = |y: i64| all.clone().map(move |x| Self::texel(faces, channels, face, [x, y]));
            Self { side, texels: all.clone().flat_map(row).collect() }
        };
        (0..faces.len()).map(bordered).collect()
    }

    /// A texel of a face, or, beyond its edges, of the face there.
    fn texel(faces: &[View<'_>], channels: usize, face: usize, place: [i64; 2]) -> Vec4 {
        let side = faces[face].width;
        let is_inside = place.iter().all(|place| (0..side as i64).contains(place));
        let (face, [x, y]) = if is_inside {
            (face, place.map(|place| place as usize))
        } else {
            let (face, place) = on_face(direction(face, place.map(|place| coordinate(place, side))));
            (face, place.to_array().map(|place| ((0.5 * (place + 1.0) * side as f32) as usize).min(side - 1)))
        };
        let at = (y * side + x) * channels;
        let mut texel = [0.0; 4];
        texel[..channels].copy_from_slice(&faces[face].data[at..at + channels]);
        Vec4::from_array(texel)
    }

    /// The light at a place of the face, between four texels.
    fn light(&self, place: Vec2) -> Vec4 {
        // The first texel of the border is at -1.
        let at = (0.5 * self.side as f32) * (place + 1.0) + 0.5;
        let (left, top) = ((at.x as usize).min(self.side), (at.y as usize).min(self.side));
        let (right, low) = (at.x - left as f32, at.y - top as f32);
        let upper = &self.texels[top * (self.side + 2) + left..][..self.side + 4];
        let [a, b, c, d] = [upper[0], upper[1], upper[self.side + 2], upper[self.side + 3]];
        let (above, below) = (a + right * (b - a), c + right * (d - c));
        above + low * (below - above)
    }
}

/// A place beside a normal.
struct Place {
    /// Along two axes across it, and along itself.
    beside: [f32; 3],
    /// The level whose texels are as large as what it stands for, and the part of the next one.
    level: (usize, f32),
    /// All of them sum to 1.
    weight: f32,
}

impl Means {
    /// The faces of a level, in a mirror of a roughness.
    fn seen_in(&self, level: usize, roughness: f64) -> Vec<Level> {
        let side = self.levels[level][0].side;
        let places = self.places(level, roughness);
        let row = |face: usize, y: usize| {
            let mut row = Vec::with_capacity(side * self.channels);
            for x in 0..side {
                let normal = direction(face, [x, y].map(|place| coordinate(place as i64, side))).normalize();
                let [across, along] = beside(normal);
                let mut sum = Vec4::ZERO;
                for &Place { beside: [u, v, w], level, weight } in &places {
                    sum += weight * self.light(u * across + v * along + w * normal, level);
                }
                row.extend_from_slice(&sum.to_array()[..self.channels]);
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
        let texels = (6 * self.levels[0][0].side * self.levels[0][0].side) as f64;
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
            let level = own.clamp(0.0, coarsest);
            for step in 0..in_ring {
                // Each ring is turned against the one before by the golden angle, so that no spokes form.
                let turn = (step as f64 / in_ring as f64 + ring as f64 * 0.381_966).fract() * std::f64::consts::TAU;
                places.push(Place {
                    beside: [sine * turn.cos(), sine * turn.sin(), cosine].map(|part| part as f32),
                    level: (level as usize, level.fract() as f32),
                    weight: ((outer - inner) / in_ring as f64) as f32,
                });
            }
        }
        places
    }

    /// The light from a direction, between two levels.
    fn light(&self, direction: Vec3A, (level, part): (usize, f32)) -> Vec4 {
        let (face, place) = on_face(direction);
        let fine = self.levels[level][face].light(place);
        if part == 0.0 {
            return fine;
        }
        let coarse = self.levels[level + 1][face].light(place);
        fine + part * (coarse - fine)
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
fn coordinate(texel: i64, side: usize) -> f32 {
    (2.0 * (texel as f64 + 0.5) / side as f64 - 1.0) as f32
}

/// A direction, of any length, to a place on a face: the table of the Khronos and of Direct3D.
fn direction(face: usize, [s, t]: [f32; 2]) -> Vec3A {
    match face {
        0 => Vec3A::new(1.0, -t, -s),
        1 => Vec3A::new(-1.0, -t, s),
        2 => Vec3A::new(s, 1.0, t),
        3 => Vec3A::new(s, -1.0, -t),
        4 => Vec3A::new(s, -t, 1.0),
        _ => Vec3A::new(-s, -t, -1.0),
    }
}

/// The face that a direction meets, and where.
fn on_face(direction: Vec3A) -> (usize, Vec2) {
    let [x, y, z] = direction.to_array();
    let [along_x, along_y, along_z] = direction.abs().to_array();
    if along_x >= along_y && along_x >= along_z {
        (usize::from(x < 0.0), Vec2::new(-z / x, -y / along_x))
    } else if along_y >= along_z {
        (2 + usize::from(y < 0.0), Vec2::new(x / along_y, z / y))
    } else {
        (4 + usize::from(z < 0.0), Vec2::new(x / z, -y / along_z))
    }
}

/// Two axes across a normal (Duff et al. 2017, Journal of Computer Graphics Techniques 6).
fn beside(normal: Vec3A) -> [Vec3A; 2] {
    let [x, y, z] = normal.to_array();
    let sign = 1.0_f32.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [Vec3A::new(1.0 + sign * x * x * a, sign * b, -sign * x), Vec3A::new(b, sign + y * y * a, -y)]
}
