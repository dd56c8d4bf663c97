//! Lattices of noise that are turned against the tile and still repeat with it.

/// Angle of the first lattice of the lowest octave to the tile's axes, and from one octave to the next, degrees: no two of ten
/// octaves stand alike, of which each has a symmetry of a right angle.
const FIRST_DEG: f64 = 20.0;
const NEXT_DEG: f64 = 27.8;

/// The two lattices of an octave, half a right angle apart: each by its steps along and across a row of the tile. They have no
/// common divisor, so that the points of a tile are as many as its lattice has cells.
pub(super) fn turns(lowest_period: u32, octave: u32) -> [i32; 4] {
    let cycles = f64::from(lowest_period << octave);
    let angle = (FIRST_DEG + NEXT_DEG * f64::from(octave)).rem_euclid(90.0);
    let [a, b] = nearest(cycles, angle);
    let [c, d] = nearest(cycles, (angle + 45.0).rem_euclid(90.0));
    [a, b, c, d]
}

/// The lattice nearest to one of so many cycles a tile at an angle.
fn nearest(cycles: f64, angle_deg: f64) -> [i32; 2] {
    let (sine, cosine) = angle_deg.to_radians().sin_cos();
    let (x, y) = (cycles * cosine, cycles * sine);
    let around = |value: f64| (value.floor() as i32 - 1..=value.floor() as i32 + 2).filter(|step| *step > 0);
    let pairs = around(x).flat_map(|a| around(y).map(move |b| [a, b])).filter(|[a, b]| divisor(*a, *b) == 1);
    let away = |[a, b]: &[i32; 2]| (f64::from(*a) - x).hypot(f64::from(*b) - y);
    pairs.min_by(|one, other| away(one).total_cmp(&away(other))).unwrap_or([1, 1])
}

fn divisor(a: i32, b: i32) -> i32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Octaves have the sizes that they are meant to have, and the two lattices of each make the angle, as exactly as whole steps
    /// without a common divisor allow: within one step of what is wanted.
    #[test]
    fn lattices_are_as_fine_as_meant() {
        for octave in 0..10 {
            let cycles = f64::from(3 << octave);
            let [a, b, c, d] = turns(3, octave);
            for [along, across] in [[a, b], [c, d]] {
                assert_eq!(divisor(along, across), 1);
                let found = f64::from(along).hypot(f64::from(across));
                assert!((found - cycles).abs() < 1.0, "{octave}: {found}");
            }
            let angle = |a: i32, b: i32| f64::from(b).atan2(f64::from(a)).to_degrees();
            let between = (angle(c, d) - angle(a, b)).rem_euclid(90.0);
            assert!((between - 45.0).abs() < (2.0 / cycles).to_degrees(), "{octave}: {between}");
        }
    }
}
