//! Spectra of sun and eye.

/// Luminous flux of a watt at 555 nm, in kilolumens (SI: 683 lm/W).
const KILOLUMENS_PER_WATT: f64 = 0.683;
/// CIE XYZ to linear Rec.709: primaries of ITU-R BT.709, white D65 with X = 0.95047, Z = 1.08883 (ASTM E308, 2001).
const XYZ_TO_REC709: [[f64; 3]; 3] = [
    [3.240_454_2, -1.537_138_5, -0.498_531_4],
    [-0.969_266_0, 1.876_010_8, 0.041_556_0],
    [0.055_643_4, -0.204_025_9, 1.057_225_2],
];

/// What a nanometre of the sun's spectrum adds to the colour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) nm: f64,
    /// Linear Rec.709 of the sun's light in this nanometre, klx.
    pub(super) rec709: [f64; 3],
}

/// The sun's visible light above the air, by nanometres.
pub(super) fn sun_lines() -> Vec<Line> {
    // A heading, and then five numbers a line. The table is part of the program, and a test reads every line.
    include_str!("data/spectra.csv")
        .lines()
        .skip(1)
        .map(|line| {
            let mut numbers = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN));
            let [nm, sun, x, y, z] = std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN));
            let xyz = [x, y, z].map(|eye| KILOLUMENS_PER_WATT * sun * eye);
            Line { nm, rec709: XYZ_TO_REC709.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2]) }
        })
        .collect()
}

/// Linear Rec.709 of the sun above the air, klx, by its whole spectrum.
#[must_use]
pub fn bare_sun() -> [f64; 3] {
    sun_lines().iter().fold([0.0; 3], |sum, line| std::array::from_fn(|c| sum[c] + line.rec709[c]))
}

#[cfg(test)]
mod tests {
    use super::{XYZ_TO_REC709, sun_lines};
    use crate::spectrum::matrix::LUMINANCE;

    #[test]
    fn every_line_of_the_tables_is_read() {
        let lines = sun_lines();
        assert_eq!(lines.len(), 401);
        assert!(lines.iter().enumerate().all(|(i, line)| line.nm == 380.0 + i as f64));
        assert!(lines.iter().all(|line| line.rec709.iter().all(|channel| channel.is_finite())));
    }

    #[test]
    fn white_is_white_and_has_the_luminance_of_its_weights() {
        let white = XYZ_TO_REC709.map(|row| row[0] * 0.950_47 + row[1] + row[2] * 1.088_83);
        assert!(white.iter().all(|channel| (channel - 1.0).abs() < 1e-5), "{white:?}");
        // Each channel's luminance is its primary's Y: the inverse of the matrix has them in its middle row.
        for (column, y) in [0.0, 1.0, 0.0].into_iter().enumerate() {
            let weighted: f64 = (0..3).map(|row| LUMINANCE[row] * XYZ_TO_REC709[row][column]).sum();
            assert!((weighted - y).abs() < 1e-6, "{weighted}");
        }
    }
}
