//! What a figure is made of.

use super::axis::Axis;
use super::colour::ColourScale;
use super::stroke::Stroke;
use plotters::style::RGBColor;

/// Something inside a panel, in its axes' units.
#[derive(Clone, Debug)]
pub(in crate::chart) enum Mark {
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
pub(in crate::chart) struct Panel {
    pub(in crate::chart) title: String,
    pub(in crate::chart) x: Axis,
    pub(in crate::chart) y: Axis,
    pub(in crate::chart) marks: Vec<Mark>,
}

/// Sample of a legend.
#[derive(Clone, Copy, Debug)]
pub(in crate::chart) enum Key {
    Line(Stroke),
    Dot { colour: RGBColor, ring: bool },
}

/// A picture. Sizes in pixels.
#[derive(Clone, Debug)]
pub(in crate::chart) struct Figure {
    pub(in crate::chart) title: String,
    pub(in crate::chart) subtitle: String,
    pub(in crate::chart) size: [u32; 2],
    /// Panels in a row.
    pub(in crate::chart) columns: usize,
    pub(in crate::chart) panels: Vec<Panel>,
    /// Rows of samples with words.
    pub(in crate::chart) legend: Vec<Vec<(Key, String)>>,
    pub(in crate::chart) scale: Option<ColourScale>,
}
