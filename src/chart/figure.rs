//! Pictures of panels with axes, on white.

mod axis;
mod draw;

use plotters::style::RGBColor;

pub(super) use axis::Axis;

/// Colours of lines and points.
pub(super) const BLACK: RGBColor = RGBColor(20, 20, 20);
pub(super) const GREY: RGBColor = RGBColor(130, 130, 130);
pub(super) const BLUE: RGBColor = RGBColor(51, 102, 190);
pub(super) const RED: RGBColor = RGBColor(214, 69, 80);
pub(super) const GREEN: RGBColor = RGBColor(34, 136, 51);
pub(super) const ORANGE: RGBColor = RGBColor(230, 130, 20);
pub(super) const BROWN: RGBColor = RGBColor(140, 86, 60);
pub(super) const TEAL: RGBColor = RGBColor(0, 150, 160);
pub(super) const PURPLE: RGBColor = RGBColor(150, 50, 130);

/// Pattern of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dash {
    Solid,
    Dashed,
    Dotted,
}

/// How a line is drawn; `width` in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke {
    pub(super) colour: RGBColor,
    pub(super) width: f64,
    pub(super) dash: Dash,
}

impl Stroke {
    pub(super) fn solid(colour: RGBColor, width: f64) -> Self {
        Self { colour, width, dash: Dash::Solid }
    }

    pub(super) fn dashed(colour: RGBColor, width: f64) -> Self {
        Self { colour, width, dash: Dash::Dashed }
    }

    pub(super) fn dotted(colour: RGBColor, width: f64) -> Self {
        Self { colour, width, dash: Dash::Dotted }
    }
}

/// Something inside a panel, in its axes' units.
#[derive(Clone, Debug)]
pub(super) enum Mark {
    Line(Vec<[f64; 2]>, Stroke),
    /// Points (x, y, standard error of y); rings are hollow.
    Dots {
        points: Vec<[f64; 3]>,
        colour: RGBColor,
        ring: bool,
    },
    /// Rectangles: range of x, range of y, colour.
    Cells(Vec<([f64; 2], [f64; 2], RGBColor)>),
}

/// Axes with what they hold.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) marks: Vec<Mark>,
}

/// Sample of a legend.
#[derive(Clone, Copy, Debug)]
pub(super) enum Key {
    Line(Stroke),
    Dot { colour: RGBColor, ring: bool },
}

/// A logarithmic scale of colours.
#[derive(Clone, Debug)]
pub(super) struct ColourScale {
    pub(super) label: String,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) ticks: Vec<(f64, String)>,
}

impl ColourScale {
    /// Light for small values, dark for large ones; beyond the ends as at the ends.
    pub(super) fn colour(&self, value: f64) -> RGBColor {
        // Inferno of matplotlib (N. Smith, S. van der Walt; CC0), turned round.
        const STOPS: [[f64; 3]; 9] = [
            [252.0, 255.0, 208.0],
            [249.0, 220.0, 90.0],
            [252.0, 165.0, 10.0],
            [243.0, 120.0, 25.0],
            [221.0, 81.0, 58.0],
            [174.0, 48.0, 92.0],
            [120.0, 28.0, 109.0],
            [65.0, 9.0, 103.0],
            [10.0, 4.0, 30.0],
        ];
        let part = (value.max(1e-30) / self.from).ln() / (self.to / self.from).ln();
        let place = part.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
        let low = (place as usize).min(STOPS.len() - 2);
        let mix = |i: usize| (STOPS[low][i] + (STOPS[low + 1][i] - STOPS[low][i]) * (place - low as f64)) as u8;
        RGBColor(mix(0), mix(1), mix(2))
    }
}

/// A picture. Sizes in pixels.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) size: [u32; 2],
    /// Panels in a row.
    pub(super) columns: usize,
    pub(super) panels: Vec<Panel>,
    /// Rows of samples with words.
    pub(super) legend: Vec<Vec<(Key, String)>>,
    pub(super) scale: Option<ColourScale>,
}
