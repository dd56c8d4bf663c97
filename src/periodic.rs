//! Maps that repeat as the domain does: the one way to read them between their texels on the host.

/// Two neighbours in a row of texels that repeats, and how far from the first to the second a place lies, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Between {
    pub(crate) low: usize,
    pub(crate) high: usize,
    pub(crate) part: f64,
}

impl Between {
    /// The texels about a place, given in periods, of a row of `size` texels whose centres lie at half-integers.
    pub(crate) fn new(place: f64, size: usize) -> Self {
        let texels = place * size as f64 - 0.5;
        let low = (texels.floor() as i64).rem_euclid(size as i64) as usize;
        Self { low, high: (low + 1) % size, part: texels - texels.floor() }
    }
}

/// Bilinear sample at a place in periods, u across and v down, of a map of `size` texels.
pub(crate) fn bilinear<const N: usize>(
    size: [usize; 2],
    [u, v]: [f64; 2],
    at: impl Fn(usize, usize) -> [f64; N],
) -> [f64; N] {
    let (x, y) = (Between::new(u, size[0]), Between::new(v, size[1]));
    let mix = |a: [f64; N], b: [f64; N], t: f64| -> [f64; N] { std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t) };
    let row = |y: usize| mix(at(x.low, y), at(x.high, y), x.part);
    mix(row(y.low), row(y.high), y.part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_edges_and_other_periods() {
        let values = [1.0, 2.0, 4.0, 8.0];
        let at = |x: usize, y: usize| [values[x] + 100.0 * y as f64];
        for (u, value) in [(0.125, 1.0), (0.25, 1.5), (0.875, 8.0), (1.0, 4.5), (-0.125, 8.0), (5.375, 2.0)] {
            assert_eq!(bilinear([4, 2], [u, 0.25], at), [value], "{u}");
            assert_eq!(bilinear([4, 2], [u, 0.75], at), [value + 100.0], "{u}");
            assert_eq!(bilinear([4, 2], [u, -1.0], at), [value + 50.0], "{u}");
        }
        assert_eq!(bilinear([1, 1], [0.3, 7.9], |_, _| [3.0]), [3.0]);
    }
}
