//! Curves of the fields, and their figure.

use super::kind::{COVERS, Kind, PATTERNS};
use super::measure::{FIRST_OCTAVE, OCTAVES, gamma_below, middle};
use crate::chart::csv::{Csv, short};
use crate::chart::figure::{
    Axis, BLACK, BLUE, Dash, Figure, GREEN, GREY, Key, Mark, ORANGE, PURPLE, Panel, RED, Stroke,
};
use plotters::style::RGBColor;

const COLOURS: [RGBColor; PATTERNS.len()] = [GREEN, BLUE, ORANGE, PURPLE];
/// Of textures of each size, and of those of a finer scene.
const SIZE_COLOURS: [RGBColor; 5] = [ORANGE, GREEN, BLUE, RED, BLACK];
/// What power of axes over diagonals is to be within.
const EVEN: [f64; 2] = [0.8, 1.3];

/// A curve of a kind of field, of textures of a size of a scene of a resolution.
#[derive(Debug)]
pub(super) struct Curve {
    pub(super) kind: Kind,
    pub(super) resolution: usize,
    pub(super) size: usize,
    pub(super) points: Vec<[f64; 2]>,
}

/// What is drawn.
#[derive(Debug, Default)]
pub(super) struct Curves {
    /// Cycles per km, part of the variance per cycle per km.
    pub(super) spectra: Vec<Curve>,
    /// Optical depth over its mean, part of the cloudy columns below.
    pub(super) depths: Vec<Curve>,
    /// As spectra, of thickness.
    pub(super) detail: Vec<Curve>,
    /// Power along axes over that along diagonals of every field by octave.
    pub(super) ratios: Vec<(Kind, Vec<[f64; OCTAVES]>)>,
}

fn colour(kind: Kind) -> RGBColor {
    PATTERNS.iter().zip(COLOURS).find(|((pattern, _), _)| *pattern == kind.pattern).map_or(BLACK, |(_, colour)| colour)
}

fn line(points: Vec<[f64; 2]>, colour: RGBColor, dashed: bool) -> Mark {
    Mark::Line(points, if dashed { Stroke::dashed(colour, 1.6) } else { Stroke::solid(colour, 2.0) })
}

impl Curves {
    pub(super) fn table(&self) -> Csv {
        let mut csv = Csv::new(&["curve", "pattern", "law", "coverage", "resolution", "size", "x", "y"]);
        for (name, curves) in [("spectrum", &self.spectra), ("distribution", &self.depths), ("detail", &self.detail)] {
            for curve in curves {
                let (coverage, numbers) =
                    (short(curve.kind.coverage), [curve.resolution, curve.size].map(|n| n.to_string()));
                let words = [name, curve.kind.pattern, curve.kind.law(), &coverage, &numbers[0], &numbers[1]];
                for point in &curve.points {
                    csv.row(&words, &point.map(Some));
                }
            }
        }
        csv
    }

    /// Curves of a coverage.
    fn of(curves: &[Curve], coverage: f64) -> Vec<Mark> {
        let wanted = curves.iter().filter(|curve| curve.kind.coverage == coverage);
        wanted.map(|curve| line(curve.points.clone(), colour(curve.kind), curve.kind.spread.is_none())).collect()
    }

    fn spectra(&self, (coverage, _): (f64, f64), title: &str) -> Panel {
        let mut marks = Self::of(&self.spectra, coverage);
        let law = [0.4, 12.0].map(|cycles: f64| [cycles, 0.7 * cycles.powf(-5.0 / 3.0)]);
        marks.push(Mark::Line(law.into(), Stroke { colour: BLACK, width: 1.6, dash: Dash::Dotted }));
        Panel {
            title: format!("spectrum, {title}"),
            x: Axis::log("cycles per km", [0.14, 14.0]),
            y: Axis::log("part of variance per cycle per km", [1e-4, 10.0]),
            marks,
        }
    }

