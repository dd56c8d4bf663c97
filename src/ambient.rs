//! The sky's light in nine numbers a colour: real spherical harmonics to the second degree.
//!
//! Order: (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2), (2,-1), (2,0), (2,1), (2,2), of the functions of R. Ramamoorthi and P.
//! Hanrahan ("An efficient representation for irradiance environment maps", 2001), orthonormal on the sphere, without the
//! sign (-1)^m, for x, y, z of a frame of [`crate::axes`]: 0.282095; 0.488603 (y, z, x); 1.092548 (xy, yz), 0.315392 (3 z² - 1), 1.092548 xz,
//! 0.546274 (x² - y²).

use crate::axes::Axes;
use std::f64::consts::PI;

/// Light from all directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Ambient {
    /// Coefficients of radiance; red, green, blue.
    pub radiance: [[f64; 3]; 9],
    /// The same convolved with the clamped cosine: of the irradiance of a plane by its normal.
    pub irradiance: [[f64; 3]; 9],
}

/// The nine functions in a direction: x, y, z of the frame that their coefficients are told in.
pub fn basis([x, y, z]: [f64; 3]) -> [f64; 9] {
    [
        0.282_094_791_8,
        0.488_602_511_9 * y,
        0.488_602_511_9 * z,
        0.488_602_511_9 * x,
        1.092_548_430_6 * x * y,
        1.092_548_430_6 * y * z,
        0.315_391_565_3 * (3.0 * z * z - 1.0),
        1.092_548_430_6 * x * z,
        0.546_274_215_3 * (x * x - y * y),
    ]
}

impl Ambient {
    /// Projects a panorama of the projection `equirect` whose left edge is north: rows of red, green, blue, twice as wide as high.
    /// The coefficients are those of the functions of x, y, z in `axes`.
    pub fn of_panorama(texels: &[f32], [width, height]: [u32; 2], axes: Axes) -> Self {
        let mut radiance = [[0.0; 3]; 9];
        // Sine of the elevation of a row's edge.
        let edge = |row: u32| (PI * (0.5 - f64::from(row) / f64::from(height))).sin();
        for (i, texel) in (0_u32..).zip(texels.chunks_exact(3)) {
            let (column, row) = (i % width, i / width);
            let (high, low) = (edge(row), edge(row + 1));
            let solid_angle = 2.0 * PI / f64::from(width) * (high - low);
            // The mean of the sine over the texel's solid angle.
            let up = 0.5 * (high + low);
            let level = (1.0 - up * up).max(0.0).sqrt();
            let (east, north) = (2.0 * PI * (f64::from(column) + 0.5) / f64::from(width)).sin_cos();
            for (sum, value) in radiance.iter_mut().zip(basis(axes.of([level * east, level * north, up]))) {
                for (sum, light) in sum.iter_mut().zip(texel) {
                    *sum += solid_angle * value * f64::from(*light);
                }
            }
        }
        let cosine = [PI, 2.0 * PI / 3.0, PI / 4.0];
        let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2];
        let irradiance = std::array::from_fn(|i| radiance[i].map(|value| value * cosine[degree[i]]));
        Self { radiance, irradiance }
    }

    /// Irradiance of a plane by its normal (unit vector in the frame of the coefficients).
    pub fn irradiance_at(&self, normal: [f64; 3]) -> [f64; 3] {
        let basis = basis(normal);
        std::array::from_fn(|c| self.irradiance.iter().zip(basis).map(|(of, value)| of[c] * value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A panorama of a function of the direction, the same in all colours.
    fn panorama(height: u32, light: impl Fn([f64; 3]) -> f64) -> Vec<f32> {
        let texel = |i: u32| {
            let (x, y) = (i % (2 * height), i / (2 * height));
            let (east, north) = (PI * (f64::from(x) + 0.5) / f64::from(height)).sin_cos();
            let (up, level) = (PI * (0.5 - (f64::from(y) + 0.5) / f64::from(height))).sin_cos();
            [light([level * east, level * north, up]) as f32; 3]
        };
        (0..2 * height * height).flat_map(texel).collect()
    }

    const NORMALS: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, 0.8], [0.48, -0.6, 0.64]];

    /// Light of degrees 0 to 2 is exact but for the texels' size: an even sky gives pi, one that grows with height 2 pi / 3.
    #[test]
    fn smooth_skies_have_their_closed_forms() {
        let even = Ambient::of_panorama(&panorama(64, |_| 1.0), [128, 64], Axes::Enu);
        let slope = Ambient::of_panorama(&panorama(64, |[_, _, z]| 1.0 + z), [128, 64], Axes::Enu);
        for normal in NORMALS {
            assert!((even.irradiance_at(normal)[0] - PI).abs() < 1e-3 * PI);
            let wanted = PI + 2.0 * PI / 3.0 * normal[2];
            assert!((slope.irradiance_at(normal)[1] - wanted).abs() < 2e-3 * PI, "{normal:?}");
        }
    }

    /// Nine numbers hold the irradiance of any sky to a few per cent (Ramamoorthi and Hanrahan: 1 % on the mean, 9 % at worst):
    /// here of a dark ground under a sky with a glow, against the sum over the panorama.
    #[test]
    fn a_glowing_sky_shines_on_planes_as_its_panorama_does() {
        let glow = |[x, y, z]: [f64; 3]| {
            if z < 0.0 { 0.1 } else { 1.0 + 4.0 * (0.6 * x - 0.48 * y + 0.64 * z).max(0.0).powi(8) }
        };
        let (height, width) = (96_u32, 192_u32);
        let texels = panorama(height, glow);
        let ambient = Ambient::of_panorama(&texels, [width, height], Axes::Enu);
        for normal in NORMALS {
            let mut wanted = 0.0;
            for (i, texel) in (0_u32..).zip(texels.chunks(3)) {
                let (x, y) = (i % width, i / width);
                let (east, north) = (2.0 * PI * (f64::from(x) + 0.5) / f64::from(width)).sin_cos();
                let (up, level) = (PI * (0.5 - (f64::from(y) + 0.5) / f64::from(height))).sin_cos();
                let cosine = level * east * normal[0] + level * north * normal[1] + up * normal[2];
                let solid_angle = 2.0 * PI / f64::from(width) * PI / f64::from(height) * level;
                wanted += f64::from(texel[0]) * cosine.max(0.0) * solid_angle;
            }
            let found = ambient.irradiance_at(normal)[0];
            assert!((found - wanted).abs() < 0.09 * 4.0, "{normal:?}: {found}, not {wanted}");
        }
    }

    /// A plane gets the same light whatever the frame is that its normal and the coefficients are told in.
    #[test]
    fn every_frame_tells_the_same_light() {
        let texels =
            panorama(32, |[x, y, z]| 3.0 + x - 0.5 * y + 2.0 * z + x * y - 2.0 * y * z + (x + 0.3 * z).max(0.0));
        let plain = Ambient::of_panorama(&texels, [64, 32], Axes::Enu);
        for axes in Axes::ALL {
            let told = Ambient::of_panorama(&texels, [64, 32], axes);
            for normal in NORMALS {
                let (found, wanted) = (told.irradiance_at(axes.of(normal))[2], plain.irradiance_at(normal)[2]);
                // Sums of 2,048 texels, rounded in another order.
                assert!((found / wanted - 1.0).abs() < 1e-10, "{axes:?}, {normal:?}: {found}, not {wanted}");
            }
            assert_eq!(told == plain, matches!(axes, Axes::Enu | Axes::Blender), "{axes:?}");
        }
    }
}
