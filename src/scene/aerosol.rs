//! A column of particles in the air.

use super::phase::phase_function;
use super::quantity::*;
use super::read::{Object, Reader, describe};
use crate::optics::PhaseTable;
use serde_json::{Value, json};

/// A column of particles.
#[derive(Debug, Clone, PartialEq)]
pub struct AerosolColumn {
    /// Vertical, at 550 nm.
    pub optical_depth: AerosolDepth,
    /// How they scatter.
    pub scatterers: Scatterers,
    /// Height over which they thin to 1/e.
    pub scale_height_m: AerosolScaleM,
}

/// How particles scatter, and how that goes with the wavelength.
#[derive(Debug, Clone, PartialEq)]
pub enum Scatterers {
    /// By Henyey and Greenstein's phase function.
    HenyeyGreenstein {
        /// Mean cosine of the scattering angle.
        asymmetry: AerosolAsymmetry,
        /// Exponent of wavelength.
        angstrom: Angstrom,
        /// Single-scattering albedo.
        albedo: Albedo,
    },
    /// By a phase function given as a table, the same at all wavelengths.
    Tabulated {
        /// The table.
        table: PhaseTable,
        /// Exponent of wavelength.
        angstrom: Angstrom,
        /// Single-scattering albedo.
        albedo: Albedo,
    },
    /// As spheres of a modified gamma distribution of sizes, by Mie theory.
    Spheres {
        /// Effective radius.
        effective_radius_um: ParticleRadiusUm,
        /// Broadness.
        broadness: Broadness,
        /// Real and imaginary part, at all wavelengths.
        refractive_index: (RefractiveIndex, ImaginaryIndex),
        /// Exponent of wavelength in place of what Mie theory says.
        angstrom: Option<Angstrom>,
        /// Single-scattering albedo in place of what Mie theory says.
        albedo: Option<Albedo>,
    },
}

const FIELDS: [&str; 9] = [
    "optical_depth",
    "angstrom",
    "asymmetry",
    "phase_function",
    "effective_radius_um",
    "broadness",
    "refractive_index",
    "albedo",
    "scale_height_m",
];
/// Fields that tell how particles scatter: of each of the three ways.
const WAYS: [&[&str]; 3] =
    [&["asymmetry"], &["phase_function"], &["effective_radius_um", "broadness", "refractive_index"]];

/// Depth at 550 nm, exponent of wavelength, asymmetry, albedo, scale height (m); `None` outside their ranges.
pub(super) fn henyey_greenstein([depth, angstrom, asymmetry, albedo, scale]: [f64; 5]) -> Option<AerosolColumn> {
    Some(AerosolColumn {
        optical_depth: AerosolDepth::try_from(depth).ok()?,
        scatterers: Scatterers::HenyeyGreenstein {
            asymmetry: AerosolAsymmetry::try_from(asymmetry).ok()?,
            angstrom: Angstrom::try_from(angstrom).ok()?,
            albedo: Albedo::try_from(albedo).ok()?,
        },
        scale_height_m: AerosolScaleM::try_from(scale).ok()?,
    })
}

/// Reads the aerosol of an air; `usual` has what it does not give.
pub(super) fn read(reader: &mut Reader, air: &Object<'_>, usual: AerosolColumn) -> Option<AerosolColumn> {
    if !air.has("aerosol") {
        return Some(usual);
    }
    let object = reader.child(air, "aerosol", &FIELDS)?;
    Some(AerosolColumn {
        optical_depth: reader.number_or(&object, "optical_depth", usual.optical_depth),
        scatterers: scatterers(reader, &object, usual.scatterers)?,
        scale_height_m: reader.number_or(&object, "scale_height_m", usual.scale_height_m),
    })
}

