//! What aerosol does to light at the wavelengths of the air.

use super::error::TableError;
use super::library::{Artefact, TableLibrary};
use crate::atmosphere::Aerosol;
use crate::atmosphere::wavelength::aerosol_depth;
use crate::optics::{self, Channel, Mix, Particles, PhaseTable};
use crate::scene::quantity::Quantity as _;
use crate::scene::{AerosolColumn, Scatterers};
use std::sync::Arc;

/// Wavelength at which optical depths of aerosol are given, nm.
const GIVEN_AT_NM: f64 = 550.0;
/// Memory of the optics of one wavelength, bytes: a grid of angles thrice, and moments.
const OPTICS_BYTES: usize = 64 << 10;

/// Aerosol at the wavelengths of the air.
#[derive(Debug, Clone)]
pub struct AerosolOptics {
    /// Names how it scatters exactly.
    pub key: String,
    /// At each wavelength.
    pub waves: [Aerosol; 4],
}

/// Optics of scatterers at one wavelength as an artefact.
enum Optics<'a> {
    Table(&'a PhaseTable),
    Spheres(Particles, f64),
}

impl Artefact for Optics<'_> {
    type Value = Channel;

    fn key(&self) -> String {
        match self {
            Self::Table(table) => format!("aerosol-{}", Mix::Tabulated { table: (*table).clone(), albedo: 1.0 }.key()),
            Self::Spheres(particles, nm) => format!("aerosol-{}-{:016x}", particles.key(), nm.to_bits()),
        }
    }

    fn describe(&self) -> String {
        match self {
            Self::Table(table) => format!("aerosol with a phase function of {} points", table.points().len()),
            Self::Spheres(particles, nm) => format!("{} at {nm} nm", particles.describe()),
        }
    }

    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<Channel, TableError> {
        let failed = |reason| TableError::Optics { mix: self.describe(), reason };
        match self {
            Self::Table(table) => Ok(optics::tabulated(table, 1.0)),
            Self::Spheres(particles, nm) => particles.optics(*nm, progress).map_err(failed),
        }
    }

    fn to_parts(&self, channel: &Channel) -> Vec<Vec<u8>> {
        vec![channel.to_f64s().iter().flat_map(|number| number.to_le_bytes()).collect()]
    }

    fn read_parts(&self, parts: &[&[u8]]) -> Option<Channel> {
        let [bytes] = parts else { return None };
        let (numbers, []) = bytes.as_chunks::<8>() else { return None };
        Channel::from_f64s(&numbers.iter().map(|number| f64::from_le_bytes(*number)).collect::<Vec<_>>())
    }

    fn bytes(&self, _: &Channel) -> usize {
        OPTICS_BYTES
    }
}

impl TableLibrary {
    /// Optics of a column of aerosol at wavelengths (nm). Waits while they are made: less than a second a wavelength for
    /// spheres of sizes that were never used before. `progress` gets 0 to 1.
    ///
    /// # Errors
    /// When the optics refuse the particles, or somebody else was making them and panicked.
    pub fn aerosol(
        &self,
        column: &AerosolColumn,
        wavelengths_nm: [f64; 4],
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<AerosolOptics, TableError> {
        let depth_550 = column.optical_depth.get();
        let scale_m = column.scale_height_m.get();
        match &column.scatterers {
            Scatterers::HenyeyGreenstein { asymmetry, angstrom, albedo } => {
                let wave = |nm| {
                    let depth = aerosol_depth(depth_550, angstrom.get(), nm);
                    Aerosol::henyey_greenstein(depth, scale_m, albedo.get(), asymmetry.get())
                };
                let key = format!("hg-{:016x}", asymmetry.get().to_bits());
                Ok(AerosolOptics { key, waves: wavelengths_nm.map(wave) })
            }
            Scatterers::Tabulated { table, angstrom, albedo } => {
                let optics = Optics::Table(table);
                let channel = self.artefact(&optics, progress)?;
                let wave = |nm| {
                    let depth = aerosol_depth(depth_550, angstrom.get(), nm);
                    Aerosol::with_optics(depth, scale_m, albedo.get(), &channel)
                };
                Ok(AerosolOptics { key: optics.key(), waves: wavelengths_nm.map(wave) })
            }
            Scatterers::Spheres {
                effective_radius_um,
                broadness,
                refractive_index: (real, imaginary),
                angstrom,
                albedo,
            } => {
                let particles = Particles {
                    effective_radius_um: effective_radius_um.get(),
                    broadness: broadness.get(),
                    refractive_index: [real.get(), imaginary.get()],
                };
                let at = |number: usize, nm: f64| {
                    let part = move |part: f64| progress((number as f64 + part) / 5.0);
                    self.artefact(&Optics::Spheres(particles, nm), &part)
                };
                let given = at(0, GIVEN_AT_NM)?;
                let [a, b, c, d] = wavelengths_nm;
                let channels = [at(1, a)?, at(2, b)?, at(3, c)?, at(4, d)?];
                let wave = |wave: usize| {
                    let channel: &Arc<Channel> = &channels[wave];
                    let depth = match angstrom {
                        Some(angstrom) => aerosol_depth(depth_550, angstrom.get(), wavelengths_nm[wave]),
                        None => depth_550 * channel.cross_section_um2 / given.cross_section_um2,
                    };
                    Aerosol::with_optics(depth, scale_m, albedo.map_or(channel.albedo, |albedo| albedo.get()), channel)
                };
                Ok(AerosolOptics { key: particles.key(), waves: [wave(0), wave(1), wave(2), wave(3)] })
            }
        }
    }
}
