//! A figure as SVG.

use std::ops::Range;

use plotters::backend::SVGBackend;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::drawing::{DrawingArea, IntoDrawingArea as _};
use plotters::element::{Circle, DashedPathElement, PathElement, Rectangle, Text};
use plotters::prelude::Cartesian2d;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontStyle, IntoFont as _, RGBColor, ShapeStyle, TextStyle, WHITE};

use super::axis::Axis;
use super::colour::{BLACK, ColourScale, GREY};
use super::parts::{Figure, Key, Mark, Panel};
use super::stroke::{Dash, Stroke};
use crate::chart::file::{ChartError, ChartFile};

/// The library places everything at whole pixels: a picture is drawn this many times as large, and shown smaller.
const SCALE: u32 = 8;
const GRID: RGBColor = RGBColor(226, 226, 226);

/// Heights of the parts of a figure, and of a letter, in pixels.
const TITLE: u32 = 34;
const SUBTITLE: u32 = 22;
const LEGEND_ROW: u32 = 24;
const SCALE_BAR: u32 = 62;
const LETTER: f64 = 13.0;

/// Of a legend: where its rows begin, from an entry to its words, and from these to the next entry; a letter's width in its heights.
const LEGEND_LEFT: f64 = 66.0;
const LEGEND_KEY: f64 = 37.0;
const LEGEND_GAP: f64 = 22.0;
const LETTER_WIDTH: f64 = 0.54;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Context<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Places, Places>>;

fn pixels(size: f64) -> i32 {
    (size * f64::from(SCALE)).round() as i32
}

fn failed(error: impl std::fmt::Display) -> ChartError {
    ChartError::Drawing(error.to_string())
}

fn font(size: f64, colour: RGBColor) -> TextStyle<'static> {
    // Named sizes are heights of lines, 1.24 times those of letters.
    ("sans-serif", size * 1.24 * f64::from(SCALE)).into_font().color(&colour)
}

impl Figure {
    /// The picture as a file `name`.svg.
    pub(in crate::chart) fn draw(&self, name: &str) -> Result<ChartFile, ChartError> {
        let mut text = String::new();
        let size = self.size.map(|side| side * SCALE);
        {
            let root = SVGBackend::with_string(&mut text, (size[0], size[1])).into_drawing_area();
            root.fill(&WHITE).map_err(failed)?;
            self.draw_on(&root)?;
            root.present().map_err(failed)?;
        }
        let large = format!("width=\"{}\" height=\"{}\"", size[0], size[1]);
        let shown = format!("width=\"{}\" height=\"{}\"", self.size[0], self.size[1]);
        let text = text.replacen(&large, &shown, 1);
        Ok(ChartFile { name: format!("{name}.svg"), bytes: text.into_bytes() })
    }

    fn draw_on(&self, root: &Area<'_>) -> Result<(), ChartError> {
        let title = font(18.0, BLACK);
        let title = TextStyle { font: title.font.style(FontStyle::Bold), ..title };
        write(root, [16.0, 12.0], &self.title, &title)?;
        write(root, [16.0, f64::from(TITLE) + 4.0], &self.subtitle, &font(12.5, GREY))?;
        let bar = if self.scale.is_some() { SCALE_BAR } else { 0 };
        let rows_of_legend = self.legend_rows();
        let legend_height = rows_of_legend.len() as u32 * LEGEND_ROW;
        let below = legend_height + bar + 10;
        let top = (TITLE + SUBTITLE + 6) * SCALE;
        let (_, rest) = root.split_vertically(top as i32);
        let (panels, legend) = rest.split_vertically((self.size[1] * SCALE - top - below * SCALE) as i32);
        let rows = self.panels.len().div_ceil(self.columns);
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((rows, self.columns))) {
            panel.draw(&area)?;
        }
        draw_legend(&legend, &rows_of_legend)?;
        if let Some(scale) = &self.scale {
            scale.draw(&legend, f64::from(self.size[0]), f64::from(legend_height) + 8.0)?;
        }
        Ok(())
    }

    /// The legend's rows; one that is wider than the picture goes on in further ones.
    fn legend_rows(&self) -> Vec<Vec<&(Key, String)>> {
        let mut rows = Vec::new();
        for entries in &self.legend {
            let (mut row, mut x) = (Vec::new(), LEGEND_LEFT);
            for entry in entries {
                let end = x + entry_width(&entry.1);
                if end - LEGEND_GAP > f64::from(self.size[0]) && !row.is_empty() {
                    rows.push(std::mem::take(&mut row));
                    x = LEGEND_LEFT;
                }
                x += entry_width(&entry.1);
                row.push(entry);
            }
            rows.push(row);
        }
        rows
    }
}

