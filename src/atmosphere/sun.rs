//! The sky of one sun from one height, as two textures that a device can sample.
//!
//! A texel's radiance is `sky + P_A(c) / 4 pi * aureole`: the aerosol's phase function is applied after the lookup, so
//! the aureole is as sharp as the function is. Rows are elevations, spaced quadratically from the horizon; columns are
//! azimuths from the sun's, 0 to 180 degrees.

use std::f64::consts::PI;

use super::air::twilight;
use super::geometry::{TOP_M, inside};
use super::path::Limits;
use super::profile::Phase;
use super::row::Viewpoint;
use super::under::Sky;

/// Where the integrals of a sky end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// At space or the boundary.
    Atmosphere,
    /// At a level layer of this height, m: its base for an eye below, its top for an eye above.
    Shell(f64),
}

/// Size of the textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Rows from the horizon to the zenith, at least 2, or 0 for none.
    pub above: usize,
    /// Rows from the horizon down to the nadir, at least 2, or 0 for none.
    pub below: usize,
    /// Columns, at least 2.
    pub columns: usize,
    /// Steps along a ray, at least 2.
    pub steps: usize,
}

impl Default for Layout {
    /// Measured against direct evaluation at six suns from 20 to 95 degrees: 0.06 % rms at 440 nm, 0.14 % at 640 nm.
    fn default() -> Self {
        Self { above: 64, below: 0, columns: 32, steps: 32 }
    }
}

/// Rows on one side of the horizon, from the horizon on.
#[derive(Clone, Debug, Default)]
pub struct Band {
    /// Everything but the aerosol's single scattering, rows outermost, 1/sr.
    pub sky: Vec<f64>,
    /// Factor of the aerosol's phase function.
    pub aureole: Vec<f64>,
    /// Transmittance from the eye to the end, by row.
    pub transmittance: Vec<f64>,
}

/// The sky of one sun, height and wavelength.
#[derive(Clone)]
pub struct SunSky {
    /// Elevation of the horizon, 0 or below: above it rays reach space or the layer, below it the boundary or the
    /// layer.
    pub horizon_deg: f64,
    /// Rows above the horizon.
    pub above: Band,
    /// Rows below it.
    pub below: Band,
    /// Size of the textures.
    pub layout: Layout,
    sun_cosine: f64,
    phase: Phase,
}

impl std::fmt::Debug for SunSky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SunSky")
            .field("horizon_deg", &self.horizon_deg)
            .field("sun_cosine", &self.sun_cosine)
            .field("layout", &self.layout)
            .finish_non_exhaustive()
    }
}

/// Limits of rays for an eye.
fn limits(floor_m: f64, eye_m: f64, end: End) -> Limits {
    match end {
        End::Atmosphere => Limits { floor_m, ceiling_m: TOP_M },
        End::Shell(shell_m) if eye_m >= shell_m => Limits { floor_m: shell_m.max(floor_m), ceiling_m: TOP_M },
        End::Shell(shell_m) => Limits { floor_m, ceiling_m: shell_m.min(TOP_M) },
    }
}

