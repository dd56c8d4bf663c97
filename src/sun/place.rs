//! A place on Earth.

use super::error::{SunError, check};

/// A place on Earth, by WGS 84.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    latitude_deg: f64,
    longitude_deg: f64,
    altitude_m: f64,
}

impl Place {
    /// Latitudes, degrees north.
    pub const LATITUDE_DEG: (f64, f64) = (-90.0, 90.0);
    /// Longitudes, degrees east.
    pub const LONGITUDE_DEG: (f64, f64) = (-180.0, 180.0);
    /// Altitudes, metres above the sea: the standard troposphere, from below any shore.
    pub const ALTITUDE_M: (f64, f64) = (-500.0, 11_000.0);

    /// A place.
    ///
    /// # Errors
    /// A number outside [`Self::LATITUDE_DEG`], [`Self::LONGITUDE_DEG`] or [`Self::ALTITUDE_M`].
    pub fn new(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Result<Self, SunError> {
        let within = |name, value, (from, to): (f64, f64)| check(name, value, from, to);
        Ok(Self {
            latitude_deg: within("latitude_deg", latitude_deg, Self::LATITUDE_DEG)?,
            longitude_deg: within("longitude_deg", longitude_deg, Self::LONGITUDE_DEG)?,
            altitude_m: within("altitude_m", altitude_m, Self::ALTITUDE_M)?,
        })
    }

    /// Degrees north of the equator.
    #[must_use]
    pub fn latitude_deg(self) -> f64 {
        self.latitude_deg
    }

    /// Degrees east of Greenwich.
    #[must_use]
    pub fn longitude_deg(self) -> f64 {
        self.longitude_deg
    }

    /// Metres above the sea.
    #[must_use]
    pub fn altitude_m(self) -> f64 {
        self.altitude_m
    }

    pub(super) fn location(self) -> solar_positioning::Location {
        solar_positioning::Location { latitude: self.latitude_deg, longitude: self.longitude_deg }
    }
}
