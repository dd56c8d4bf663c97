//! What files say of their colours, and the way from other primaries to those of Rec.709.

use super::error::ImageError;

/// A 3 x 3 matrix, row by row.
pub type Matrix = [[f64; 3]; 3];

/// What a file says of the colour of its samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Colour {
    /// Nothing, or what is taken for granted: linear Rec.709 in a float file.
    Unsaid,
    /// PNG: sRGB, by a tag, a profile, or a gamma of 1/2.2.
    Srgb,
    /// PNG: linear samples with the primaries of sRGB.
    Linear,
    /// OpenEXR: linear samples of other primaries. The matrix takes them to linear Rec.709, white to white.
    Primaries(Matrix),
    /// PNG: something else, in words.
    Other(String),
}

/// CIE x and y of red, green, blue and white.
pub(super) type Chromaticities = [[f64; 2]; 4];

/// ITU-R BT.709-6, table 1; its white is D65.
const REC709: Chromaticities = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// Chromaticities that differ by less are the same, written by other hands. It shifts colours by half a percent at most.
const SAME: f64 = 1e-3;

/// From XYZ to the responses of the eye's cones, by Bradford (ICC.1:2022, annex E).
const CONES: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// A matrix times a colour.
pub(crate) fn convert(matrix: &Matrix, colour: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2])
}

/// Linear light of a value on the curve of sRGB, 0 to 1 (IEC 61966-2-1).
pub(crate) fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Whether the colours are those of Rec.709 and sRGB.
pub(super) fn is_rec709(chromaticities: &Chromaticities) -> bool {
    chromaticities.iter().flatten().zip(REC709.iter().flatten()).all(|(given, own)| (given - own).abs() < SAME)
}

/// Which colours linear samples of these primaries and this white are.
///
/// # Errors
/// [`ImageError::Broken`] when no three lights of these colours give this white.
pub(super) fn of_primaries(chromaticities: &Chromaticities) -> Result<Colour, ImageError> {
    if is_rec709(chromaticities) {
        return Ok(Colour::Unsaid);
    }
    let matrix = to_xyz(chromaticities).zip(to_xyz(&REC709)).and_then(|(from, to)| {
        let adapted = product(&adaptation(white(chromaticities), white(&REC709))?, &from);
        Some(product(&inverse(&to)?, &adapted))
    });
    matrix.map(Colour::Primaries).ok_or_else(|| {
        ImageError::Broken(format!(
            "the chromaticities {chromaticities:?} are no primaries: red, green and blue must be the corners of a \
             triangle with white in it"
        ))
    })
}

/// XYZ of the white, as bright as 1.
fn white(chromaticities: &Chromaticities) -> [f64; 3] {
    let [x, y] = chromaticities[3];
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// From red, green and blue to XYZ; none where white is not a sum of the three.
fn to_xyz(chromaticities: &Chromaticities) -> Option<Matrix> {
    let [red, green, blue, [_, white_y]] = *chromaticities;
    if !chromaticities.iter().flatten().all(|part| part.is_finite() && part.abs() <= 10.0) || white_y < 1e-3 {
        return None;
    }
    // Columns are the primaries. They need no luminance of their own: those of ACES are imaginary, one with y below 0.
    let [r, g, b] = [red, green, blue].map(|[x, y]| [x, y, 1.0 - x - y]);
    let primaries = std::array::from_fn(|row| [r[row], g[row], b[row]]);
    let amounts = convert(&inverse(&primaries)?, white(chromaticities));
    amounts.iter().all(|amount| *amount > 1e-6).then(|| primaries.map(|row| [0, 1, 2].map(|c| row[c] * amounts[c])))
}

/// From XYZ under one white to XYZ under another.
fn adaptation(from: [f64; 3], to: [f64; 3]) -> Option<Matrix> {
    let (seen, wanted) = (convert(&CONES, from), convert(&CONES, to));
    let gains: [f64; 3] = std::array::from_fn(|cone| wanted[cone] / seen[cone]);
    let scaled = std::array::from_fn(|row| CONES[row].map(|part| gains[row] * part));
    gains.iter().all(|gain| gain.is_finite() && *gain > 0.0).then_some(product(&inverse(&CONES)?, &scaled))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| [0, 1, 2].map(|c| row[0] * b[0][c] + row[1] * b[1][c] + row[2] * b[2][c]))
}

/// None of a matrix that flattens space.
fn inverse(m: &Matrix) -> Option<Matrix> {
    let minor = |r: usize, c: usize| {
        let ([r1, r2], [c1, c2]) = ([(r + 1) % 3, (r + 2) % 3], [(c + 1) % 3, (c + 2) % 3]);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let determinant = (0..3).map(|c| m[0][c] * minor(0, c)).sum::<f64>();
    (determinant.abs() > 1e-6)
        .then(|| std::array::from_fn(|row| std::array::from_fn(|column| minor(column, row) / determinant)))
}
