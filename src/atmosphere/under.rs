//! Air above and below a cover of cloud.
//!
//! Above the cover light is that of air over a bright boundary. Below it the air's own light is a mixture by cover: of
//! clear air's, and of what the clouds' light makes there.

use super::moments::Moments;
use super::profile::Coefficients;

/// Light in the air below a cover at a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shade {
    /// Part of the sun's beam that comes through the cover, 0 to 1.
    pub beam: f64,
    /// Part of clear air's diffuse light that is there, 0 to 1.
    pub clear: f64,
    /// Mean radiance over all directions of the light that the clouds make of it all, 1/sr per unit sun.
    pub mean: f64,
    /// Downward less upward irradiance of that light, over 4 pi.
    pub net: f64,
}

impl Shade {
    /// The clouds' light scattered into a view upwards of this cosine, by air of these coefficients and the aerosol's
    /// asymmetry: to first order in the phase function.
    #[must_use]
    pub fn scattered(self, weight: Coefficients, asymmetry: f64, view_cosine: f64) -> f64 {
        let even = (weight.rayleigh + weight.aerosol) * self.mean;
        (even + 3.0 * weight.aerosol * asymmetry * view_cosine * self.net).max(0.0)
    }
}

/// A cover of cloud, seen from the air below it.
pub trait Under: Sync {
    /// Height of its top, m: air above is clear.
    fn ceiling_m(&self) -> f64;
    /// Air without the cover, over the ground; solved as finely as the air above.
    fn clear(&self) -> &Moments;
    /// Light at a height (m) below the top under a sun of this local cosine.
    fn shade(&self, height_m: f64, sun_cosine: f64) -> Shade;
}

/// Light of the whole air: clear, or with a cover of cloud in it.
#[derive(Clone, Copy)]
pub struct Sky<'a> {
    /// Air over the ground, or over the cover.
    pub above: &'a Moments,
    /// What lies below the cover's top.
    pub under: Option<&'a dyn Under>,
}

impl std::fmt::Debug for Sky<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sky").field("above", &self.above).field("covered", &self.under.is_some()).finish()
    }
}

impl<'a> From<&'a Moments> for Sky<'a> {
    fn from(moments: &'a Moments) -> Self {
        Self { above: moments, under: None }
    }
}

impl<'a> Sky<'a> {
    /// Height of the ground, m.
    #[must_use]
    pub fn floor_m(self) -> f64 {
        self.under.map_or(self.above, |under| under.clear()).air.floor_m()
    }

    /// The table for a height, and what the cover makes of its light there.
    pub(super) fn at(self, height_m: f64, sun_cosine: f64) -> (&'a Moments, Option<Shade>) {
        match self.under {
            Some(under) if height_m < under.ceiling_m() => (under.clear(), Some(under.shade(height_m, sun_cosine))),
            _ => (self.above, None),
        }
    }
}
