//! Finds the spheres of a body near a place and along a line.
//!
//! The domain is cut into cells of about 100 m. A cell knows the spheres that can be the nearest ones somewhere in it, whether
//! it is all in cloud, and how dense it can be at most; columns without cloud take no memory. Everything that it tells is exact
//! to rounding, but for the pieces of soft edges ([`Index::pieces`]).

use super::body::Body;
use super::build::build;
use super::cells::{Ball, Cell, Line, Span};
use super::relief::Relief;
use crate::periodic::Axis;
use glam::{DVec3, dvec3};
use std::ops::ControlFlow;

/// Lines end after so many metres in the body: level ones would never leave it.
const LONGEST_M: f64 = 1e7;
/// Parts of the edge in which its density is integrated, and how long they are with the relief, metres.
const EDGE_PARTS: f64 = 6.0;
const PARTS_M: std::ops::RangeInclusive<f64> = 1.0..=4.0;

/// A body made ready to be asked for its density.
#[derive(Debug, Clone)]
pub struct Index {
    pub(super) base_m: f64,
    pub(super) edge_m: f64,
    pub(super) relief_m: f64,
    pub(super) extent_m: f64,
    /// Cells along x and y, and along z.
    pub(super) side: usize,
    pub(super) layers: usize,
    pub(super) cell_m: f64,
    pub(super) layer_m: f64,
    /// No cloud is lower or higher.
    pub(super) bottom_m: f64,
    pub(super) top_m: f64,
    /// Where the cells of a column begin, as multiples of `layers`, plus 1; 0 for a column without any cloud.
    pub(super) columns: Vec<u32>,
    pub(super) cells: Vec<Cell>,
    pub(super) balls: Vec<Ball>,
    pub(super) relief: Relief,
}

impl Index {
    /// The index of a body.
    #[must_use]
    pub fn new(body: &Body) -> Self {
        build(body)
    }

    /// Heights between which all cloud is, metres; equal if there is none.
    #[must_use]
    pub fn heights_m(&self) -> [f64; 2] {
        [self.bottom_m, self.top_m]
    }

    /// Side of the domain, metres.
    #[must_use]
    pub fn extent_m(&self) -> f64 {
        self.extent_m
    }

    /// Whether the density is 0 or 1 with nothing but spheres between, so that lines meet it in closed form.
    #[must_use]
    pub fn is_hard(&self) -> bool {
        self.edge_m <= 0.0 && self.relief_m <= 0.0
    }

    /// Density at a place, relative to that inside, 0 to 1: the formula of [`Body`].
    #[must_use]
    pub fn density(&self, place: DVec3) -> f64 {
        self.cell(place).map_or(0.0, |(cell, place)| self.density_in(cell, place))
    }

    /// How far inside the spheres a place is, `max_i(R_i - |p - c_i|)`, metres; negative outside. Below
    /// `-(edge_m + relief_m)` it is that, and so it is where the base or the heights of the spheres leave no cloud.
    #[must_use]
    pub fn surface(&self, place: DVec3) -> f64 {
        self.cell(place).map_or(-self.reach_m(), |(cell, place)| self.surface_in(cell, place))
    }

