//! Constants of the two shaders that take a cloud for its surface.

use super::dressed::Scattering;

/// From what extinction times root radius times `1 - g` on a cloud is dense enough for the light in its creases to count: below, light
/// spreads over more than a blob before it turns (measured by Monte Carlo).
const DENSE: f64 = 5.0;

/// How wide the glow at a cloud's edge is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Glow {
    /// Exponent of the cosine for a metre of cloud on a ray: thickness per metre and width per thickness are the shader's own.
    Length(f64),
    /// Exponent for an optical depth of `1 / (1 - g)`.
    Depth(f64),
}

/// How a crease traps light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trap {
    /// By its distance from the coarser surface: none from so many metres on.
    Distance(f64),
    /// By the angle from the coarser surface's normal: an arctangent with this coefficient.
    Arctangent(f64),
}

/// Constants of the shader of 2000, or of the one that followed it. Parts are of the sun's irradiance over pi.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Even light of the body, from the sun by way of all of the cloud.
    pub ambient: f64,
    /// Of the body, by the cosine of the sun.
    pub diffuse: f64,
    /// How far noise turns the normal.
    pub bump: f64,
    /// Of the glow around the sun.
    pub corona: f64,
    /// Depth below the surface from which on a ray meets the body, metres.
    pub layer_m: f64,
    /// How wide the glow is.
    pub glow: Glow,
    /// Of light that creases trap.
    pub traps: f64,
    /// Where they do.
    pub trap: Trap,
    /// Whether light is trapped in thin clouds too.
    pub traps_always: bool,
}

impl Surface {
    /// The later shader, repaired, with the constants of its pictures.
    pub const PUBLISHED: Self = Self {
        ambient: 0.0,
        diffuse: 0.7,
        bump: 0.35,
        corona: 6.0,
        layer_m: 25.0,
        glow: Glow::Length(3.0 / 0.02),
        traps: 0.35,
        trap: Trap::Distance(150.0),
        traps_always: true,
    };
    /// The same, fitted to Monte Carlo.
    pub const REFITTED: Self = Self {
        ambient: 0.243,
        diffuse: 0.066,
        corona: 7.4,
        layer_m: 11.0,
        glow: Glow::Length(6.2 / 0.014),
        traps: 0.23,
        trap: Trap::Distance(53.0),
        traps_always: false,
        ..Self::PUBLISHED
    };
    /// The shader of 2000 as it was published.
    pub const PUBLISHED_3: Self = Self {
        ambient: 0.0,
        diffuse: 1.0,
        bump: 0.35,
        corona: 1.0,
        layer_m: 10.0,
        glow: Glow::Depth(1.0),
        traps: 1.0,
        trap: Trap::Arctangent(4.0),
        traps_always: true,
    };
    /// The same, fitted to Monte Carlo.
    pub const REFITTED_3: Self = Self {
        ambient: 0.24,
        diffuse: 0.043,
        corona: 6.5,
        layer_m: 11.0,
        glow: Glow::Depth(1.75),
        traps: 0.09,
        trap: Trap::Arctangent(312.0),
        traps_always: false,
        ..Self::PUBLISHED_3
    };

    /// Whether creases trap light in clouds of roots of a radius.
    pub fn has_traps(&self, extinction_per_m: f64, scattering: &Scattering, root_m: f64) -> bool {
        let (_, asymmetry) = scattering.droplets();
        self.traps_always || extinction_per_m * root_m * (1.0 - asymmetry) > DENSE
    }

    /// Exponent of the glow's cosine, times length on the ray and share of the layer, metres.
    pub fn glow_m(&self, extinction_per_m: f64, scattering: &Scattering) -> f64 {
        match self.glow {
            Glow::Length(metres) => metres,
            Glow::Depth(depth) => {
                let (_, asymmetry) = scattering.droplets();
                depth / (extinction_per_m * (1.0 - asymmetry).max(1e-3))
            }
        }
    }

    /// Depth at which a ray meets the body, metres: no more than the volume holds, or than half of a small ball.
    pub fn reached_m(&self, band_m: f64, root_m: f64) -> f64 {
        self.layer_m.min(0.9 * band_m).min(0.5 * root_m).max(1e-3)
    }
}
