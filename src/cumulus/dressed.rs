//! Light scattered once, dressed with what is scattered forward on its way: the sharp part of a cloud's light, from a table.

use crate::optics::Channel;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Angles and paths of the table.
pub const ANGLES: usize = 192;
/// See [`ANGLES`].
pub const PATHS: usize = 48;
/// Path of the last column, and how the columns lie: `PATH_SCALE (PATH_BASE^(j / (PATHS - 1)) - 1)`.
pub const PATH_SCALE: f64 = 0.2;
/// See [`PATH_SCALE`].
pub const PATH_BASE: f64 = 601.0;
/// What the path to and from the place of scattering counts more than its length; fitted on Monte Carlo's back-lit clouds.
pub const DETOUR: f64 = 0.005;

/// How droplets scatter in a colour, for the lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scattering {
    /// Part of extinction that is left when the forward peak counts as not scattered, `1 - w f`.
    pub kept: f64,
    /// Single-scattering albedo of that, `w (1 - f) / kept`.
    pub albedo: f64,
    /// Its asymmetry, `(chi_1 - f) / (1 - f)`.
    pub asymmetry: f64,
}

impl Scattering {
    /// With the forward peak `f = chi_2` (J. H. Joseph, W. J. Wiscombe and J. A. Weinman, "The delta-Eddington approximation", 1976), and none where
    /// light is scattered backwards: `f` is no more than the asymmetry, without which what is left would be more than backward.
    pub fn new(channel: &Channel) -> Self {
        let moment = |l: usize| channel.moments.get(l).copied().unwrap_or(0.0);
        let forward = moment(2).min(moment(1)).clamp(0.0, 0.999);
        let kept = 1.0 - channel.albedo * forward;
        Self {
            kept,
            albedo: channel.albedo * (1.0 - forward) / kept,
            asymmetry: (moment(1) - forward) / (1.0 - forward),
        }
    }

    /// Single-scattering albedo and asymmetry of the droplets, with their forward peak.
    pub fn droplets(&self) -> (f64, f64) {
        let albedo = self.albedo * self.kept + 1.0 - self.kept;
        let forward = (1.0 - self.kept) / albedo.max(1e-12);
        (albedo, self.asymmetry * (1.0 - forward) + forward)
    }
}

/// Light of a sun of irradiance 1 scattered towards the eye by a piece of cloud of optical depth 1 at 550 nm, over (path, angle): the path is
/// the optical depth from the sun plus that to the eye, at 550 nm too, with its detour; the angle that between the directions to the sun
/// and of view. `ratio`: the colour's extinction over that at 550 nm. What is scattered more than
/// once and at last forward is in it (S. Goudsmit and J. L. Saunderson, 1940, along the path), less what the lattice holds.
///
/// Values are 1/sr; rows are paths. All colours of a cloud are so read at one place.
pub fn table(channel: &Channel, ratio: f64) -> Vec<f64> {
    let scattering = Scattering::new(channel);
    let (albedo, kept) = (channel.albedo, scattering.kept);
    let forward = (1.0 - kept) / albedo.max(1e-12);
    let cosines: Vec<f64> = (0..ANGLES).map(|i| angle(i).cos()).collect();
    let rows = (0..PATHS).into_par_iter().map(|j| {
        let path = stretched(ratio * straight(path(j)));
        let along = |a: f64| {
            if path < 1e-4 {
                a * (1.0 - path * (1.0 - 0.5 * a))
            } else {
                ((-path * (1.0 - a)).exp() - (-path).exp()) / path
            }
        };
        let weights = channel.moments.iter().enumerate().map(|(l, &moment)| {
            let weight = match l {
                0 | 1 => along(albedo * forward) + (-kept * path).exp() * albedo * (moment - forward),
                _ => along(albedo * moment),
            };
            (2 * l + 1) as f64 * weight
        });
        let weights: Vec<f64> = weights.collect();
        let sum = |cosine: f64| {
            let (mut before, mut now, mut sum) = (0.0, 1.0, 0.0);
            for (l, weight) in weights.iter().enumerate() {
                sum += weight * now;
                let l = l as f64;
                (before, now) = (now, ((2.0 * l + 1.0) * cosine * now - l * before) / (l + 1.0));
            }
            ratio * (sum / (4.0 * PI)).max(0.0)
        };
        cosines.iter().map(|&cosine| sum(cosine)).collect::<Vec<f64>>()
    });
    rows.collect::<Vec<_>>().concat()
}

/// A path with its detour.
pub fn stretched(path: f64) -> f64 {
    path * (1.0 + DETOUR * path)
}

/// And without.
fn straight(stretched: f64) -> f64 {
    2.0 * stretched / (1.0 + (1.0 + 4.0 * DETOUR * stretched).sqrt())
}

/// The tables of red, green, blue of a cloud with such extinctions.
pub fn tables(channels: &[Channel; 3], extinction_per_m: [f64; 3]) -> [Vec<f64>; 3] {
    std::array::from_fn(|c| table(&channels[c], extinction_per_m[c] / extinction_per_m[1]))
}

/// Angle of a column, radians: close together near the sun.
pub fn angle(column: usize) -> f64 {
    let part = column as f64 / (ANGLES - 1) as f64;
    PI * part * part
}

/// Path of a row.
pub fn path(row: usize) -> f64 {
    PATH_SCALE * (PATH_BASE.powf(row as f64 / (PATHS - 1) as f64) - 1.0)
}

/// Column and row, as real numbers, of an angle and a path.
pub fn place(angle: f64, path: f64) -> [f64; 2] {
    let column = (ANGLES - 1) as f64 * (angle / PI).max(0.0).sqrt();
    let row = (PATHS - 1) as f64 * (path / PATH_SCALE).ln_1p() / PATH_BASE.ln();
    [column.min((ANGLES - 1) as f64), row.min((PATHS - 1) as f64)]
}