    /// Length of cloud along a line, weighted with its density, metres; once it is more than `enough_m`, the rest does not
    /// count.
    #[must_use]
    pub fn path_m(&self, line: &Line, enough_m: f64) -> f64 {
        let mut path_m = 0.0;
        self.pieces(line, |from_m, to_m, density| {
            path_m += (to_m - from_m) * density;
            if path_m > enough_m { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        path_m
    }

    /// Pieces of cloud along a line in the order in which it meets them, with their mean densities: start and end, metres along
    /// the line, and density. Between spheres (edge and relief 0) the pieces are exact. Soft edges come in parts so short
    /// that the density is nearly linear in them.
    pub fn pieces(&self, line: &Line, mut visit: impl FnMut(f64, f64, f64) -> ControlFlow<()>) {
        let mut crossings = Vec::new();
        self.walk(line, |span| {
            if span.full {
                return visit(span.from_m, span.to_m, 1.0);
            }
            if !self.is_hard() {
                return self.soft_pieces(&span, line, &mut visit);
            }
            crossings.clear();
            for ball in &self.balls[span.cell.balls()] {
                let to_centre = ball.centre - (line.origin - span.shift);
                let nearest_m = to_centre.dot(line.direction);
                let aside = (to_centre - line.direction * nearest_m).length_squared();
                let half_m = (ball.radius_m * ball.radius_m - aside).max(0.0).sqrt();
                let (from_m, to_m) = ((nearest_m - half_m).max(span.from_m), (nearest_m + half_m).min(span.to_m));
                if from_m < to_m {
                    if from_m == span.from_m && to_m == span.to_m {
                        return visit(from_m, to_m, 1.0);
                    }
                    crossings.push((from_m, to_m));
                }
            }
            crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut crossings = crossings.iter().copied();
            let Some(mut piece) = crossings.next() else { return ControlFlow::Continue(()) };
            for next in crossings {
                if next.0 > piece.1 {
                    visit(piece.0, piece.1, 1.0)?;
                    piece = next;
                }
                piece.1 = piece.1.max(next.1);
            }
            visit(piece.0, piece.1, 1.0)
        });
    }

    /// Parts of the line in cells that may have cloud, in order.
    pub fn walk(&self, line: &Line, mut visit: impl FnMut(Span<'_>) -> ControlFlow<()>) {
        // Its breaks are nobody's business.
        let _: ControlFlow<()> = self.walk_columns(line, &mut visit);
    }

    fn walk_columns(&self, line: &Line, visit: &mut impl FnMut(Span<'_>) -> ControlFlow<()>) -> ControlFlow<()> {
        let Some((from_m, to_m)) = line.between_heights(self.bottom_m, self.top_m) else {
            return ControlFlow::Continue(());
        };
        let (start, length_m) = (line.at(from_m), (to_m - from_m).min(LONGEST_M));
        let mut x = Axis::new(start.x, line.direction.x, self.cell_m, self.side);
        let mut y = Axis::new(start.y, line.direction.y, self.cell_m, self.side);
        let mut way_m = 0.0;
        while way_m < length_m {
            let next_m = x.next_m.min(y.next_m).min(length_m);
            let block = self.columns[y.cell * self.side + x.cell];
            if block > 0 && next_m > way_m {
                let cells = &self.cells[(block as usize - 1) * self.layers..][..self.layers];
                let shift = dvec3(x.period, y.period, 0.0) * self.extent_m;
                self.walk_column(line, [from_m + way_m, from_m + next_m], cells, shift, visit)?;
            }
            way_m = next_m;
            x.pass(way_m);
            y.pass(way_m);
        }
        ControlFlow::Continue(())
    }

    fn walk_column(
        &self,
        line: &Line,
        [mut from_m, end_m]: [f64; 2],
        cells: &[Cell],
        shift: DVec3,
        visit: &mut impl FnMut(Span<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let slope = line.direction.z;
        let mut layer = self.layer(line.at(from_m).z);
        loop {
            let edge = if slope > 0.0 { layer + 1 } else { layer };
            let edge_m = (self.bottom_m + self.layer_m * edge as f64 - line.origin.z) / slope;
            let to_m = if slope == 0.0 { end_m } else { edge_m.clamp(from_m, end_m) };
            let cell = &cells[layer];
            if cell.most_density > 0.0 && to_m > from_m {
                visit(Span { from_m, to_m, most_density: cell.most_density.into(), full: cell.full, cell, shift })?;
            }
            from_m = to_m;
            if from_m >= end_m || (slope > 0.0 && edge >= self.layers) || (slope < 0.0 && edge == 0) {
                return ControlFlow::Continue(());
            }
            layer = if slope > 0.0 { layer + 1 } else { layer - 1 };
        }
    }

    /// Density at a place of a span of [`Index::walk`].
    #[must_use]
    pub fn density_at(&self, span: &Span<'_>, place: DVec3) -> f64 {
        self.density_in(span.cell, place - span.shift)
    }

    fn layer(&self, height_m: f64) -> usize {
        (((height_m - self.bottom_m) / self.layer_m) as usize).min(self.layers - 1)
    }

    /// The cell of a place, and the same place in the period that the cell's spheres are in.
    fn cell(&self, place: DVec3) -> Option<(&Cell, DVec3)> {
        if self.layers == 0 || !(self.bottom_m..self.top_m).contains(&place.z) {
            return None;
        }
        let wrapped = |metres: f64| {
            let inside = metres - (metres / self.extent_m).floor() * self.extent_m;
            (inside, ((inside / self.cell_m) as usize).min(self.side - 1))
        };
        let ((x_m, x), (y_m, y)) = (wrapped(place.x), wrapped(place.y));
        let block = self.columns[y * self.side + x] as usize;
        (block > 0).then(|| (&self.cells[(block - 1) * self.layers + self.layer(place.z)], dvec3(x_m, y_m, place.z)))
    }

    /// What is further outside is not told apart.
    fn reach_m(&self) -> f64 {
        self.edge_m + self.relief_m
    }

    fn surface_in(&self, cell: &Cell, place: DVec3) -> f64 {
        let mut inside_m = -self.reach_m();
        for ball in &self.balls[cell.balls()] {
            if ball.most_m <= inside_m {
                break;
            }
            inside_m = inside_m.max(ball.radius_m - place.distance(ball.centre));
        }
        inside_m
    }

    fn density_in(&self, cell: &Cell, place: DVec3) -> f64 {
        if cell.full {
            return 1.0;
        }
        if self.is_hard() {
            let inside = |ball: &Ball| place.distance_squared(ball.centre) < ball.radius_m * ball.radius_m;
            return f64::from(u8::from(self.balls[cell.balls()].iter().any(inside)));
        }
        let inside_m = self.surface_in(cell, place);
        if inside_m <= -self.relief_m {
            return 0.0;
        }
        let noise = if self.relief_m > 0.0 && inside_m < self.reach_m() { self.relief.at(place) } else { 0.0 };
        self.risen(inside_m + self.relief_m * noise) * self.risen(place.z - self.base_m)
    }

    /// Density so far inside an edge.
    fn risen(&self, inside_m: f64) -> f64 {
        if self.edge_m > 0.0 { (inside_m / self.edge_m).clamp(0.0, 1.0) } else { f64::from(u8::from(inside_m > 0.0)) }
    }

    /// The surface is nowhere nearer than the spheres say: so long a way from a place is empty or full as the place is.
    fn soft_pieces(
        &self,
        span: &Span<'_>,
        line: &Line,
        visit: &mut impl FnMut(f64, f64, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let part_m = (self.edge_m / EDGE_PARTS).clamp(*PARTS_M.start(), *PARTS_M.end());
        let at = |metres: f64| line.at(metres) - span.shift;
        let lowest_m = at(span.from_m).z.min(at(span.to_m).z);
        let above_base = lowest_m >= self.base_m + self.edge_m;
        let mut from_m = span.from_m;
        while from_m < span.to_m {
            let inside_m = self.surface_in(span.cell, at(from_m));
            let empty_m = -self.relief_m - inside_m;
            let solid_m = if above_base { inside_m - self.reach_m() } else { 0.0 };
            let to_m = (from_m + part_m.max(empty_m).max(solid_m)).min(span.to_m);
            if solid_m >= part_m {
                visit(from_m, to_m, 1.0)?;
            } else if empty_m < part_m {
                // Two points of Gauss.
                let (middle_m, aside_m) = (0.5 * (from_m + to_m), 0.5 * (to_m - from_m) / 3.0_f64.sqrt());
                let both =
                    [middle_m - aside_m, middle_m + aside_m].map(|metres| self.density_in(span.cell, at(metres)));
                let density = 0.5 * (both[0] + both[1]);
                if density > 0.0 {
                    visit(from_m, to_m, density)?;
                }
            }
            from_m = to_m;
        }
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::Sphere;
    use super::*;
    use std::f64::consts::TAU;

    /// Clouds of 555 spheres each, one beside the other on a jittered lattice, over the same part of the ground however many there are.
    fn clouds(side: u32) -> Body {
        let cell_m = 1850.0;
        let part = |i: u32, step: f64| (f64::from(i) * step).fract();
        let sphere = |cloud: u32, i: u32| {
            let at = [cloud % side, cloud / side].map(|at| (f64::from(at) + 0.5) * cell_m);
            let moved = [0.618, 0.755].map(|step| 300.0 * (part(cloud, step) - 0.5));
            let (sin, cos) = (TAU * part(i, 0.618_034)).sin_cos();
            let out = 380.0 * part(i, 0.324_717_96).sqrt();
            let centre = dvec3(
                at[0] + moved[0] + out * cos,
                at[1] + moved[1] + out * sin,
                900.0 + 300.0 * part(i, 0.754_877_67),
            );
            Sphere { centre, radius_m: if i < 8 { 160.0 } else { 12.0 + 50.0 * part(i, 0.569_840_29).powi(3) } }
        };
        let spheres = (0..side * side).flat_map(|cloud| (0..555).map(move |i| sphere(cloud, i))).collect();
        Body { spheres, base_m: 850.0, edge_m: 0.0, relief_m: 0.0, extent_m: f64::from(side) * cell_m }
    }

    /// 64,000 spheres may cost a picture four times what 555 do, at the same cover: counted as cells and spheres that its rays look at. All that
    /// grows is the way of flat rays.
    #[test]
    fn a_hundred_times_the_spheres_are_no_more_work_for_a_ray() {
        let looks = |body: &Body| {
            let index = Index::new(body);
            let (mut cells, mut spheres) = (0, 0);
            for i in 0..4000_u32 {
                let part = |step: f64| (f64::from(i) * step).fract();
                let (sine, cosine) = (TAU * part(0.754_877_67)).sin_cos();
                let up = 0.1 + 0.9 * part(0.324_717_96);
                let across = (1.0 - up * up).sqrt();
                let origin = dvec3(body.extent_m * part(0.618_034), body.extent_m * part(0.569_840_29), 0.0);
                index.walk(&Line::from(origin, dvec3(across * cosine, across * sine, up)), |span| {
                    cells += 1;
                    spheres += if span.full { 0 } else { span.cell.balls().len() };
                    if span.full { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                });
            }
            [cells, spheres].map(|looks| looks as f64 / 4000.0)
        };
        let [one, many] = [1, 11].map(|side| {
            let body = clouds(side);
            (body.spheres.len(), looks(&body))
        });
        assert_eq!((one.0, many.0), (555, 67_155));
        assert!(one.1[1] > 1.0, "{one:?}");
        for (one, many) in one.1.iter().zip(&many.1) {
            assert!(many < &(1.5 * one), "{many} looks a ray for {one}");
        }
    }
}
