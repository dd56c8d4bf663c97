//! Where a scene's sun stands: in a direction, or over a place at a time.

use super::model::{Sun, SunStand};
use super::quantity::*;
use super::read::{Object, Reader, describe};
use crate::sun::{Place, Utc};
use serde_json::{Value, json};

/// Across the sun's disc at the Earth's mean distance, degrees.
const SUN_DIAMETER_DEG: f64 = 0.533;
/// Fields of a direction, of a place, and of both.
const DIRECTION: [&str; 2] = ["zenith_deg", "azimuth_deg"];
const PLACE: [&str; 4] = ["latitude_deg", "longitude_deg", "altitude_m", "utc"];
const DIAMETER: &str = "angular_diameter_deg";

/// Reads the sun of a scene. `real`: it shines through air, and has a disc unless it is given another.
pub(super) fn read(reader: &mut Reader, root: &Object<'_>, real: bool) -> Option<Sun> {
    let diameter = AngularDiameterDeg::try_from(if real { SUN_DIAMETER_DEG } else { 0.0 }).ok()?;
    let (zenith_deg, azimuth_deg) = (ZenithDeg::try_from(50.0).ok()?, AzimuthDeg::try_from(180.0).ok()?);
    let stand = SunStand::Direction { zenith_deg, azimuth_deg };
    if !root.has("sun") {
        return Some(Sun { stand, angular_diameter_deg: diameter });
    }
    let all: Vec<&str> = DIRECTION.into_iter().chain(PLACE).chain([DIAMETER]).collect();
    let sun = reader.child(root, "sun", &all)?;
    let angular_diameter_deg = reader.number_or(&sun, DIAMETER, diameter);
    let (direction, place) = (DIRECTION.iter().find(|key| sun.has(key)), PLACE.iter().find(|key| sun.has(key)));
    let stand = match (direction, place) {
        (Some(direction), Some(place)) => {
            let detail = format!("stands beside \"{place}\"; either a direction or a place and a time can be given");
            reader.wrong(sun.at(direction), detail);
            return None;
        }
        (_, Some(_)) => over_place(reader, &sun)?,
        _ => SunStand::Direction {
            zenith_deg: reader.number_or(&sun, "zenith_deg", zenith_deg),
            azimuth_deg: reader.number_or(&sun, "azimuth_deg", azimuth_deg),
        },
    };
    Some(Sun { stand, angular_diameter_deg })
}

fn over_place(reader: &mut Reader, sun: &Object<'_>) -> Option<SunStand> {
    let latitude = reader.number::<LatitudeDeg>(sun, "latitude_deg");
    let longitude = reader.number::<LongitudeDeg>(sun, "longitude_deg");
    let altitude = reader.number_or(sun, "altitude_m", AltitudeM::try_from(0.0).ok()?);
    let start = match sun.value("utc") {
        Some(Value::String(text)) => {
            text.parse::<Utc>().map_err(|why| reader.wrong(sun.at("utc"), why.to_string())).ok()
        }
        Some(other) => {
            let detail = format!("{} where an instant is expected, such as \"2026-06-21T10:00:00Z\"", describe(other));
            reader.wrong(sun.at("utc"), detail);
            None
        }
        None => {
            reader.missing(sun, "utc", "an instant is needed, such as \"2026-06-21T10:00:00Z\"");
            None
        }
    };
    let place = Place::new(latitude?.get(), longitude?.get(), altitude.get());
    let place = place.map_err(|why| reader.wrong(&sun.pointer, why.to_string())).ok()?;
    Some(SunStand::Over { place, start: start? })
}

/// The sun with every default spelled out.
pub(super) fn write(sun: &Sun) -> Value {
    let mut text = match &sun.stand {
        SunStand::Direction { zenith_deg, azimuth_deg } => {
            json!({ "zenith_deg": zenith_deg.get(), "azimuth_deg": azimuth_deg.get() })
        }
        SunStand::Over { place, start } => json!({
            "latitude_deg": place.latitude_deg(),
            "longitude_deg": place.longitude_deg(),
            "altitude_m": place.altitude_m(),
            "utc": start.to_string(),
        }),
    };
    text[DIAMETER] = json!(sun.angular_diameter_deg.get());
    text
}
