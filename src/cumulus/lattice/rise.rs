//! Light that rises or sinks: along five directions at once, slice by slice.

use super::cells::{Cloud, Set};
use super::grid::Grid;
use super::sweep::{Border, DIAGONAL, EDGE, State};
use glam::{DVec4, Vec4};

/// Which way light goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Up,
    Down,
}

/// Lines by the place at which they pass the lowest slice: what light was when it left the last cube of cloud, and when that was.
struct Lines {
    passing: Vec<Vec4>,
    last: Vec<u32>,
}

/// Light along the vertical and along four diagonals.
pub(super) struct Rise {
    way: Way,
    size: [u32; 3],
    lines: [Lines; 5],
    /// Lines that were passed no later than this are still at the border.
    start: u32,
}

/// What each step of a direction's line is along x and y; the last one is the vertical.
const STEPS: [[i32; 2]; 5] = [[1, 1], [-1, 1], [1, -1], [-1, -1], [0, 0]];
const ROOT: f32 = 0.577_350_26;

impl Rise {
    pub(super) fn new(grid: &Grid, way: Way) -> Self {
        let size = grid.size.map(|n| n as u32);
        let count = grid.size[0] * grid.size[1];
        let lines = std::array::from_fn(|_| Lines { passing: vec![Vec4::ZERO; count], last: vec![0; count] });
        Self { way, size, lines, start: 0 }
    }

    /// Sums over the directions, of all cubes of a set.
    pub(super) fn run(&mut self, set: &Set, cloud: &Cloud, border: &Border, state: &[State], sums: &mut [State]) {
        self.start += self.size[2] + 1;
        let cubes = set.places.iter().zip(&set.clouds).zip(sums);
        match self.way {
            Way::Up => {
                cubes.for_each(|((place, cloudy), sum)| *sum = self.visit(*place, *cloudy, cloud, border, state))
            }
            Way::Down => {
                cubes.rev().for_each(|((place, cloudy), sum)| *sum = self.visit(*place, *cloudy, cloud, border, state));
            }
        }
    }

    #[inline]
    fn visit(&mut self, [x, y, z]: [u32; 3], cloudy: u32, cloud: &Cloud, border: &Border, state: &[State]) -> State {
        let [nx, ny, nz] = self.size;
        let (now, beyond, sign) = match self.way {
            Way::Up => (self.start + z, border.below, 1.0),
            Way::Down => (self.start + nz - 1 - z, border.above, -1.0),
        };
        // A line that leaves the domain at one side comes in at the other: the domain repeats.
        let (shift_x, shift_y) = (z % nx, z % ny);
        let back = |at: u32, shift: u32, n: u32| if at >= shift { at - shift } else { at + n - shift };
        let on = |at: u32, shift: u32, n: u32| if at + shift >= n { at + shift - n } else { at + shift };
        let xs = [on(x, shift_x, nx), back(x, shift_x, nx)];
        let ys = [on(y, shift_y, ny), back(y, shift_y, ny)];
        let number = |[i, j]: [i32; 2]| match (i, j) {
            (0, _) => x + nx * y,
            _ => xs[usize::from(i > 0)] + nx * ys[usize::from(j > 0)],
        };
        let start = self.start;
        let arrives = |lines: &Lines, line: usize| if lines.last[line] < start { beyond } else { lines.passing[line] };
        let mut means = [Vec4::ZERO; 5];
        if let Some(of) = state.get(cloudy as usize) {
            let cloudy = cloudy as usize;
            let [even, along_x, along_y, along_z] = border.source(cloud.sun[cloudy], of);
            let passages = cloud.passages.of(cloud.densities[cloudy]);
            let (along_x, along_y, along_z) = (sign * along_x, sign * along_y, sign * along_z);
            let slanted = even + ROOT * along_z;
            let (add_x, add_y) = (ROOT * along_x, ROOT * along_y);
            let sources = [
                slanted + add_x + add_y,
                slanted - add_x + add_y,
                slanted + add_x - add_y,
                slanted - add_x - add_y,
                even + along_z,
            ];
            for d in 0..5 {
                let passage = &passages[usize::from(d < 4)];
                let (line, lines) = (number(STEPS[d]) as usize, &mut self.lines[d]);
                let source = sources[d].max(Vec4::ZERO);
                let from = arrives(lines, line) - source;
                means[d] = source + from * passage.mean;
                lines.passing[line] = source + from * passage.transmittance;
                lines.last[line] = now;
            }
        } else {
            for d in 0..5 {
                means[d] = arrives(&self.lines[d], number(STEPS[d]) as usize);
            }
        }
        let [a, b, c, d, vertical] = means;
        let (weight, diagonal) = (EDGE * vertical, DIAGONAL * ((a + b) + (c + d)));
        let flux = sign * DIAGONAL * ROOT;
        State([
            weight + diagonal,
            flux * ((a - b) + (c - d)),
            flux * ((a + b) - (c + d)),
            sign * (weight + ROOT * diagonal),
        ])
    }

    /// Light that left after the last run, weighted as flux, of each column of cubes: sinking light by where it passes the lowest face, rising
    /// light by the last cube of cloud. A slanted line goes out at a corner, and so into four columns. The lowest face is the lower one of
    /// the slice of this number.
    pub(super) fn exits(&self, border: &Border, lowest: u32) -> Vec<Vec4> {
        let [nx, ny, _] = self.size;
        let mut exits = vec![Vec4::ZERO; (nx * ny) as usize];
        let add = |at: u32, step: i32, n: u32| (i64::from(at) + i64::from(step)).rem_euclid(i64::from(n)) as u32;
        let low = lowest as i32;
        for (d, (lines, [i, j])) in self.lines.iter().zip(STEPS).enumerate() {
            let weight = if d == 4 { EDGE } else { DIAGONAL * ROOT };
            for (line, (passing, last)) in lines.passing.iter().zip(&lines.last).enumerate() {
                let passed = last.checked_sub(self.start);
                let (x, y) = (line as u32 % nx, line as u32 / nx);
                let (light, column, side) = match (self.way, passed) {
                    (Way::Up, None) => (border.below, [x, y], 1),
                    (Way::Down, None) => (border.above, [add(x, i * low, nx), add(y, j * low, ny)], -1),
                    (Way::Up, Some(z)) => (*passing, [add(x, i * z as i32, nx), add(y, j * z as i32, ny)], 1),
                    (Way::Down, Some(_)) => (*passing, [add(x, i * low, nx), add(y, j * low, ny)], -1),
                };
                let ends = [[0, 0], [side * i, 0], [0, side * j], [side * i, side * j]];
                for [i, j] in ends {
                    let [x, y] = [add(column[0], i, nx), add(column[1], j, ny)];
                    exits[(x + nx * y) as usize] += 0.25 * weight * light;
                }
            }
        }
        exits
    }

    /// What leaves after the last run, weighted as flux.
    pub(super) fn leaving(&self, border: &Border) -> DVec4 {
        let beyond = if self.way == Way::Up { border.below } else { border.above };
        let of = |(d, lines): (usize, &Lines)| {
            let weight = if d == 4 { EDGE } else { DIAGONAL * ROOT };
            let passed = lines.passing.iter().zip(&lines.last).filter(|(_, last)| **last >= self.start);
            f64::from(weight) * passed.map(|(passing, _)| (*passing - beyond).as_dvec4()).sum::<DVec4>()
        };
        self.lines.iter().enumerate().map(of).sum()
    }
}
