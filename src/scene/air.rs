//! The light above the clouds: the caller's own, or that of physical air.

use super::aerosol::{self, AerosolColumn};
use super::quantity::*;
use super::read::{Object, Reader, describe};
use super::spelling;
use serde_json::{Value, json};

/// Where the light comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Atmosphere {
    /// From the caller.
    Given(Light),
    /// From the sun through air.
    Air(AirColumn),
}

/// Light that the caller gives, linear Rec.709.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Irradiance of the sun on a plane facing it, above the clouds.
    pub sun: [SunIrradiance; 3],
    /// Radiance of the sky, the same in all directions.
    pub sky: [SkyRadiance; 3],
}

/// A column of clear air.
#[derive(Debug, Clone, PartialEq)]
pub struct AirColumn {
    /// Particles.
    pub aerosol: AerosolColumn,
    /// Ozone.
    pub ozone_du: OzoneDu,
    /// Molecules, relative to the standard column at sea level.
    pub rayleigh: RayleighColumn,
    /// Whether the polarisation of light scattered by molecules is followed; without it blue light is up to 8 % off.
    pub polarisation: bool,
}

/// A kind of air by name: depth at 550 nm, Ångström's exponent, asymmetry, albedo, scale height in m, molecules.
pub(super) struct Preset {
    pub(super) name: &'static str,
    aerosol: [f64; 5],
    rayleigh: f64,
}

/// Depth, exponent, asymmetry and albedo of OPAC's mixtures at 550 nm and 80 % relative humidity (M. Hess, P. Koepke and I.
/// Schult, "Optical properties of aerosols and clouds", 1998): continental clean, average and polluted, maritime clean,
/// desert. Scale heights: particles of the ground within the lowest 1 to 2 km, dust to 3 km. The mountain stands at 3000 m, above 30 %
/// of the molecules and most of the particles.
pub(super) const PRESETS: [Preset; 6] = [
    Preset { name: "clear", aerosol: [0.064, 1.4, 0.709, 0.972, 1500.0], rayleigh: 1.0 },
    Preset { name: "continental", aerosol: [0.151, 1.4, 0.703, 0.925, 1500.0], rayleigh: 1.0 },
    Preset { name: "maritime", aerosol: [0.096, 0.1, 0.772, 0.997, 1000.0], rayleigh: 1.0 },
    Preset { name: "dust", aerosol: [0.286, 0.2, 0.729, 0.888, 3000.0], rayleigh: 1.0 },
    Preset { name: "haze", aerosol: [0.327, 1.4, 0.698, 0.892, 1500.0], rayleigh: 1.0 },
    Preset { name: "mountain", aerosol: [0.02, 1.4, 0.709, 0.972, 1500.0], rayleigh: 0.7 },
];

/// Fields of the caller's own light, and of air.
const GIVEN: [&str; 2] = ["sun", "sky"];
const AIR: [&str; 4] = ["aerosol", "ozone_du", "rayleigh", "polarisation"];

/// A default, which lies inside its range.
fn default<Q: Quantity>(value: f64) -> Option<Q> {
    Q::try_from(value).ok()
}

fn column(particles: [f64; 5], rayleigh: f64) -> Option<AirColumn> {
    let aerosol = aerosol::henyey_greenstein(particles)?;
    Some(AirColumn { aerosol, ozone_du: default(300.0)?, rayleigh: default(rayleigh)?, polarisation: true })
}

/// Reads the atmosphere of a scene. Without one it is a clear noon in klx and kcd/m², so that a scene of clouds alone looks
/// like a day.
pub(super) fn read(reader: &mut Reader, root: &Object<'_>) -> Option<Atmosphere> {
    const KEY: &str = "atmosphere";
    let noon = Light {
        sun: [default(98.0)?, default(94.0)?, default(87.0)?],
        sky: [default(2.6)?, default(3.8)?, default(6.2)?],
    };
    let Some(value) = root.value(KEY) else { return Some(Atmosphere::Given(noon)) };
    if let Value::String(name) = value {
        return named(reader, &root.at(KEY), name);
    }
    let all: Vec<&str> = GIVEN.into_iter().chain(AIR).collect();
    let object = reader.child(root, KEY, &all)?;
    let (own, air) = (GIVEN.iter().find(|key| object.has(key)), AIR.iter().find(|key| object.has(key)));
    if let (Some(own), Some(air)) = (own, air) {
        let detail = format!("stands beside \"{air}\"; either your own light (sun, sky) or physical air can be given");
        reader.wrong(object.at(own), detail);
        return None;
    }
    if own.is_some() {
        let sun = object.value("sun").map_or(Some(noon.sun), |value| reader.colour(value, &object.at("sun")));
        let sky = object.value("sky").map_or(Some(noon.sky), |value| reader.colour(value, &object.at("sky")));
        return Some(Atmosphere::Given(Light { sun: sun?, sky: sky? }));
    }
    let usual = column([0.1, 1.3, 0.7, 0.93, 1200.0], 1.0)?;
    Some(Atmosphere::Air(AirColumn {
        aerosol: aerosol::read(reader, &object, usual.aerosol)?,
        ozone_du: reader.number_or(&object, "ozone_du", usual.ozone_du),
        rayleigh: reader.number_or(&object, "rayleigh", usual.rayleigh),
        polarisation: match object.value("polarisation") {
            None => true,
            Some(Value::Bool(value)) => *value,
            Some(other) => {
                let detail = format!("{} where true or false is expected", describe(other));
                reader.wrong(object.at("polarisation"), detail);
                true
            }
        },
    }))
}

fn named(reader: &mut Reader, pointer: &str, name: &str) -> Option<Atmosphere> {
    if let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) {
        return column(preset.aerosol, preset.rayleigh).map(Atmosphere::Air);
    }
    let names = PRESETS.each_ref().map(|preset| preset.name);
    let meant = spelling::nearest(name, names).map_or_else(String::new, |near| format!("did you mean \"{near}\"? "));
    reader.wrong(pointer, format!("no air is named \"{name}\"; {meant}allowed: {}", names.join(", ")));
    None
}

/// The atmosphere with every default spelled out.
pub(super) fn write(atmosphere: &Atmosphere) -> Value {
    match atmosphere {
        Atmosphere::Given(light) => {
            json!({ "sun": light.sun.map(Quantity::get), "sky": light.sky.map(Quantity::get) })
        }
        Atmosphere::Air(air) => json!({
            "aerosol": aerosol::write(&air.aerosol),
            "ozone_du": air.ozone_du.get(),
            "rayleigh": air.rayleigh.get(),
            "polarisation": air.polarisation,
        }),
    }
}