fn scatterers(reader: &mut Reader, object: &Object<'_>, usual: Scatterers) -> Option<Scatterers> {
    let given: Vec<(usize, &str)> = WAYS
        .iter()
        .enumerate()
        .filter_map(|(way, fields)| Some((way, *fields.iter().find(|field| object.has(field))?)))
        .collect();
    if let [(_, first), (_, second), ..] = given[..] {
        let detail = format!(
            "stands beside \"{second}\"; one of asymmetry, phase_function, and effective_radius_um (with broadness and \
             refractive_index) tells how particles scatter"
        );
        reader.wrong(object.at(first), detail);
        return None;
    }
    let Scatterers::HenyeyGreenstein { asymmetry, angstrom, albedo } = usual else { return Some(usual) };
    match given.first() {
        None | Some((0, _)) => Some(Scatterers::HenyeyGreenstein {
            asymmetry: reader.number_or(object, "asymmetry", asymmetry),
            angstrom: reader.number_or(object, "angstrom", angstrom),
            albedo: reader.number_or(object, "albedo", albedo),
        }),
        Some((1, field)) => Some(Scatterers::Tabulated {
            table: phase_function(reader, object.value(field)?, &object.at(field))?,
            angstrom: reader.number_or(object, "angstrom", angstrom),
            albedo: reader.number_or(object, "albedo", albedo),
        }),
        Some(_) => spheres(reader, object),
    }
}

fn spheres(reader: &mut Reader, object: &Object<'_>) -> Option<Scatterers> {
    let effective_radius_um = reader.number(object, "effective_radius_um");
    let broadness = reader.number_or(object, "broadness", Broadness::try_from(2.0).ok()?);
    let usual = (RefractiveIndex::try_from(1.45).ok()?, ImaginaryIndex::try_from(0.005).ok()?);
    let refractive_index = match object.value("refractive_index") {
        Some(value) => refractive_index(reader, value, &object.at("refractive_index")),
        None => Some(usual),
    };
    let angstrom = match object.has("angstrom") {
        true => Some(reader.number(object, "angstrom")?),
        false => None,
    };
    let albedo = match object.has("albedo") {
        true => Some(reader.number(object, "albedo")?),
        false => None,
    };
    Some(Scatterers::Spheres {
        effective_radius_um: effective_radius_um?,
        broadness,
        refractive_index: refractive_index?,
        angstrom,
        albedo,
    })
}

/// `[real, imaginary]`, or the real part alone of particles that do not absorb.
fn refractive_index(reader: &mut Reader, value: &Value, pointer: &str) -> Option<(RefractiveIndex, ImaginaryIndex)> {
    if value.is_number() {
        return Some((reader.quantity(value, pointer)?, ImaginaryIndex::try_from(0.0).ok()?));
    }
    let Some([real, imaginary]) = value.as_array().map(Vec::as_slice) else {
        let given = value.as_array().map_or_else(|| describe(value), |list| format!("a list of {}", list.len()));
        let expected = "[real, imaginary], or one number where nothing is absorbed, is expected";
        reader.wrong(pointer, format!("{given} where {expected}; {}", ranges()));
        return None;
    };
    let real = reader.quantity(real, &format!("{pointer}/0"));
    let imaginary = reader.quantity(imaginary, &format!("{pointer}/1"));
    Some((real?, imaginary?))
}

fn ranges() -> String {
    let (real, imaginary) = (RefractiveIndex::RANGE, ImaginaryIndex::RANGE);
    format!("real {} to {}, imaginary {} to {}", real.start(), real.end(), imaginary.start(), imaginary.end())
}

/// The aerosol with every default spelled out.
pub(super) fn write(aerosol: &AerosolColumn) -> Value {
    let mut text = json!({
        "optical_depth": aerosol.optical_depth.get(),
        "scale_height_m": aerosol.scale_height_m.get(),
    });
    let mut put = |name: &str, value: Value| text[name] = value;
    match &aerosol.scatterers {
        Scatterers::HenyeyGreenstein { asymmetry, angstrom, albedo } => {
            put("asymmetry", json!(asymmetry.get()));
            put("angstrom", json!(angstrom.get()));
            put("albedo", json!(albedo.get()));
        }
        Scatterers::Tabulated { table, angstrom, albedo } => {
            put("phase_function", table.points().iter().map(|(angle, value)| json!([angle, value])).collect());
            put("angstrom", json!(angstrom.get()));
            put("albedo", json!(albedo.get()));
        }
        Scatterers::Spheres {
            effective_radius_um,
            broadness,
            refractive_index: (real, imaginary),
            angstrom,
            albedo,
        } => {
            put("effective_radius_um", json!(effective_radius_um.get()));
            put("broadness", json!(broadness.get()));
            put("refractive_index", json!([real.get(), imaginary.get()]));
            // Absent means "by Mie theory": there is no number to spell out.
            if let Some(angstrom) = angstrom {
                put("angstrom", json!(angstrom.get()));
            }
            if let Some(albedo) = albedo {
                put("albedo", json!(albedo.get()));
            }
        }
    }
    text
}
