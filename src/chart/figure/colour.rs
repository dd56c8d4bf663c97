//! Colours, and a scale of them.

use plotters::style::RGBColor;

/// Colours of lines and points.
pub(in crate::chart) const BLACK: RGBColor = RGBColor(20, 20, 20);
pub(in crate::chart) const GREY: RGBColor = RGBColor(130, 130, 130);
pub(in crate::chart) const BLUE: RGBColor = RGBColor(51, 102, 190);
pub(in crate::chart) const RED: RGBColor = RGBColor(214, 69, 80);
pub(in crate::chart) const GREEN: RGBColor = RGBColor(34, 136, 51);
pub(in crate::chart) const ORANGE: RGBColor = RGBColor(230, 130, 20);
pub(in crate::chart) const BROWN: RGBColor = RGBColor(140, 86, 60);
pub(in crate::chart) const TEAL: RGBColor = RGBColor(0, 150, 160);
pub(in crate::chart) const PURPLE: RGBColor = RGBColor(150, 50, 130);

/// A logarithmic scale of colours.
#[derive(Clone, Debug)]
pub(in crate::chart) struct ColourScale {
    pub(in crate::chart) label: String,
    pub(in crate::chart) from: f64,
    pub(in crate::chart) to: f64,
    pub(in crate::chart) ticks: Vec<(f64, String)>,
}

impl ColourScale {
    /// Light for small values, dark for large ones; beyond the ends as at the ends.
    pub(in crate::chart) fn colour(&self, value: f64) -> RGBColor {
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
