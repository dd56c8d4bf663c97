//! Phase functions given as tables: judged once, on reading, so that nothing that is made of one can fail later.

use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

use super::phase::{PhaseFunction, grid_deg, rules};

/// Numbers of points accepted: as many as a fine table has over 180 degrees.
pub const TABLE_POINTS: RangeInclusive<usize> = 2..=4096;
/// Degrees at either end over which a table may be silent, its first and last value holding there: programs that give
/// means over bins of a degree give them at the middles, 0.5 to 179.5.
const SILENT_DEG: f64 = 0.5;
/// Degrees by which angles may lie beyond 0 and 180: what turning radians into degrees in single precision leaves.
const ROUNDING_DEG: f64 = 1e-3;
/// The largest angle that is taken for one of a table in radians; no table in degrees ends there.
const LARGEST_RADIANS: f64 = 3.2;
/// Part of the light that may be scattered by other angles than the table says, for want of finer ones.
const MOST_MISPLACED: f64 = 0.01;
/// Part of the light whose place hangs on how the table is read between its points, from which on that is told.
const DOUBTFUL: f64 = 0.02;

/// A table of a phase function that was checked, and the function on the common grid of angles.
#[derive(Clone, Debug)]
pub struct PhaseTable(Arc<Checked>);

#[derive(Debug)]
struct Checked {
    points: Vec<(f64, f64)>,
    phase: PhaseFunction,
    doubt: Option<Doubt>,
}

/// The part of a table where most hangs on how it is read between its points: shares of all scattered light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doubt {
    /// First and last angle of that part, degrees.
    pub between_deg: [f64; 2],
    /// Share that is scattered there as the table is read, 0..1.
    pub share: f64,
    /// Share with the other reading: P itself linear between points, or beyond the table's ends log P as before them.
    pub otherwise: f64,
}

/// Why a table was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{detail}", .point.map_or_else(String::new, |point| format!("point {point}: ")))]
pub struct TableFault {
    /// The point at fault, if it is a single one.
    pub point: Option<usize>,
    /// What is wrong and what is expected.
    pub detail: String,
}

impl PhaseTable {
    /// A phase function given by (scattering angle in degrees, value proportional to P) in ascending order of angle, from 0
    /// to 180 degrees, of which half a degree may be missing at either end.
    ///
    /// Between points log P is linear in the angle (P itself where one of the two is 0); before the first and behind the
    /// last it is constant. It is then sampled at the common grid of angles.
    ///
    /// # Errors
    /// What is wrong with the table: its angles (which are told from radians and cosines), its values, or detail so fine
    /// that a hundredth of the light would be scattered by other angles.
    pub fn new(points: &[(f64, f64)]) -> Result<Self, TableFault> {
        let at_all = |detail: String| TableFault { point: None, detail };
        if !TABLE_POINTS.contains(&points.len()) {
            let (least, most) = TABLE_POINTS.into_inner();
            return Err(at_all(format!("{} points; {least} to {most} are allowed", points.len())));
        }
        for (point, (angle, value)) in points.iter().enumerate() {
            let wrong = |detail| TableFault { point: Some(point), detail };
            if !angle.is_finite() {
                return Err(wrong(format!("the angle {angle} is not a number")));
            }
            if !(value.is_finite() && *value >= 0.0) {
                return Err(wrong(format!("the value {value} is not a finite number, 0 or more")));
            }
        }
        let points: Vec<_> = points.iter().map(|(angle, value)| (tidied(*angle), value + 0.0)).collect();
        check_angles(&points)?;
        if points.iter().all(|(_, value)| *value == 0.0) {
            return Err(at_all("all values are 0; at least one must be above".to_owned()));
        }
        let pieces = pieces(&points);
        let light = Light::of(&pieces);
        let phase = sampled(&pieces, &light).map_err(|fault| at_all(fault.to_string()))?;
        let doubt = light.doubt(&pieces);
        Ok(Self(Arc::new(Checked { points, phase, doubt })))
    }

    /// The points as given.
    #[must_use]
    pub fn points(&self) -> &[(f64, f64)] {
        &self.0.points
    }

    /// The phase function.
    #[must_use]
    pub fn phase(&self) -> &PhaseFunction {
        &self.0.phase
    }

    /// Where the table is too coarse to say how the light is scattered, if that concerns more than a fiftieth of it.
    #[must_use]
    pub fn doubt(&self) -> Option<Doubt> {
        self.0.doubt
    }
}

