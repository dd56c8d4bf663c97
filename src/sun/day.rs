//! When the sun rises, culminates and sets.

use solar_positioning::{Horizon, SolarEvents};

use super::error::SunError;
use super::place::Place;
use super::position::delta_t_s;
use super::utc::Utc;

/// A day of a place: 24 hours from midnight by its local mean time, which is UTC and four minutes a degree of longitude
/// to the east, so that noon is in the middle of it wherever it is.
///
/// The sun counts as up while its middle is above -50 minutes of arc at the sea: it is lifted by 34 at the horizon
/// and its radius is 16 (the convention of almanacs). Altitude is left out. Times are good to some seconds by that
/// convention; observed ones differ by minutes as the air does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolarDay {
    /// Midnight before.
    pub start: Utc,
    /// First sunrise; none if the sun does not rise in these 24 hours.
    pub sunrise: Option<Utc>,
    /// The sun in the meridian, above the horizon or below.
    pub noon: Utc,
    /// Last sunset; none if the sun does not set in these 24 hours.
    pub sunset: Option<Utc>,
    /// Whether the sun is up at noon. With neither sunrise nor sunset: whether it is up the whole day or not at all.
    pub up_at_noon: bool,
}

impl SolarDay {
    /// The day of a place that an instant belongs to.
    ///
    /// # Errors
    /// None is known: places and instants are in range.
    pub fn of(place: Place, utc: Utc) -> Result<Self, SunError> {
        let delta_t_s = delta_t_s(utc)?;
        // Julian days begin at noon.
        let ahead = place.longitude_deg() / 360.0 + 0.5;
        let start = (utc.julian_date() + ahead).floor() - ahead;
        let horizon = Horizon::SunriseSunset;
        let found =
            SolarEvents::new().for_interval_from_julian(start, start + 1.0, place.location(), delta_t_s, horizon)?;
        let instant = |julian: Option<&f64>| julian.map(|&julian| Utc::of_julian(julian)).transpose();
        // The sun runs ahead of the mean time or behind it by 17 minutes at most.
        let noon = found.transits.first().ok_or_else(|| SunError::Algorithm("a day without noon".to_owned()))?;
        let before = |times: &[f64]| times.iter().filter(|&time| time <= noon).count();
        // Up at the start, and changed as often as it rose or set since.
        let changes = before(&found.rises) + before(&found.sets);
        let up_at_start = found.state_at_start == solar_positioning::HorizonState::Above;
        Ok(Self {
            start: Utc::of_julian(start)?,
            sunrise: instant(found.rises.first())?,
            noon: Utc::of_julian(*noon)?,
            sunset: instant(found.sets.last())?,
            up_at_noon: up_at_start == (changes % 2 == 0),
        })
    }
}
