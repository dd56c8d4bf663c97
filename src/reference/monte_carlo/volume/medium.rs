//! Clouds of several parts on lines.

use super::problem::{MAX_PARTS, Shape, VolumeProblem};
use super::ragged::Ragged;
use super::sheet::Sheet;
use crate::cumulus::{Index, Line};
use crate::reference::monte_carlo::path::NEGLIGIBLE;
use crate::reference::monte_carlo::random::Random;
use glam::{DVec3, dvec3};
use std::ops::ControlFlow;

/// Nothing is left behind this optical depth.
const OPAQUE: f64 = 50.0;

/// All clouds.
#[derive(Debug)]
pub(in crate::reference::monte_carlo) struct Medium<'a> {
    clouds: Vec<Cloud<'a>>,
    extent_m: f64,
}

#[derive(Debug)]
struct Cloud<'a> {
    extinction_per_m: f64,
    form: Form<'a>,
}

#[derive(Debug)]
enum Form<'a> {
    /// Where it would be without wind, and where the wind has carried it.
    Cumulus(&'a Index, DVec3),
    Sheet(Sheet),
    Ragged(Ragged<'a>),
}

/// What a flight ends at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Met {
    /// A collision in a part.
    Cloud(usize, DVec3),
    /// The ground.
    Ground(DVec3),
    /// Nothing any more.
    Space,
}

/// A piece of a line.
#[derive(Clone, Copy, Debug)]
pub(in crate::reference::monte_carlo) struct Piece {
    pub(in crate::reference::monte_carlo) from_m: f64,
    pub(in crate::reference::monte_carlo) to_m: f64,
    /// Of each part, 1/m.
    pub(in crate::reference::monte_carlo) extinctions: [f64; MAX_PARTS],
    /// Their sum, 1/m.
    pub(in crate::reference::monte_carlo) extinction: f64,
}

impl<'a> Medium<'a> {
    pub(super) fn new(problem: &VolumeProblem<'a>) -> Self {
        let extent_m = problem.extent_m;
        let form = |shape: Shape<'a>| match shape {
            Shape::Cumulus { index, drift_m } => Form::Cumulus(index, drift_m.extend(0.0)),
            Shape::Layer { base_m, thickness, offset_uv } => {
                Form::Sheet(Sheet::new(base_m, thickness, offset_uv, extent_m))
            }
            Shape::Columns { base_m, columns, offset_uv } => {
                Form::Ragged(Ragged::new(base_m, columns, offset_uv, extent_m))
            }
        };
        let clouds = problem.parts.iter();
        let clouds = clouds.map(|part| Cloud { extinction_per_m: part.extinction_per_m, form: form(part.shape) });
        Self { clouds: clouds.collect(), extent_m }
    }

    /// No cloud is lower, metres.
    pub(in crate::reference::monte_carlo) fn bottom_m(&self) -> f64 {
        let bottom_m = |cloud: &Cloud<'_>| match &cloud.form {
            Form::Cumulus(index, _) => index.heights_m()[0],
            Form::Sheet(sheet) => sheet.base_m(),
            Form::Ragged(columns) => columns.base_m(),
        };
        self.clouds.iter().map(bottom_m).fold(f64::INFINITY, f64::min)
    }

    /// No cloud is higher, metres.
    pub(in crate::reference::monte_carlo) fn top_m(&self) -> f64 {
        let top_m = |cloud: &Cloud<'_>| match &cloud.form {
            Form::Cumulus(index, _) => index.heights_m()[1],
            Form::Sheet(sheet) => sheet.top_m(),
            Form::Ragged(columns) => columns.top_m(),
        };
        self.clouds.iter().map(top_m).fold(0.0, f64::max)
    }

    /// Flies from a place until something is met.
    pub(super) fn fly(&self, place: DVec3, direction: DVec3, random: &mut Random) -> Met {
        let mut line = Line::from(place, direction);
        line.to_m = to_ground(place, direction);
        match self.collide(&line, random) {
            Some((part, way_m)) => Met::Cloud(part, self.wrapped(line.at(way_m))),
            None if direction.z < 0.0 => Met::Ground(self.wrapped(line.at(line.to_m)).with_z(0.0)),
            None => Met::Space,
        }
    }

    /// The first collision on a line: its part, and the way to it.
    pub(in crate::reference::monte_carlo) fn collide(&self, line: &Line, random: &mut Random) -> Option<(usize, f64)> {
        let (mut line, mut met) = (*line, None);
        // Whichever comes first: parts are independent.
        for (number, cloud) in self.clouds.iter().enumerate() {
            if let Some(way_m) = cloud.collide(&line, random) {
                line.to_m = way_m;
                met = Some((number, way_m));
            }
        }
        met
    }

    /// Part of the light from a direction above the horizon that arrives at a place: its mean is exact.
    pub(super) fn transmittance(&self, place: DVec3, direction: DVec3, random: &mut Random) -> f64 {
        self.drawn_transmittance(&Line::from(place, direction), random)
    }

    /// The same of all light along a line.
    pub(in crate::reference::monte_carlo) fn drawn_transmittance(&self, line: &Line, random: &mut Random) -> f64 {
        let mut part = 1.0;
        for cloud in &self.clouds {
            part *= match &cloud.form {
                Form::Cumulus(index, drift) if !index.is_hard() => {
                    cloud.drawn_transmittance(index, &without(*drift, line), random)
                }
                _ => (-cloud.depth(line)).exp(),
            };
            if part <= 0.0 {
                break;
            }
        }
        part
    }

    /// Optical depth along a line, by quadrature in soft edges; beyond [`OPAQUE`] it may be too small.
    pub(in crate::reference::monte_carlo) fn depth(&self, line: &Line) -> f64 {
        self.clouds.iter().map(|cloud| cloud.depth(line)).sum()
    }

    /// Pieces of cloud on a line, in order; of one part `only`, or of all.
    pub(in crate::reference::monte_carlo) fn pieces(&self, line: &Line, only: Option<usize>) -> Vec<Piece> {
        let mut parts: Vec<Vec<(f64, f64, f64)>> = Vec::new();
        let mut edges = Vec::new();
        for (number, cloud) in self.clouds.iter().enumerate() {
            let mut pieces = Vec::new();
            if only.is_some_and(|only| only != number) {
                parts.push(pieces);
                continue;
            }
            cloud.pieces(line, |from_m, to_m, extinction| {
                pieces.push((from_m, to_m, extinction));
                edges.extend([from_m, to_m]);
                ControlFlow::Continue(())
            });
            parts.push(pieces);
        }
        edges.sort_unstable_by(f64::total_cmp);
        edges.dedup();
        let mut next = [0; MAX_PARTS];
        let piece = |edges: &[f64]| {
            let (from_m, to_m) = (edges[0], edges[1]);
            let mut extinctions = [0.0; MAX_PARTS];
            for (part, pieces) in parts.iter().enumerate() {
                while pieces.get(next[part]).is_some_and(|piece| piece.1 <= from_m) {
                    next[part] += 1;
                }
                let inside = pieces.get(next[part]).filter(|piece| piece.0 <= from_m);
                extinctions[part] = inside.map_or(0.0, |piece| piece.2);
            }
            Piece { from_m, to_m, extinctions, extinction: extinctions.iter().sum() }
        };
        edges.windows(2).map(piece).filter(|piece| piece.extinction > 0.0).collect()
    }

    /// The same place of the domain itself: or coordinates lose digits on long ways.
    pub(in crate::reference::monte_carlo) fn wrapped(&self, place: DVec3) -> DVec3 {
        let period = |metres: f64| (metres / self.extent_m).round();
        place - dvec3(period(place.x), period(place.y), 0.0) * self.extent_m
    }
}

