//! The air at a place, which bends the sun's light.

use super::error::{SunError, check};
use super::place::Place;

/// Pressure at the sea, hPa (ICAO standard atmosphere, 1993).
const SEA_PRESSURE_HPA: f64 = 1013.25;
/// Temperature at the sea there, K, and its fall with height, K/m.
const SEA_TEMPERATURE_K: f64 = 288.15;
const LAPSE_K_PER_M: f64 = 0.0065;
/// g M / (R lapse) there.
const PRESSURE_EXPONENT: f64 = 5.255_88;

/// Air at a place, for refraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    pressure_hpa: f64,
    temperature_c: f64,
}

impl Air {
    /// Air of a pressure, 1 to 1100 hPa, and a temperature, -90 to 60 degrees C.
    ///
    /// # Errors
    /// A number outside its range.
    pub fn new(pressure_hpa: f64, temperature_c: f64) -> Result<Self, SunError> {
        Ok(Self {
            pressure_hpa: check("pressure_hpa", pressure_hpa, 1.0, 1100.0)?,
            temperature_c: check("temperature_c", temperature_c, -90.0, 60.0)?,
        })
    }

    /// Air of 15 degrees C, of the pressure of the standard atmosphere at the place's altitude: 1013.25 hPa at the sea.
    #[must_use]
    pub fn standard(place: Place) -> Self {
        Self::at_altitude(place.altitude_m())
    }

    /// The same at an altitude, metres above the sea, which may be above the air.
    #[must_use]
    pub fn at_altitude(altitude_m: f64) -> Self {
        let ratio = (1.0 - LAPSE_K_PER_M / SEA_TEMPERATURE_K * altitude_m).max(0.0);
        Self { pressure_hpa: SEA_PRESSURE_HPA * ratio.powf(PRESSURE_EXPONENT), temperature_c: 15.0 }
    }

    /// Pressure, hPa.
    #[must_use]
    pub fn pressure_hpa(self) -> f64 {
        self.pressure_hpa
    }

    /// How much higher the sun appears than it is, degrees, for its true elevation in degrees.
    ///
    /// Down to 5/6 of a degree below the horizon, where the upper limb of the disc appears to touch it, the formula
    /// of SPA (step 3.14, after J. Meeus, 1998). SPA has no refraction below that, and a sun that jumps; here it
    /// falls off like the cotangent of the depression, as in NOAA's solar calculator, which keeps the apparent sun
    /// continuous and going the same way as the true one.
    #[must_use]
    pub fn refraction_deg(self, elevation_deg: f64) -> f64 {
        let density = self.pressure_hpa / 1010.0 * 283.0 / (273.0 + self.temperature_c);
        let formula =
            |elevation: f64| density * 1.02 / (60.0 * (elevation + 10.3 / (elevation + 5.11)).to_radians().tan());
        if elevation_deg >= LAST_ELEVATION_DEG {
            formula(elevation_deg)
        } else {
            let fall = LAST_ELEVATION_DEG.to_radians().tan() / elevation_deg.to_radians().tan();
            // Seen from beyond the Earth's centre there is none; the cotangent is 0 at the nadir but for rounding.
            (formula(LAST_ELEVATION_DEG) * fall).max(0.0)
        }
    }
}

/// Lowest elevation for which SPA's formula is meant: the sun's radius and the refraction at the horizon, degrees.
const LAST_ELEVATION_DEG: f64 = -0.833_37;