impl PartialEq for PhaseTable {
    fn eq(&self, other: &Self) -> bool {
        self.points() == other.points()
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([from, to], [share, otherwise]) =
            (self.between_deg, [self.share, self.otherwise].map(|part| 100.0 * part));
        write!(
            out,
            "coarse between {from} and {to} degrees: {share:.1} % of the light is scattered by these angles as the table is \
             read, with log P linear between points, and {otherwise:.1} % if P itself were; more points there would tell"
        )
    }
}

/// What rounding put beyond the ends lies on them, and both zeros are one number.
fn tidied(angle: f64) -> f64 {
    let tidied = angle.clamp(0.0, 180.0) + 0.0;
    if (angle - tidied).abs() <= ROUNDING_DEG { tidied } else { angle }
}

/// Whether the angles are degrees that ascend from 0 to 180, and what they look like otherwise.
fn check_angles(points: &[(f64, f64)]) -> Result<(), TableFault> {
    const EXPECTED: &str = "scattering angles in degrees from 0 to 180 are expected";
    let angles = || points.iter().map(|point| point.0);
    let (least, most) = (angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max));
    let whole = |detail: String| Err(TableFault { point: None, detail });
    if (-1.0 - ROUNDING_DEG..0.0).contains(&least) && most <= 1.0 + ROUNDING_DEG {
        return whole(format!("the angles span {least} to {most}, which looks like their cosines; {EXPECTED}"));
    }
    if least < 0.0 || most > 180.0 {
        return whole(format!("the angles span {least} to {most}; {EXPECTED}"));
    }
    if most <= LARGEST_RADIANS {
        return whole(format!("the angles span {least} to {most}, which looks like radians; {EXPECTED}"));
    }
    if points.windows(2).all(|pair| pair[0].0 > pair[1].0) {
        return whole(format!("the angles descend, from {most} to {least}; {EXPECTED}, ascending"));
    }
    if let Some(before) = points.windows(2).position(|pair| pair[0].0 >= pair[1].0) {
        let (point, angle) = (before + 1, points[before + 1].0);
        let detail =
            format!("the angle {angle} is not larger than the one before, {}; angles must ascend", points[before].0);
        return Err(TableFault { point: Some(point), detail });
    }
    if least > SILENT_DEG || most < 180.0 - SILENT_DEG {
        return whole(format!(
            "the angles span {least} to {most}; {EXPECTED}, of which {SILENT_DEG} may be missing at either end: how much \
             light is scattered by the other angles is not known"
        ));
    }
    Ok(())
}

/// P between two neighbouring angles as it is read, and as it might be read as well. In units of the largest value.
struct Piece {
    from: f64,
    to: f64,
    read: Shape,
    otherwise: Shape,
}

/// A function of the degrees since a piece's start.
#[derive(Clone, Copy)]
enum Shape {
    /// Linear in the angle: value at the start, change over a width.
    Straight(f64, f64, f64),
    /// The logarithm is linear in the angle: the logarithm at the start, its change over a width.
    Bent(f64, f64, f64),
}

impl Shape {
    fn at(self, degrees: f64) -> f64 {
        /// Logarithm of the largest number of another reading: steep ends would give infinity.
        const LARGEST: f64 = 300.0;
        // Widths may be as small as numbers get: a change per degree would be none.
        match self {
            Self::Straight(start, change, width) => (start + change * (degrees / width)).max(0.0),
            Self::Bent(start, 0.0, _) => start.exp(),
            Self::Bent(start, change, width) => (start + change * (degrees / width)).min(LARGEST).exp(),
        }
    }
}

/// All of 0 to 180 degrees.
fn pieces(points: &[(f64, f64)]) -> Vec<Piece> {
    let largest = points.iter().map(|point| point.1).fold(0.0, f64::max);
    let points: Vec<_> = points.iter().map(|(angle, value)| (*angle, value / largest)).collect();
    let between = |pair: &[(f64, f64)]| {
        let ((from, v0), (to, v1)) = (pair[0], pair[1]);
        let straight = Shape::Straight(v0, v1 - v0, to - from);
        let bent = Shape::Bent(v0.ln(), v1.ln() - v0.ln(), to - from);
        Piece { from, to, read: if v0 > 0.0 && v1 > 0.0 { bent } else { straight }, otherwise: straight }
    };
    let inner: Vec<_> = points.windows(2).map(between).collect();
    // A silent end goes on as the piece next to it, or does not.
    let end = |from: f64, to: f64, value: f64, next: &Piece| {
        let read = Shape::Straight(value, 0.0, to - from);
        let otherwise = match next.read {
            Shape::Bent(start, change, width) => {
                Shape::Bent(start + change * ((from - next.from) / width), change, width)
            }
            Shape::Straight(..) => read,
        };
        (to > from).then_some(Piece { from, to, read, otherwise })
    };
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return inner };
    let (Some(next), Some(before)) = (inner.first(), inner.last()) else { return inner };
    let (head, tail) = (end(0.0, first.0, first.1, next), end(last.0, 180.0, last.1, before));
    head.into_iter().chain(inner).chain(tail).collect()
}