impl Cloud<'_> {
    /// The way to a collision, if there is one on the line.
    fn collide(&self, line: &Line, random: &mut Random) -> Option<f64> {
        if self.extinction_per_m <= 0.0 {
            return None;
        }
        let mut optical = random.free_path();
        let mut hit = None;
        match &self.form {
            Form::Cumulus(index, drift) => {
                let line = without(*drift, line);
                index.walk(&line, |span| {
                    let most_per_m = self.extinction_per_m * span.most_density;
                    let mut way_m = span.from_m;
                    loop {
                        let step_m = optical / most_per_m;
                        if way_m + step_m >= span.to_m {
                            // Rounding must not make it negative.
                            optical = (optical - (span.to_m - way_m) * most_per_m).max(0.0);
                            return ControlFlow::Continue(());
                        }
                        way_m += step_m;
                        if span.full || random.uniform() * span.most_density < index.density_at(&span, line.at(way_m)) {
                            hit = Some(way_m);
                            return ControlFlow::Break(());
                        }
                        optical = random.free_path();
                    }
                });
            }
            Form::Sheet(_) | Form::Ragged(_) => self.pieces(line, |from_m, to_m, extinction| {
                let depth = extinction * (to_m - from_m);
                if optical < depth {
                    hit = Some(from_m + optical / extinction);
                    return ControlFlow::Break(());
                }
                optical -= depth;
                ControlFlow::Continue(())
            }),
        }
        hit
    }

    /// Ratio tracking where the edge is soft.
    fn drawn_transmittance(&self, index: &Index, line: &Line, random: &mut Random) -> f64 {
        let mut part = 1.0;
        if self.extinction_per_m <= 0.0 {
            return part;
        }
        index.walk(line, |span| {
            if span.full {
                part *= (-self.extinction_per_m * (span.to_m - span.from_m)).exp();
            } else {
                let most_per_m = self.extinction_per_m * span.most_density;
                let mut way_m = span.from_m + random.free_path() / most_per_m;
                while way_m < span.to_m {
                    part *= 1.0 - index.density_at(&span, line.at(way_m)) / span.most_density;
                    way_m += random.free_path() / most_per_m;
                }
            }
            if part < NEGLIGIBLE {
                part = 0.0;
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        part
    }

    fn depth(&self, line: &Line) -> f64 {
        let mut depth = 0.0;
        self.pieces(line, |from_m, to_m, extinction| {
            depth += extinction * (to_m - from_m);
            if depth > OPAQUE { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        depth
    }

    /// Start, end and extinction of the pieces of cloud on a line.
    fn pieces(&self, line: &Line, mut visit: impl FnMut(f64, f64, f64) -> ControlFlow<()>) {
        let extinction = self.extinction_per_m;
        match &self.form {
            Form::Cumulus(index, drift) => {
                index.pieces(&without(*drift, line), |from_m, to_m, density| visit(from_m, to_m, extinction * density));
            }
            // Its breaks are nobody's business.
            Form::Sheet(sheet) => {
                let _: ControlFlow<()> = sheet.pieces(line, |from_m, to_m| visit(from_m, to_m, extinction));
            }
            Form::Ragged(columns) => {
                let _: ControlFlow<()> =
                    columns.pieces(line, |from_m, to_m, density| visit(from_m, to_m, extinction * density));
            }
        }
    }
}

/// A line as clouds meet it that the wind has carried so far: as if they had stayed.
fn without(drift: DVec3, line: &Line) -> Line {
    Line { origin: line.origin - drift, ..*line }
}

/// The way down to the ground, metres; infinite for lines that do not go down.
pub(super) fn to_ground(place: DVec3, direction: DVec3) -> f64 {
    if direction.z < 0.0 { place.z.max(0.0) / -direction.z } else { f64::INFINITY }
}
