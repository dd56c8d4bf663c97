//! Lines.

use plotters::style::RGBColor;

/// Pattern of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::chart) enum Dash {
    Solid,
    Dashed,
    Dotted,
}

/// How a line is drawn; `width` in pixels.
#[derive(Clone, Copy, Debug)]
pub(in crate::chart) struct Stroke {
    pub(in crate::chart) colour: RGBColor,
    pub(in crate::chart) width: f64,
    pub(in crate::chart) dash: Dash,
}

impl Stroke {
    pub(in crate::chart) fn solid(colour: RGBColor, width: f64) -> Self {
        Self { colour, width, dash: Dash::Solid }
    }

    pub(in crate::chart) fn dashed(colour: RGBColor, width: f64) -> Self {
        Self { colour, width, dash: Dash::Dashed }
    }

    pub(in crate::chart) fn dotted(colour: RGBColor, width: f64) -> Self {
        Self { colour, width, dash: Dash::Dotted }
    }
}
