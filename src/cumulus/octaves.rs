//! Light scattered many times as a few octaves of light scattered once: each weaker, less sharp, and deeper in the cloud than the one
//! before (M. Wrenninge, C. Kulla and V. Lundqvist, "Oz: the great and volumetric", 2013).

/// Octaves `i` of light, `gain amplitude^i P(asymmetry^i g) exp(-sun^i tau_sun - view^i tau_view)` per optical depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Octaves {
    /// How many there are.
    pub count: u32,
    /// All of them are multiplied by this.
    pub gain: f64,
    /// Strength of an octave against that of the one before.
    pub amplitude: f64,
    /// The same of optical depth towards the sun.
    pub sun: f64,
    /// The same of the asymmetry of Henyey and Greenstein's phase function.
    pub asymmetry: f64,
    /// The same of optical depth towards the eye.
    pub view: f64,
}

impl Octaves {
    /// Fitted to Monte Carlo in three dimensions: the method `octaves`.
    pub const REFITTED: Self = Self { count: 3, gain: 1.45, amplitude: 0.34, sun: 0.25, asymmetry: 0.46, view: 0.38 };
    /// The same with more octaves, which err by a twentieth less and cost twice as much.
    pub const REFITTED_8: Self = Self { count: 8, gain: 1.29, amplitude: 0.40, sun: 0.45, asymmetry: 0.63, view: 0.54 };
    /// As they are used by most: halves.
    pub const PUBLISHED: Self = Self { count: 8, gain: 1.0, amplitude: 0.5, sun: 0.5, asymmetry: 0.5, view: 0.5 };
}
