//! Light that goes level: along the rows of each slice.

use super::cells::{CLEAR, Cloud, Set};
use super::grid::Grid;
use super::sweep::{Border, EDGE, State};
use glam::Vec4;
use rayon::prelude::*;

/// A row comes back to where it began: what left its end is followed until no more of it is left than this.
const LEFT: f32 = 1e-5;

/// What a row takes out of light on its way round, at least: sums of single precision hold no less.
const LEAST: f32 = 1e-5;

/// The rows of a set.
pub(super) struct Level {
    size: [u32; 2],
    cell_m: f32,
    /// Where slices begin, and where the last one ends.
    slices: Vec<usize>,
    /// Cubes of each slice by x, then y; numbers within the slice.
    columns: Vec<u32>,
    /// Of each slice.
    pub(super) beside: Vec<Beside>,
}

/// Light that a slice's clear cubes have in the mean over that from beyond the layer, along x and back, along y and back: what comes from clouds beside
/// a row.
pub(super) type Beside = [[Vec4; 2]; 2];

/// What a slice reads.
struct Slice<'a> {
    places: &'a [[u32; 3]],
    clouds: &'a [u32],
    cloud: &'a Cloud,
    border: &'a Border,
    state: &'a [State],
    cell_m: f32,
    beside: Beside,
}

impl Level {
    pub(super) fn new(grid: &Grid, set: &Set) -> Self {
        let slices = set.slices(grid.size[2]);
        let orders = slices.par_windows(2).map(|ends| {
            let places = &set.places[ends[0]..ends[1]];
            let mut order: Vec<u32> = (0..places.len() as u32).collect();
            order.sort_by_key(|&number| places[number as usize][0]);
            order
        });
        let columns = orders.collect::<Vec<_>>().concat();
        Self {
            size: [grid.size[0] as u32, grid.size[1] as u32],
            cell_m: grid.cell_m as f32,
            beside: vec![Beside::default(); slices.len() - 1],
            slices,
            columns,
        }
    }

    /// Sums over the directions, of all cubes of a set. Gives what rows have lost in gaps, weighted as they are.
    pub(super) fn run(
        &mut self,
        set: &Set,
        cloud: &Cloud,
        border: &Border,
        state: &[State],
        sums: &mut [State],
    ) -> Vec4 {
        let (mut rest, mut slices) = (sums, Vec::new());
        for ends in self.slices.windows(2) {
            let (slice, after) = rest.split_at_mut(ends[1] - ends[0]);
            slices.push((ends[0]..ends[1], slice));
            rest = after;
        }
        let Self { size, cell_m, columns, beside, .. } = self;
        let lost = slices.into_par_iter().zip(beside).map(|((range, sums), beside)| {
            let slice = Slice {
                places: &set.places[range.clone()],
                clouds: &set.clouds[range.clone()],
                cloud,
                border,
                state,
                cell_m: *cell_m,
                beside: *beside,
            };
            sums.fill(State::default());
            let (mut lost, mut in_gaps) = (Vec4::ZERO, Beside::default());
            let all: Vec<u32> = (0..sums.len() as u32).collect();
            for row in all.chunk_by(|a, b| slice.places[*a as usize][1] == slice.places[*b as usize][1]) {
                lost += slice.follow(row, 0, size[0], sums, &mut in_gaps[0]);
            }
            let columns = &columns[range];
            for row in columns.chunk_by(|a, b| slice.places[*a as usize][0] == slice.places[*b as usize][0]) {
                lost += slice.follow(row, 1, size[1], sums, &mut in_gaps[1]);
            }
            let filled = slice.clouds.iter().filter(|&&own| own != CLEAR).count();
            let clear = (size[0] as usize * size[1] as usize - filled).max(1) as f32;
            *beside = in_gaps.map(|ways| ways.map(|sum| sum / clear));
            lost
        });
        lost.collect::<Vec<_>>().into_iter().sum()
    }
}