    fn depths(&self, (coverage, spread): (f64, f64), title: &str) -> Panel {
        let mut marks = Self::of(&self.depths, coverage);
        let places = (0..=60).map(|i| 10.0_f64.powf(-2.0 + f64::from(i) / 22.0));
        let law = places.map(|depth| [depth, gamma_below(spread, depth)]).collect();
        marks.push(Mark::Line(law, Stroke::dotted(BLACK, 2.2)));
        marks.push(Mark::Line(vec![[0.15, 0.0], [0.15, 0.05], [0.01, 0.05]], Stroke::solid(GREY, 1.0)));
        Panel {
            title: format!("distribution, {title}"),
            x: Axis::log("optical depth over its mean", [0.01, 5.0]),
            y: Axis::linear("part of the cloudy columns below", [0.0, 1.0], 0.1),
            marks,
        }
    }

    fn directions(&self) -> Panel {
        let octave = |i: usize| FIRST_OCTAVE * (i as f64 + 0.5).exp2();
        let wanted = || self.ratios.iter().filter(|(kind, _)| kind.coverage == COVERS[0].0);
        let mut marks: Vec<_> = EVEN
            .map(|limit| Mark::Line(vec![[FIRST_OCTAVE, limit], [octave(OCTAVES), limit]], Stroke::solid(GREY, 1.0)))
            .into();
        for (kind, fields) in wanted().filter(|(kind, _)| kind.spread.is_some()) {
            let dots =
                fields.iter().flat_map(|ratios| ratios.iter().enumerate().map(|(i, ratio)| [octave(i), *ratio, 0.0]));
            marks.push(Mark::Dots { points: dots.collect(), colour: colour(*kind), ring: true });
        }
        for (kind, fields) in wanted() {
            let mean = |i: usize| middle(&fields.iter().map(|ratios| ratios[i]).collect::<Vec<_>>());
            let points = (0..OCTAVES).map(|i| [octave(i), mean(i)]).collect();
            marks.push(line(points, colour(*kind), kind.spread.is_none()));
        }
        Panel {
            title: "directions, broken".to_owned(),
            x: Axis::log("cycles per domain, octaves", [FIRST_OCTAVE, octave(OCTAVES - 1) * 1.5]),
            y: Axis::log("power along axes over diagonals", [0.4, 60.0]),
            marks,
        }
    }

    fn detail(&self) -> Panel {
        let each = self.detail.chunks(SIZE_COLOURS.len()).flat_map(|of_law| of_law.iter().zip(SIZE_COLOURS));
        let mark =
            |(curve, colour): (&Curve, RGBColor)| line(curve.points.clone(), colour, curve.kind.spread.is_none());
        Panel {
            title: "detail, thickness, by size".to_owned(),
            x: Axis::log("cycles per km", [0.8, 60.0]),
            y: Axis::log("part of variance per cycle per km", [1e-6, 1.0]),
            marks: each.map(mark).collect(),
        }
    }

    pub(super) fn figure(&self) -> Figure {
        let [broken, sheet] = COVERS;
        let solid = |colour| Key::Line(Stroke::solid(colour, 2.5));
        let patterns =
            PATTERNS.iter().zip(COLOURS).map(|((pattern, _), colour)| (solid(colour), (*pattern).to_owned()));
        let laws = [
            (Key::Line(Stroke::solid(GREY, 2.0)), "law gamma".to_owned()),
            (Key::Line(Stroke::dashed(GREY, 1.6)), "law lognormal".to_owned()),
            (Key::Line(Stroke::dotted(BLACK, 2.2)), "-5/3; gamma distribution asked for".to_owned()),
        ];
        let names = ["size 256 of a scene of 256", "512", "1024", "2048", "2048 of a scene of 2048"];
        let sizes =
            names.into_iter().zip(SIZE_COLOURS).map(|(name, colour)| (solid(colour), format!("detail: {name}")));
        Figure {
            title: "Synthetic fields: spectrum, distribution, directions and detail".to_owned(),
            subtitle: "optical depth of fields of 512 x 512 texels and 20.48 km, means over eight seeds (rings: each); cover 0.55 and spread 0.9 \
                       (broken), 0.95 and 0.5 (sheet)"
                .to_owned(),
            size: [1320, 900],
            columns: 3,
            panels: vec![
                self.spectra(broken, "broken"),
                self.depths(broken, "broken"),
                self.directions(),
                self.spectra(sheet, "sheet"),
                self.depths(sheet, "sheet"),
                self.detail(),
            ],
            legend: vec![patterns.chain(laws).collect(), sizes.collect()],
            scale: None,
        }
    }
}