/// What an entry of a legend takes of its row.
fn entry_width(words: &str) -> f64 {
    LEGEND_KEY + words.chars().count() as f64 * LETTER * LETTER_WIDTH + LEGEND_GAP
}

fn draw_legend(area: &Area<'_>, rows: &[Vec<&(Key, String)>]) -> Result<(), ChartError> {
    for (row, entries) in rows.iter().enumerate() {
        let y = (row as f64 + 0.5) * f64::from(LEGEND_ROW);
        let mut x = LEGEND_LEFT;
        for (key, words) in entries {
            match key {
                Key::Line(stroke) => path(area, vec![(pixels(x), pixels(y)), (pixels(x + 30.0), pixels(y))], stroke)?,
                Key::Dot { colour, ring } => dot(area, (pixels(x + 22.0), pixels(y)), *colour, *ring)?,
            }
            let style = font(LETTER, BLACK).pos(Pos::new(HPos::Left, VPos::Center));
            write(area, [x + LEGEND_KEY, y], words, &style)?;
            x += entry_width(words);
        }
    }
    Ok(())
}

impl ColourScale {
    fn draw(&self, area: &Area<'_>, width: f64, y: f64) -> Result<(), ChartError> {
        const STEPS: usize = 240;
        let (left, length) = (0.25 * width, 0.5 * width);
        let place = |value: f64| left + length * (value / self.from).ln() / (self.to / self.from).ln();
        for step in 0..STEPS {
            let part = |k: usize| k as f64 / STEPS as f64;
            let value = self.from * (self.to / self.from).powf(part(step) + 0.5 / STEPS as f64);
            // Each step reaches under the next, which hides the seams.
            let corner = (pixels(left + length * part(step)), pixels(y));
            let end = (pixels(left + length * part((step + 2).min(STEPS))), pixels(y + 14.0));
            area.draw(&Rectangle::new([corner, end], self.colour(value).filled())).map_err(failed)?;
        }
        for (value, words) in &self.ticks {
            let style = font(12.0, BLACK).pos(Pos::new(HPos::Center, VPos::Top));
            let x = place(*value);
            path(area, vec![(pixels(x), pixels(y + 14.0)), (pixels(x), pixels(y + 18.0))], &Stroke::solid(BLACK, 1.0))?;
            write(area, [x, y + 21.0], words, &style)?;
        }
        let style = font(LETTER, BLACK).pos(Pos::new(HPos::Center, VPos::Top));
        write(area, [left + 0.5 * length, y + 38.0], &self.label, &style)
    }
}

fn write(area: &Area<'_>, [x, y]: [f64; 2], words: &str, style: &TextStyle<'_>) -> Result<(), ChartError> {
    area.draw(&Text::new(words.to_owned(), (pixels(x), pixels(y)), style.clone())).map_err(failed)
}

fn path(area: &Area<'_>, points: Vec<(i32, i32)>, stroke: &Stroke) -> Result<(), ChartError> {
    match dashes(stroke) {
        None => area.draw(&PathElement::new(points, style(stroke))),
        Some([dash, gap]) => area.draw(&DashedPathElement::new(points, dash, gap, style(stroke))),
    }
    .map_err(failed)
}

