//! Maps and cells that repeat as the domain does: the one way to read maps between their texels on the host, and to walk
//! through cells.

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
        let before = texels.floor();
        // Most places lie within the first period, and need no division of whole numbers, which is slow.
        let low = match before as i64 {
            low if (0..size as i64).contains(&low) => low as usize,
            other => other.rem_euclid(size as i64) as usize,
        };
        Self { low, high: if low + 1 == size { 0 } else { low + 1 }, part: texels - before }
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

/// Cells along one axis of a straight way.
#[derive(Debug)]
pub(crate) struct Axis {
    /// The one that the way is in, counted within a period.
    pub(crate) cell: usize,
    /// In which period the way is: 0 is that of the origin.
    pub(crate) period: f64,
    /// Way to the next cell.
    pub(crate) next_m: f64,
    /// Way through a cell.
    pitch_m: f64,
    forward: bool,
    cells: usize,
}

impl Axis {
    /// From a place along the axis, with the cosine of the way to it, through periods of so many cells.
    pub(crate) fn new(start_m: f64, slope: f64, cell_m: f64, cells: usize) -> Self {
        let place = start_m / cell_m;
        let low = place.floor();
        let pitch_m = cell_m / slope.abs();
        let part = if slope > 0.0 { low + 1.0 - place } else { place - low };
        // One cell repeats everywhere: there is nothing to step to.
        let next_m = if cells == 1 || slope == 0.0 { f64::INFINITY } else { part * pitch_m };
        Self {
            cell: (low as i64).rem_euclid(cells as i64) as usize,
            period: (low / cells as f64).floor(),
            next_m,
            pitch_m,
            forward: slope > 0.0,
            cells,
        }
    }

    /// Steps to the next cell if the way leads there.
    pub(crate) fn pass(&mut self, way_m: f64) {
        if self.next_m <= way_m {
            self.next_m += self.pitch_m;
            (self.cell, self.period) = match (self.forward, self.cell) {
                (true, cell) if cell + 1 == self.cells => (0, self.period + 1.0),
                (true, cell) => (cell + 1, self.period),
                (false, 0) => (self.cells - 1, self.period - 1.0),
                (false, cell) => (cell - 1, self.period),
            };
        }
    }
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