/// Light that a table scatters: by less than each angle of the grid, and by those of each piece.
struct Light {
    below: Vec<f64>,
    total: f64,
    /// As read, and otherwise.
    of_piece: Vec<[f64; 2]>,
}

impl Light {
    fn of(pieces: &[Piece]) -> Self {
        let grid = grid_deg();
        let (mut below, mut total, mut of_piece) = (vec![0.0], 0.0, Vec::with_capacity(pieces.len()));
        for piece in pieces {
            let mut sums = [0.0; 2];
            let mut from = piece.from;
            while from < piece.to {
                // Up to the next angle of the grid, or the end of the piece if that is nearer.
                let next = grid.get(below.len()).copied().unwrap_or(180.0);
                let to = next.min(piece.to);
                for (sum, shape) in sums.iter_mut().zip([piece.read, piece.otherwise]) {
                    *sum += integral(shape, from - piece.from, to - piece.from, piece.from);
                }
                if to >= next && below.len() < grid.len() {
                    below.push(total + sums[0]);
                }
                from = to;
            }
            total += sums[0];
            of_piece.push(sums);
        }
        Self { below, total, of_piece }
    }

    fn doubt(&self, pieces: &[Piece]) -> Option<Doubt> {
        let otherwise: f64 = self.of_piece.iter().map(|sums| sums[1]).sum();
        let shares = |sums: &[f64; 2]| [sums[0] / self.total, sums[1] / otherwise];
        let apart = |[a, b]: [f64; 2]| (a - b).abs();
        self.of_piece.iter().find(|sums| apart(shares(sums)) > DOUBTFUL)?;
        // Where light is taken away, all else has more of it: the cause is where the light itself differs.
        let (piece, sums) = pieces.iter().zip(&self.of_piece).max_by(|a, b| apart(*a.1).total_cmp(&apart(*b.1)))?;
        let [share, otherwise] = shares(sums);
        Some(Doubt { between_deg: [piece.from, piece.to], share, otherwise })
    }
}

/// Integral of a shape times the sine of the angle, degrees since `start`.
fn integral(shape: Shape, from: f64, to: f64, start: f64) -> f64 {
    // As many nodes as follow the steepest change, as in `PhaseFunction`.
    let steepness = match shape {
        Shape::Bent(_, change, width) => 0.25 * (change * ((to - from) / width)).abs(),
        Shape::Straight(..) => 0.0,
    };
    let most = rules().len() - 1;
    let (nodes, weights) = &rules()[(steepness.min(most as f64).ceil() as usize + 5).min(most)];
    let half = 0.5 * (to - from);
    let node = |(x, weight): (&f64, &f64)| {
        let degrees = from + half * (1.0 + x);
        weight * shape.at(degrees) * (start + degrees).to_radians().sin()
    };
    half.to_radians() * nodes.iter().zip(weights).map(node).sum::<f64>()
}

/// A table of detail that the common grid does not hold: part of the light that other angles would scatter, 0..1.
#[derive(Debug, thiserror::Error)]
#[error(
    "{:.0} % of the light would be scattered by other angles than the table says: it is finer than phase functions are kept, \
     at angles 0.01 degrees apart around 0 and 180 degrees and up to 0.5 degrees around 90, down to 1e-12 of the largest value",
    100.0 * .0
)]
struct TooFine(f64);

/// The phase function on the common grid, if that holds it.
fn sampled(pieces: &[Piece], light: &Light) -> Result<PhaseFunction, TooFine> {
    let mut piece = 0;
    let value = |angle: &f64| {
        while piece + 1 < pieces.len() && pieces[piece].to <= *angle {
            piece += 1;
        }
        pieces.get(piece).map_or(0.0, |piece| piece.read.at(angle - piece.from))
    };
    let values: Vec<f64> = grid_deg().iter().map(value).collect();
    if light.total <= 0.0 {
        return Err(TooFine(1.0));
    }
    let phase = PhaseFunction::from_grid_values(values).map_err(|_nothing| TooFine(1.0))?;
    let apart = light.below.iter().zip(phase.within()).map(|(below, within)| (below / light.total - within).abs());
    let misplaced = apart.fold(0.0, f64::max);
    if misplaced <= MOST_MISPLACED { Ok(phase) } else { Err(TooFine(misplaced)) }
}
