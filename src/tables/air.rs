//! Tables of an atmosphere.

use super::aerosol::AerosolOptics;
use super::error::TableError;
use super::library::{Artefact, TableLibrary};
use crate::atmosphere::{Air, Boundary, Medium, Moments, Quality, Resolution, SlantColumns};
use crate::method::AirMethod;
use crate::scene::AirColumn;
use crate::scene::quantity::Quantity as _;
use crate::spectrum::Spectrum;
use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;
use std::sync::Arc;

/// The diffuse light of an atmosphere at the four wavelengths.
#[derive(Debug)]
pub struct AirTables {
    /// Names it exactly.
    pub key: String,
    /// What its light is made of.
    pub spectrum: Spectrum,
    /// One table a wavelength.
    pub waves: [Moments; 4],
}

/// What the tables of an atmosphere depend on.
#[derive(Debug, Clone)]
pub struct AirMix {
    /// What its light is made of.
    pub spectrum: Spectrum,
    /// The air.
    pub column: AirColumn,
    /// Its aerosol at the four wavelengths.
    pub aerosol: AerosolOptics,
    /// Albedo of the ground at the four wavelengths, in the mean over the domain.
    pub ground_albedo: [f64; 4],
    /// How finely it is solved.
    pub quality: Quality,
    /// How light that is scattered more than once is found.
    pub method: AirMethod,
}

impl AirMix {
    /// Air over a ground of a mean albedo in red, green and blue.
    pub fn new(
        spectrum: Spectrum,
        column: AirColumn,
        aerosol: AerosolOptics,
        ground_albedo: [f64; 3],
        tolerance: f64,
        method: AirMethod,
    ) -> Self {
        let quality = Quality::plan(column.aerosol.optical_depth.get(), tolerance);
        Self { spectrum, column, aerosol, ground_albedo: spectrum.albedo(ground_albedo), quality, method }
    }

    /// The air at a wavelength.
    pub(super) fn medium(&self, wave: usize) -> Medium {
        let aerosol = self.aerosol.waves[wave].clone();
        Medium::new(
            self.spectrum.wavelengths_nm()[wave],
            self.column.rayleigh.get(),
            self.column.ozone_du.get(),
            aerosol,
        )
    }

    /// The air of the four wavelengths above boundaries of one height.
    pub(super) fn airs(&self, boundaries: [Boundary; 4]) -> [Air; 4] {
        let columns = SlantColumns::new(self.column.aerosol.scale_height_m.get(), boundaries[0].height_m);
        let mut waves = 0..;
        boundaries.map(|boundary| Air::with(&columns, self.medium(waves.next().unwrap_or(0)), boundary))
    }

    fn over_ground(&self) -> [Air; 4] {
        self.airs(self.ground_albedo.map(Boundary::ground))
    }

    /// Of each wavelength the first whose air is the same over grounds or clouds that `seen` tells apart.
    pub(super) fn alike<T: PartialEq>(&self, seen: [T; 4]) -> [usize; 4] {
        let wavelengths = self.spectrum.wavelengths_nm();
        let same = |a: usize, b: usize| wavelengths[a].total_cmp(&wavelengths[b]).is_eq() && seen[a] == seen[b];
        std::array::from_fn(|wave| (0..wave).find(|&first| same(first, wave)).unwrap_or(wave))
    }

    /// Solves the air of the four wavelengths, one after the other: each takes all cores. Those that are alike are solved once.
    pub(super) fn solve(&self, airs: [Air; 4], alike: [usize; 4], progress: &(dyn Fn(f64) + Sync)) -> [Moments; 4] {
        let mut solved: Vec<Moments> = Vec::with_capacity(4);
        let mut waves = 0..;
        airs.map(|air| {
            let wave = waves.next().unwrap_or(0);
            let moments = match solved.get(alike[wave]) {
                Some(moments) => moments.clone(),
                None => {
                    let part = |part: f64| progress((wave as f64 + part) / 4.0);
                    Moments::by(self.method, air, self.quality, self.column.polarisation, &part)
                }
            };
            solved.push(moments.clone());
            moments
        })
    }

