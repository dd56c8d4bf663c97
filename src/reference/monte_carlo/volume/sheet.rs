//! A layer of uneven thickness on a line.

use crate::cumulus::Line;
use crate::periodic::Axis;
use crate::reference::map::Map;
use crate::reference::monte_carlo::surface::Surface;
use std::ops::ControlFlow;

/// Lines end after so many metres in a layer: level ones would never leave it.
const LONGEST_M: f64 = 1e7;

/// A layer over a flat base.
#[derive(Debug)]
pub(super) struct Sheet {
    base_m: f64,
    most_m: f64,
    /// Equally thick everywhere.
    even: bool,
    thickness: Surface,
    half_m: f64,
    size: [usize; 2],
    texel_m: [f64; 2],
    /// From the domain's corner in the north-west to the first texel's centre, metres, the other way round.
    offset_m: [f64; 2],
}

impl Sheet {
    pub(super) fn new(base_m: f64, map: &Map, offset_uv: [f64; 2], extent_m: f64) -> Self {
        let heights = || map.texels.iter().map(|texel| texel[0]);
        let most_m = heights().fold(0.0, f64::max);
        let size = [map.width, map.height];
        let texel_m = size.map(|size| extent_m / size as f64);
        Self {
            base_m,
            most_m,
            even: heights().all(|height| height == most_m),
            thickness: Surface::new(map, offset_uv, extent_m),
            half_m: 0.5 * extent_m,
            size,
            texel_m,
            offset_m: std::array::from_fn(|i| (offset_uv[i] - offset_uv[i].floor()) * extent_m - 0.5 * texel_m[i]),
        }
    }

    pub(super) fn base_m(&self) -> f64 {
        self.base_m
    }

    pub(super) fn top_m(&self) -> f64 {
        self.base_m + self.most_m
    }

    /// Pieces of cloud along a line: exact, as the layer's top on a line is a parabola between texels.
    pub(super) fn pieces(&self, line: &Line, mut visit: impl FnMut(f64, f64) -> ControlFlow<()>) -> ControlFlow<()> {
        let Some((from_m, to_m)) = line.between_heights(self.base_m, self.top_m()) else {
            return ControlFlow::Continue(());
        };
        if self.even {
            return visit(from_m, to_m.min(from_m + LONGEST_M));
        }
        let (start, length_m) = (line.at(from_m), (to_m - from_m).min(LONGEST_M));
        let (east_m, south_m) = (start.x + self.half_m, self.half_m - start.y);
        let mut x = Axis::new(east_m + self.offset_m[0], line.direction.x, self.texel_m[0], self.size[0]);
        let mut y = Axis::new(south_m + self.offset_m[1], -line.direction.y, self.texel_m[1], self.size[1]);
        // Height above the top so many metres from the start.
        let above_m = |way_m: f64| {
            let (east_m, south_m) = (east_m + line.direction.x * way_m, south_m - line.direction.y * way_m);
            start.z + line.direction.z * way_m - self.base_m - self.thickness.at(east_m, south_m)
        };
        let (mut way_m, mut first) = (0.0, above_m(0.0));
        while way_m < length_m {
            let next_m = x.next_m.min(y.next_m).min(length_m);
            if next_m > way_m {
                let (middle, last) = (above_m(0.5 * (way_m + next_m)), above_m(next_m));
                let place = |part: f64| from_m + way_m + (next_m - way_m) * part;
                for (from, to) in below([first, middle, last]).into_iter().filter(|(from, to)| from < to) {
                    visit(place(from), place(to))?;
                }
                (way_m, first) = (next_m, last);
            }
            x.pass(next_m);
            y.pass(next_m);
        }
        ControlFlow::Continue(())
    }
}

/// Where from 0 to 1 the parabola through three values (at 0, 1/2, 1) is below 0: parts in order, some of them empty.
fn below([first, middle, last]: [f64; 3]) -> [(f64, f64); 3] {
    let square = 2.0 * (first + last - 2.0 * middle);
    let slope = last - first - square;
    let discriminant = (slope * slope - 4.0 * square * first).max(0.0);
    let sum = -0.5 * (slope + discriminant.sqrt().copysign(slope));
    let root = |over: f64, under: f64| if under == 0.0 { 0.0 } else { (over / under).clamp(0.0, 1.0) };
    let roots = [root(sum, square), root(first, sum)];
    let cuts = [0.0, roots[0].min(roots[1]), roots[0].max(roots[1]), 1.0];
    // Each part has one sign, that of its integral.
    let value = |part: f64| first + part * (slope + part * square);
    let negative = |from: f64, to: f64| value(from) + 4.0 * value(0.5 * (from + to)) + value(to) < 0.0;
    std::array::from_fn(|i| if negative(cuts[i], cuts[i + 1]) { (cuts[i], cuts[i + 1]) } else { (0.0, 0.0) })
}

#[cfg(test)]
mod tests {
    use super::below;

    #[test]
    fn parts_below_zero_are_those_of_many_points() {
        let values = [-2.0, -1.0, -0.5, -1e-9, 0.0, 1e-9, 0.3, 1.0, 4.0];
        for first in values {
            for middle in values {
                for last in values {
                    let found = below([first, middle, last]);
                    let square = 2.0 * (first + last - 2.0 * middle);
                    let value = |part: f64| first + part * (last - first - square + part * square);
                    let count = 20_000;
                    let points = (0..count).filter(|i| value((f64::from(*i) + 0.5) / f64::from(count)) < 0.0);
                    let sum: f64 = found.iter().map(|(from, to)| to - from).sum();
                    let many = points.count() as f64 / f64::from(count);
                    assert!((sum - many).abs() < 3e-4, "{first} {middle} {last}: {found:?}, {many}");
                    let parts: Vec<_> = found.into_iter().filter(|(from, to)| from < to).collect();
                    assert!(parts.windows(2).all(|pair| pair[0].1 <= pair[1].0), "{found:?}");
                }
            }
        }
    }
}