fn dot(area: &Area<'_>, at: (i32, i32), colour: RGBColor, ring: bool) -> Result<(), ChartError> {
    for circle in circles(colour, ring) {
        area.draw(&Circle::new(at, circle.0, circle.1)).map_err(failed)?;
    }
    Ok(())
}

/// Radii and fillings of a dot: a hollow one covers what is under it.
fn circles(colour: RGBColor, ring: bool) -> Vec<(i32, ShapeStyle)> {
    if ring {
        vec![(pixels(3.6), colour.filled()), (pixels(2.2), WHITE.filled())]
    } else {
        vec![(pixels(3.0), colour.filled())]
    }
}

fn style(stroke: &Stroke) -> ShapeStyle {
    stroke.colour.stroke_width((stroke.width * f64::from(SCALE)).round() as u32)
}

/// Lengths of a dash and of a gap.
fn dashes(stroke: &Stroke) -> Option<[i32; 2]> {
    match stroke.dash {
        Dash::Solid => None,
        Dash::Dashed => Some([pixels(7.0), pixels(4.0)]),
        Dash::Dotted => Some([pixels(1.6), pixels(2.6)]),
    }
}

/// Places on an axis, with its ticks.
struct Places(Axis);

impl Ranged for Places {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (start, end): (i32, i32)) -> i32 {
        let [from, to] = self.0.places();
        start + ((place - from) / (to - from) * f64::from(end - start)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.0.ticks.iter().map(|(tick, _)| self.0.place(*tick)).collect()
    }

    fn range(&self) -> Range<f64> {
        let [from, to] = self.0.places();
        from..to
    }
}

impl ValueFormatter<f64> for Places {
    fn format_ext(&self, place: &f64) -> String {
        let near = |tick: &&(f64, String)| (self.0.place(tick.0) - place).abs() < 1e-9;
        self.0.ticks.iter().find(near).map(|(_, words)| words.clone()).unwrap_or_default()
    }
}

impl Panel {
    fn draw(&self, area: &Area<'_>) -> Result<(), ChartError> {
        let style_of_title = font(14.0, BLACK);
        let width = f64::from(area.dim_in_pixel().0) / f64::from(SCALE);
        let centred = style_of_title.pos(Pos::new(HPos::Center, VPos::Top));
        write(area, [0.5 * (width + 66.0 - 16.0), 4.0], &self.title, &centred)?;
        let mut context = ChartBuilder::on(area)
            .margin_top(pixels(26.0))
            .margin_right(pixels(16.0))
            .margin_left(pixels(4.0))
            .margin_bottom(pixels(10.0))
            .x_label_area_size(pixels(42.0))
            .y_label_area_size(pixels(62.0))
            .build_cartesian_2d(Places(self.x.clone()), Places(self.y.clone()))
            .map_err(failed)?;
        // Cells would cover the grid, and lines are drawn over it.
        let cells = self.marks.iter().any(|mark| matches!(mark, Mark::Cells(_)));
        for mark in self.marks.iter().filter(|mark| matches!(mark, Mark::Cells(_))) {
            self.draw_mark(&mut context, mark)?;
        }
        let grid = if cells { WHITE.mix(0.0) } else { GRID.mix(1.0) };
        context
            .configure_mesh()
            .bold_line_style(ShapeStyle { color: grid, filled: false, stroke_width: SCALE })
            .light_line_style(WHITE.mix(0.0))
            .axis_style(BLACK.stroke_width(SCALE))
            .set_all_tick_mark_size(pixels(4.0))
            .label_style(font(12.0, BLACK))
            .axis_desc_style(font(LETTER, BLACK))
            .x_desc(self.x.label.clone())
            .y_desc(self.y.label.clone())
            .x_labels(self.x.ticks.len())
            .y_labels(self.y.ticks.len())
            .draw()
            .map_err(failed)?;
        for mark in self.marks.iter().filter(|mark| !matches!(mark, Mark::Cells(_))) {
            self.draw_mark(&mut context, mark)?;
        }
        Ok(())
    }

    fn place(&self, point: &[f64; 2]) -> (f64, f64) {
        (self.x.place(point[0]), self.y.place(point[1]))
    }