impl Slice<'_> {
    /// Light along a row of cubes, both ways. Gives what is lost.
    fn follow(&self, row: &[u32], axis: usize, size: u32, sums: &mut [State], in_gaps: &mut [Vec4; 2]) -> Vec4 {
        let [on, back] = in_gaps;
        let gained = self.one_way(row.iter(), [axis, 0], size, sums, on);
        EDGE * (gained + self.one_way(row.iter().rev(), [axis, 1], size, sums, back))
    }

    fn one_way<'a>(
        &self,
        row: impl DoubleEndedIterator<Item = &'a u32> + Clone,
        [axis, back]: [usize; 2],
        size: u32,
        sums: &mut [State],
        in_gaps: &mut Vec4,
    ) -> Vec4 {
        let beyond = 0.5 * (self.border.above + self.border.below);
        let place = |number: u32| {
            let at = self.places[number as usize][axis];
            if back == 1 { size - 1 - at } else { at }
        };
        let sign = if back == 1 { -1.0 } else { 1.0 };
        let mut add = |number: u32, mean: Vec4| {
            let sum = &mut sums[number as usize];
            sum.0[0] += EDGE * mean;
            sum.0[1 + axis] += sign * EDGE * mean;
        };
        let holds_cloud = |number: &&u32| self.clouds[**number as usize] != CLEAR;
        let ends =
            [row.clone().find(holds_cloud), row.clone().rfind(holds_cloud)].map(|end| end.map(|end| place(*end)));
        // What left the row's end comes in at its beginning, and so it does each time round.
        let gap = ends[0].zip(ends[1]).map(|(first, last)| first + size - last);
        let (came, aside) = gap.map_or((0.0, 1.0), |steps| self.border.follow(steps, self.cell_m));
        let radiance = beyond + aside * self.beside[axis][back];
        let mut light = Passing { radiance, left: Vec4::ONE, gained: Vec4::ZERO, in_gaps: Vec4::ZERO, last: None };
        for &number in row.clone() {
            let at = place(number);
            add(number, self.visit(number, at, [axis, back], beyond, &mut light));
        }
        let (Some(gap), Some(last)) = (gap, light.last) else { return Vec4::ZERO };
        let round = (Vec4::ONE - came * light.left).max(Vec4::splat(LEAST));
        let mut more = light.radiance - beyond;
        more += light.left * came * more / round;
        light.in_gaps += self.border.in_gap(gap, self.cell_m) * more;
        let (mut left, mut before) = (Vec4::ONE, i64::from(last) - i64::from(size));
        for &number in row {
            let at = place(number);
            let steps = (i64::from(at) - before) as u32;
            let (follow, _) = if steps == 1 { (1.0, 0.0) } else { self.border.follow(steps, self.cell_m) };
            let cloudy = self.clouds[number as usize] as usize;
            let Some(&density) = self.cloud.densities.get(cloudy) else {
                add(number, follow * more);
                continue;
            };
            let passage = &self.cloud.passages.of(density)[0];
            if steps > 1 && before >= 0 {
                light.in_gaps += self.border.in_gap(steps, self.cell_m) * more;
            }
            more *= follow;
            add(number, more * passage.mean);
            light.gained += more * (passage.transmittance - 1.0);
            more *= passage.transmittance;
            left *= follow * passage.transmittance;
            before = at.into();
            if left.truncate().max_element() < LEFT {
                break;
            }
        }
        *in_gaps += light.in_gaps;
        light.gained
    }

    /// Light in a cube in the mean over the row's way through it.
    #[inline]
    fn visit(&self, number: u32, at: u32, [axis, back]: [usize; 2], beyond: Vec4, light: &mut Passing) -> Vec4 {
        let cloudy = self.clouds[number as usize] as usize;
        let of = self.state.get(cloudy);
        let (follow, arrives) = match light.last {
            Some(last) if at - last > 1 => {
                let (follow, aside) = self.border.follow(at - last, self.cell_m);
                let more = light.radiance - beyond;
                if of.is_some() {
                    light.in_gaps += self.border.in_gap(at - last, self.cell_m) * more;
                }
                (follow, beyond + follow * more + aside * self.beside[axis][back])
            }
            _ => (1.0, light.radiance),
        };
        let Some(of) = of else { return arrives };
        let source = self.border.source(self.cloud.sun[cloudy], of);
        let along = source[1 + axis];
        let source = (if back == 1 { source[0] - along } else { source[0] + along }).max(Vec4::ZERO);
        let passage = &self.cloud.passages.of(self.cloud.densities[cloudy])[0];
        let from = arrives - source;
        light.radiance = source + from * passage.transmittance;
        light.gained += from * (passage.transmittance - 1.0);
        light.left *= follow * passage.transmittance;
        light.last = Some(at);
        source + from * passage.mean
    }
}

/// Light as it left the last cube of cloud, what is left of that which came in, what it has gained in all cubes together, what is in gaps, cubes times
/// light, and where the last cube was.
struct Passing {
    radiance: Vec4,
    left: Vec4,
    gained: Vec4,
    in_gaps: Vec4,
    last: Option<u32>,
}