    /// Tables as they were kept, of this air above any boundaries; `None` where the parts are not such.
    pub(super) fn read_waves(&self, airs: [Air; 4], parts: &[&[u8]]) -> Option<[Moments; 4]> {
        let [a, b, c, d] = parts else { return None };
        let wave = |air: Air, part: &[u8]| {
            let (numbers, []) = part.as_chunks::<8>() else { return None };
            let numbers: Vec<f64> = numbers.iter().map(|number| f64::from_le_bytes(*number)).collect();
            Moments::from_numbers(air, self.quality, self.column.polarisation, &numbers)
        };
        let [one, two, three, four] = airs;
        Some([wave(one, a)?, wave(two, b)?, wave(three, c)?, wave(four, d)?])
    }
}

impl Artefact for AirMix {
    type Value = AirTables;

    fn key(&self) -> String {
        let air = [self.column.aerosol.scale_height_m.get(), self.column.ozone_du.get(), self.column.rayleigh.get()];
        let particles = self.aerosol.waves.iter().flat_map(|aerosol| [aerosol.depth, aerosol.albedo]);
        let particles: Vec<f64> = particles.collect();
        let mut hash = Sha256::new();
        hash.update(self.aerosol.key.as_bytes());
        hash.update([0]);
        for number in air.iter().chain(&particles).chain(&self.ground_albedo).chain(&self.spectrum.wavelengths_nm()) {
            hash.update(number.to_bits().to_le_bytes());
        }
        // Tables that other rules of resolution made are others.
        for wave in 0..4 {
            for number in Resolution::new(self.quality, &self.medium(wave)).numbers() {
                hash.update((number as u64).to_le_bytes());
            }
        }
        let name = name(hash);
        let light = if self.column.polarisation { "vector" } else { "scalar" };
        let quality = match self.quality {
            Quality::Fast => "fast",
            Quality::Normal => "normal",
            Quality::Fine => "fine",
        };
        // All orders are what is meant by air.
        let method = if self.method == AirMethod::Moments { String::new() } else { format!("-{}", self.method.name()) };
        format!("air-{name}-{light}-{quality}{method}")
    }

    fn describe(&self) -> String {
        let AirColumn { aerosol, ozone_du, .. } = &self.column;
        format!("air with aerosol of {} and {} DU of ozone", aerosol.optical_depth.get(), ozone_du.get())
    }

    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<AirTables, TableError> {
        Ok(AirTables {
            key: self.key(),
            spectrum: self.spectrum,
            waves: self.solve(self.over_ground(), self.alike(self.ground_albedo), progress),
        })
    }

    fn to_parts(&self, tables: &AirTables) -> Vec<Vec<u8>> {
        waves_to_parts(&tables.waves)
    }

    fn read_parts(&self, parts: &[&[u8]]) -> Option<AirTables> {
        let waves = self.read_waves(self.over_ground(), parts)?;
        Some(AirTables { key: self.key(), spectrum: self.spectrum, waves })
    }

    fn bytes(&self, tables: &AirTables) -> usize {
        memory(&tables.waves)
    }
}

/// Tables as they are kept.
pub(super) fn waves_to_parts(waves: &[Moments; 4]) -> Vec<Vec<u8>> {
    let bytes = |numbers: Vec<f64>| numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    waves.iter().map(|wave| bytes(wave.to_numbers())).collect()
}

/// Memory of tables, bytes: that of optical depth beside that of moments.
pub(super) fn memory(waves: &[Moments; 4]) -> usize {
    waves.iter().map(|wave| 8 * (wave.to_numbers().len() + DEPTH_NODES)).sum()
}

/// The first half of a hash, in letters that fit a file's name: written out, all digits of some numbers would not.
pub(super) fn name(hash: Sha256) -> String {
    hash.finalize().iter().take(16).fold(String::with_capacity(32), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Nodes of a table of optical depth.
const DEPTH_NODES: usize = 128 * 1024;

impl TableLibrary {
    /// The tables of an atmosphere. Waits while they are made: a second or two for air that was never used before.
    /// `progress` gets 0 to 1 if it is this call that makes them.
    ///
    /// # Errors
    /// When somebody else was making them and panicked.
    pub fn air(&self, mix: &AirMix, progress: &(dyn Fn(f64) + Sync)) -> Result<Arc<AirTables>, TableError> {
        self.artefact(mix, progress)
    }

    /// Whether the tables of an atmosphere are in memory.
    pub fn air_ready(&self, mix: &AirMix) -> bool {
        self.has::<AirTables>(&mix.key())
    }
}
