//! Where the sun stands at an instant.

use solar_positioning::SolarPositions;
use solar_positioning::delta_t;
use solar_positioning::time::JulianDate;

use super::air::Air;
use super::error::{SunError, check};
use super::place::Place;
use super::utc::Utc;

/// The sun's middle as seen from a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// True angle from the zenith, without refraction, degrees, 0 to 180. For the light in the air.
    pub zenith_deg: f64,
    /// Angle from the zenith at which it appears, lifted by refraction, degrees, 0 to 180. For the drawn disc.
    pub apparent_zenith_deg: f64,
    /// Azimuth, degrees clockwise from north, 0 to 360, 360 excluded.
    pub azimuth_deg: f64,
    /// Distance from the Earth, astronomical units, 0.98 to 1.02.
    pub distance_au: f64,
}

impl SunPosition {
    /// The sun over a place in standard air ([`Air::standard`]).
    ///
    /// # Errors
    /// None is known: places and instants are in range.
    pub fn at(place: Place, utc: Utc) -> Result<Self, SunError> {
        Self::in_air(place, utc, Air::standard(place))
    }

    /// The sun over a place in given air.
    ///
    /// # Errors
    /// None is known, as in [`Self::at`].
    pub fn in_air(place: Place, utc: Utc, air: Air) -> Result<Self, SunError> {
        Self::with_delta_t(place, utc, air, delta_t_s(utc)?)
    }

    /// The sun over a place in given air, with delta T (terrestrial time less that of the Earth's rotation, -60 to
    /// 11,000 s) as it was observed.
    ///
    /// # Errors
    /// delta T out of range.
    pub fn with_delta_t(place: Place, utc: Utc, air: Air, delta_t_s: f64) -> Result<Self, SunError> {
        check("delta_t_s", delta_t_s, -60.0, 11_000.0)?;
        let time = JulianDate::new(utc.julian_date(), delta_t_s)?;
        let sun = SolarPositions::new().for_time_from_julian(time)?;
        let position = sun.at(place.location(), place.altitude_m(), None)?;
        let zenith_deg = position.zenith_angle();
        let lift = air.refraction_deg(90.0 - zenith_deg);
        let distance = sun.earth_radius_vector();
        Ok(Self {
            zenith_deg,
            // At the zenith SPA's formula is -3e-5 degrees instead of 0.
            apparent_zenith_deg: (zenith_deg - lift).clamp(0.0, 180.0),
            azimuth_deg: position.azimuth(),
            distance_au: distance.ok_or_else(|| SunError::Algorithm("no distance".to_owned()))?,
        })
    }

    /// Unit vector towards the true sun: east, north, up.
    #[must_use]
    pub fn towards(&self) -> [f64; 3] {
        direction(self.zenith_deg, self.azimuth_deg)
    }

    /// Unit vector towards where it appears: east, north, up.
    #[must_use]
    pub fn towards_apparent(&self) -> [f64; 3] {
        direction(self.apparent_zenith_deg, self.azimuth_deg)
    }

    /// Its irradiance above the air as a multiple of that at one astronomical unit: 0.967 in July to 1.034 in January.
    #[must_use]
    pub fn irradiance_factor(&self) -> f64 {
        self.distance_au.powi(-2)
    }
}

/// The crate's estimate of delta T, seconds.
pub(super) fn delta_t_s(utc: Utc) -> Result<f64, SunError> {
    Ok(delta_t::estimate(utc.year())?)
}

fn direction(zenith_deg: f64, azimuth_deg: f64) -> [f64; 3] {
    let (sin, cos) = zenith_deg.to_radians().sin_cos();
    let (east, north) = azimuth_deg.to_radians().sin_cos();
    [sin * east, sin * north, cos]
}