    /// Whether a place is on the panel.
    fn holds(&self, (x, y): (f64, f64)) -> bool {
        let ([left, right], [low, high]) = (self.x.places(), self.y.places());
        (left..=right).contains(&x) && (low..=high).contains(&y)
    }

    fn draw_mark(&self, context: &mut Context<'_, '_>, mark: &Mark) -> Result<(), ChartError> {
        match mark {
            Mark::Line(points, stroke) => {
                let places: Vec<(f64, f64)> = points.iter().map(|point| self.place(point)).collect();
                for piece in self.clipped(&places) {
                    self.draw_piece(context, piece, stroke)?;
                }
            }
            Mark::Dots { points, colour, ring } => {
                for [x, y, error] in points {
                    let bar = [[*x, (y - error).max(y * 1e-3)], [*x, y + error]];
                    let bar: Vec<(f64, f64)> = bar.iter().map(|end| self.place(end)).collect();
                    for piece in self.clipped(&bar) {
                        self.draw_piece(context, piece, &Stroke::solid(*colour, 1.2))?;
                    }
                    let at = self.place(&[*x, *y]);
                    if self.holds(at) {
                        let dots =
                            circles(*colour, *ring).into_iter().map(|(size, style)| Circle::new(at, size, style));
                        context.draw_series(dots).map_err(failed)?;
                    }
                }
            }
            Mark::Cells(cells) => {
                let ([_, right], [_, high]) = (self.x.places(), self.y.places());
                // A cell reaches under those drawn after it, which hides the seams.
                let reach = |from: f64, to: f64, end: f64| (to + 0.1 * (to - from)).min(end);
                let cell = |(x, y, colour): &([f64; 2], [f64; 2], RGBColor)| {
                    let (from, to) = (self.place(&[x[0], y[0]]), self.place(&[x[1], y[1]]));
                    let corner = (reach(from.0, to.0, right), reach(from.1, to.1, high));
                    Rectangle::new([(from.0, corner.1), (corner.0, from.1)], colour.filled())
                };
                context.draw_series(cells.iter().map(cell)).map_err(failed)?;
            }
        }
        Ok(())
    }

    fn draw_piece(
        &self,
        context: &mut Context<'_, '_>,
        piece: Vec<(f64, f64)>,
        stroke: &Stroke,
    ) -> Result<(), ChartError> {
        match dashes(stroke) {
            None => context.draw_series(std::iter::once(PathElement::new(piece, style(stroke)))).map(|_| ()),
            Some([dash, gap]) => {
                let element = DashedPathElement::new(piece, dash, gap, style(stroke));
                context.draw_series(std::iter::once(element)).map(|_| ())
            }
        }
        .map_err(failed)
    }

    /// The parts of a line that are on the panel.
    fn clipped(&self, places: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
        let ([left, right], [low, high]) = (self.x.places(), self.y.places());
        let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
        for pair in places.windows(2) {
            let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
            if ![x0, y0, x1, y1].iter().all(|part| part.is_finite()) {
                continue;
            }
            // Part of the segment inside all four edges (Liang and Barsky 1984).
            let (mut start, mut end) = (0.0_f64, 1.0_f64);
            for (slope, room) in
                [(x0 - x1, x0 - left), (x1 - x0, right - x0), (y0 - y1, y0 - low), (y1 - y0, high - y0)]
            {
                if slope < 0.0 {
                    start = start.max(room / slope);
                } else if slope > 0.0 {
                    end = end.min(room / slope);
                } else if room < 0.0 {
                    end = -1.0;
                }
            }
            if start > end {
                continue;
            }
            let at = |part: f64| (x0 + (x1 - x0) * part, y0 + (y1 - y0) * part);
            match pieces.last_mut() {
                Some(piece) if start == 0.0 && piece.last() == Some(&(x0, y0)) => piece.push(at(end)),
                _ => pieces.push(vec![at(start), at(end)]),
            }
        }
        pieces
    }
}
