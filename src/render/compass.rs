//! A test picture of directions: what lies where in a projection and an engine's axes, to be compared with what the engine
//! shows. It is drawn by the host, and takes nothing of the scene but the sun's place.

mod glyphs;

use crate::job::{RenderError, Watch};
use crate::projection::Sphere;
use crate::shade::dip;
use glyphs::{DOTS, has_dot};
use rayon::prelude::*;

type Colour = [f32; 3];

const BLACK: Colour = [0.0; 3];
const WHITE: Colour = [1.0; 3];
/// The sun.
const ORANGE: Colour = [1.0, 0.5, 0.0];
/// What is above the horizon and below it, and lines every 10 and every 30 degrees.
const SKY: Colour = [0.08, 0.16, 0.3];
const GROUND: Colour = [0.12, 0.08, 0.05];
const FINE: Colour = [0.3; 3];
const COARSE: Colour = [0.6; 3];

/// North, east, south and west: letter and colour, one every 90 degrees.
const POINTS: [(char, Colour); 4] =
    [('N', [1.0, 0.0, 0.0]), ('E', [0.0, 1.0, 0.0]), ('S', [0.0, 0.0, 1.0]), ('W', [1.0, 1.0, 0.0])];

/// Radius of the discs that mark north, east, south, west, up and down, and of the sun's; degrees.
const MARK_DEG: f64 = 3.0;
const SUN_DEG: f64 = 2.5;
/// Beyond them a ring is drawn to here, as a part of the radius.
const RING: f64 = 1.3;
/// Elevations between which letters and azimuths stand.
const LETTER_DEG: [f64; 2] = [7.0, 19.0];
const AZIMUTH_DEG: [f64; 2] = [3.0, 6.0];
/// Half the widths of lines.
const HORIZON_DEG: f64 = 0.5;
const POINT_LINE_DEG: f64 = 0.5;
const COARSE_DEG: f64 = 0.25;
const FINE_DEG: f64 = 0.15;
/// Nearer to straight up and down, lines every 10 degrees of azimuth would be one blot.
const LAST_FINE_DEG: f64 = 80.0;
/// Places of a texel that are looked at, a side.
const LOOKS: u32 = 2;
/// Texels between two looks at the clock.
const CHUNK: usize = 1 << 20;

/// Red, green and blue of every texel, top row first.
pub(super) fn texels(sphere: &Sphere, size: [u32; 2], sun: [f64; 3], watch: &Watch) -> Result<Vec<f32>, RenderError> {
    let scene = Compass { sun, horizon_deg: -dip(sphere.eye[2], 0.0).asin().to_degrees() };
    let (across, count) = (size[0] as usize, size[0] as usize * size[1] as usize);
    let mut data = vec![0.0; 3 * count];
    for (chunk, texels) in data.chunks_mut(3 * CHUNK).enumerate() {
        watch.look()?;
        texels.par_chunks_mut(3).enumerate().for_each(|(i, texel)| {
            let number = chunk * CHUNK + i;
            let corner = [(number % across) as f64, (number / across) as f64];
            let colours = (0..LOOKS * LOOKS).map(|look| {
                let inside = |step: u32| (f64::from(step) + 0.5) / f64::from(LOOKS);
                let place = [corner[0] + inside(look % LOOKS), corner[1] + inside(look / LOOKS)];
                sphere.direction(place, size).map_or(BLACK, |direction| scene.colour(direction))
            });
            for colour in colours {
                texel.iter_mut().zip(colour).for_each(|(sum, part)| *sum += part / (LOOKS * LOOKS) as f32);
            }
        });
    }
    Ok(data)
}

/// What is drawn.
struct Compass {
    sun: [f64; 3],
    horizon_deg: f64,
}

impl Compass {
    /// The colour of a direction (east, north, up).
    fn colour(&self, direction: [f64; 3]) -> Colour {
        let [east, north, up] = direction;
        let elevation = up.clamp(-1.0, 1.0).asin().to_degrees();
        let azimuth = east.atan2(north).to_degrees().rem_euclid(360.0);
        // The nearest of the four points, and how far to its right this is, on the sphere.
        let quarter = (azimuth / 90.0).round();
        let level = elevation.to_radians().cos();
        let beside = (azimuth - 90.0 * quarter) * level;
        let (letter, colour) = POINTS[quarter as usize % POINTS.len()];
        let from_sun = angle_deg(direction, self.sun);
        disc(from_sun, SUN_DEG, ORANGE, BLACK)
            .or_else(|| disc(90.0 - elevation, MARK_DEG, WHITE, BLACK))
            .or_else(|| disc(90.0 + elevation, MARK_DEG, BLACK, WHITE))
            .or_else(|| disc(beside.hypot(elevation), MARK_DEG, colour, BLACK))
            .or_else(|| text(&[letter], LETTER_DEG, beside, elevation).then_some(colour))
            .or_else(|| (beside.abs() < POINT_LINE_DEG && !is_between(elevation, LETTER_DEG)).then_some(colour))
            .or_else(|| ((elevation - self.horizon_deg).abs() < HORIZON_DEG).then_some(WHITE))
            .or_else(|| label(azimuth, elevation, level).then_some(WHITE))
            .or_else(|| grid(azimuth, elevation, level))
            .unwrap_or(if elevation > self.horizon_deg { SKY } else { GROUND })
    }
}

fn disc(away_deg: f64, radius_deg: f64, inside: Colour, ring: Colour) -> Option<Colour> {
    (away_deg < RING * radius_deg).then_some(if away_deg < radius_deg { inside } else { ring })
}

/// Between two unit vectors, degrees; exact for small ones.
fn angle_deg(one: [f64; 3], other: [f64; 3]) -> f64 {
    let chord = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    2.0 * (0.5 * chord).min(1.0).asin().to_degrees()
}

fn is_between(elevation: f64, [low, high]: [f64; 2]) -> bool {
    (low..high).contains(&elevation)
}

/// Whether characters between two elevations, centred, have a dot so far to the right.
fn text(characters: &[char], [low, high]: [f64; 2], right_deg: f64, elevation: f64) -> bool {
    let dot = (high - low) / DOTS[1] as f64;
    // One dot lies between two characters.
    let step = (DOTS[0] + 1) as f64;
    let right = right_deg / dot + 0.5 * (step * characters.len() as f64 - 1.0);
    let place = (right / step).floor();
    let Some(character) = (place >= 0.0).then(|| characters.get(place as usize)).flatten() else { return false };
    has_dot(*character, right - place * step, (high - elevation) / dot)
}

/// The azimuth in three digits, every 30 degrees but at the four points.
fn label(azimuth: f64, elevation: f64, level: f64) -> bool {
    let nearest = 30.0 * (azimuth / 30.0).round();
    if nearest % 90.0 == 0.0 || !is_between(elevation, AZIMUTH_DEG) {
        return false;
    }
    let number = nearest as u32;
    let digits = [number / 100, number / 10 % 10, number % 10].map(|digit| (b'0' + digit as u8) as char);
    text(&digits, AZIMUTH_DEG, (azimuth - nearest) * level, elevation)
}

fn grid(azimuth: f64, elevation: f64, level: f64) -> Option<Colour> {
    let away = |value: f64, step: f64| (value - step * (value / step).round()).abs();
    let near = |step: f64, half: f64, last: f64| {
        away(elevation, step) < half || (away(azimuth, step) * level < half && elevation.abs() < last)
    };
    if near(30.0, COARSE_DEG, 90.0) { Some(COARSE) } else { near(10.0, FINE_DEG, LAST_FINE_DEG).then_some(FINE) }
}