impl SunSky {
    /// Integrates the textures for an eye at a height (m; clamped to the boundary from below, may be above the air)
    /// and the cosine of the sun's zenith angle there. Light reflected by the boundary and seen directly is not
    /// included.
    #[must_use]
    pub fn new<'a>(sky: impl Into<Sky<'a>>, eye_m: f64, sun_cosine: f64, layout: Layout, end: End) -> Self {
        let sky = sky.into();
        let floor_m = sky.floor_m();
        let eye_m = if eye_m > TOP_M { eye_m } else { inside(eye_m, floor_m) };
        let limits = limits(floor_m, eye_m, end);
        let viewpoint = Viewpoint { eye_m, sun_cosine, limits, steps: layout.steps };
        let sin_dip = viewpoint.sin_dip().clamp(0.0, 1.0);
        let horizon = -sin_dip.asin();
        let dusk = twilight(eye_m, sun_cosine);
        let azimuths: Vec<f64> =
            (0..layout.columns).map(|i| (PI * i as f64 / (layout.columns - 1) as f64).cos()).collect();
        let band = |rows: usize, reach: f64, least: f64, greatest: f64| {
            let mut band = Band::default();
            for i in 0..rows {
                let y = i as f64 / (rows - 1) as f64;
                let cosine = (horizon + reach * y * y).sin().clamp(least, greatest);
                let row = viewpoint.row(sky, cosine, &azimuths);
                band.sky.extend(row.sky.iter().map(|value| value * dusk));
                band.aureole.extend(row.aureole.iter().map(|value| value * dusk));
                band.transmittance.push(row.transmittance);
            }
            band
        };
        // The first row of each band lies at the horizon itself, on its own side of it.
        let below_horizon = (-sin_dip - 1e-12).max(-1.0);
        Self {
            horizon_deg: horizon.to_degrees(),
            above: band(layout.above, PI / 2.0 - horizon, -sin_dip, 1.0),
            below: band(layout.below, -PI / 2.0 - horizon, -1.0, below_horizon),
            layout,
            sun_cosine,
            phase: sky.above.air.seen_phase(inside(eye_m.min(TOP_M), floor_m), sun_cosine),
        }
    }

    /// The aerosol's phase function as it is seen towards an angle from the sun of this cosine; its integral over the sphere is
    /// 4 pi.
    #[must_use]
    pub fn phase(&self, cosine: f64) -> f64 {
        (self.phase)(cosine)
    }

    /// Where an elevation lies: its band and row.
    fn row(&self, elevation_deg: f64) -> (&Band, f64) {
        let from_horizon = elevation_deg - self.horizon_deg;
        let (band, reach) = if from_horizon >= 0.0 {
            (&self.above, 90.0 - self.horizon_deg)
        } else {
            (&self.below, -90.0 - self.horizon_deg)
        };
        let y = (from_horizon / reach).clamp(0.0, 1.0).sqrt();
        (band, y * (band.transmittance.len().max(1) - 1) as f64)
    }

    /// Radiance of air towards an elevation (-90 to 90) and an azimuth from the sun's (any), by bilinear lookup; 1/sr.
    ///
    /// 0 where the layout has no rows.
    #[must_use]
    pub fn radiance(&self, elevation_deg: f64, azimuth_deg: f64) -> f64 {
        let (band, row) = self.row(elevation_deg);
        if band.transmittance.is_empty() {
            return 0.0;
        }
        let azimuth = azimuth_deg.to_radians().cos();
        let columns = self.layout.columns;
        let column = azimuth.acos() / PI * (columns - 1) as f64;
        let (i, j) = ((row as usize).min(band.transmittance.len() - 2), (column as usize).min(columns - 2));
        let (u, v) = (row - i as f64, column - j as f64);
        let texel = |values: &[f64]| {
            let at = |i: usize, j: usize| values[i * columns + j];
            (at(i, j) * (1.0 - v) + at(i, j + 1) * v) * (1.0 - u)
                + (at(i + 1, j) * (1.0 - v) + at(i + 1, j + 1) * v) * u
        };
        let (sine, cosine) = (elevation_deg.to_radians().sin(), elevation_deg.to_radians().cos());
        let sun_sine = ((1.0 - self.sun_cosine) * (1.0 + self.sun_cosine)).max(0.0).sqrt();
        let to_sun = (sine * self.sun_cosine + cosine * sun_sine * azimuth).clamp(-1.0, 1.0);
        texel(&band.sky) + (self.phase)(to_sun) / (4.0 * PI) * texel(&band.aureole)
    }

    /// Transmittance from the eye to the end of a ray; 1 where the layout has no rows.
    #[must_use]
    pub fn transmittance(&self, elevation_deg: f64) -> f64 {
        let (band, row) = self.row(elevation_deg);
        let values = &band.transmittance;
        if values.is_empty() {
            return 1.0;
        }
        let i = (row as usize).min(values.len() - 2);
        values[i] + (values[i + 1] - values[i]) * (row - i as f64)
    }
}
