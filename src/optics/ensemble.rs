//! Mean optics of a population of droplets in a narrow band of wavelengths.

use super::error::OpticsError;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::mie::{Coefficients, RefractiveIndex, summed_intensity};
use super::phase::{PhaseFunction, grid_deg};
use super::size::SizeDistribution;

/// Half width of the band of wavelengths around a channel's own, nm. Droplets of one cloud are not
/// sampled finely enough to lay to rest the narrow resonances of single spheres; a few wavelengths,
/// at which the resonances sit elsewhere, do it far more cheaply.
const BAND_HALF_WIDTH_NM: f64 = 5.0;
/// Spheres worked out together: a fixed number, as sums depend on it in their last bits.
const GROUP: usize = 36;
/// Units of progress per group.
const PROGRESS_SCALE: f64 = 1e-3;

/// How many spheres stand for a population.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Wavelengths over the band, >= 1.
    pub wavelengths: usize,
    /// Radii per wavelength, >= 1; no two wavelengths share a radius.
    pub radii: usize,
}

impl Default for Sampling {
    fn default() -> Self {
        Self { wavelengths: 9, radii: 1600 }
    }
}

/// Mean optics of the droplets at one channel.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// Mean extinction cross-section of a droplet, µm².
    pub cross_section_um2: f64,
    /// Single-scattering albedo, 0..1.
    pub albedo: f64,
    /// Mean cosine of the scattering angle from the series' coefficients (not from the angular
    /// grid).
    pub asymmetry: f64,
    /// (1/4pi) int P dOmega on the angular grid before P was normalised: 1 but for the
    /// interpolation.
    pub raw_norm: f64,
    /// Mean phase function.
    pub phase: PhaseFunction,
}

/// One sphere to be worked out.
struct Sphere {
    size: f64,
    wavenumber: f64,
    index: RefractiveIndex,
    radius_um: f64,
    area_weight: f64,
}

/// Sums over a group of spheres.
struct Sums {
    area: f64,
    extinction: f64,
    scattering: f64,
    asymmetry: f64,
    intensity: Vec<f64>,
}

/// Mean optics of spheres around one wavelength (nm). `index` is their refractive index by
/// wavelength (nm). The result does not depend on the number of threads, not even in its last bits.
///
/// # Errors
/// No finite result (parameters out of any sensible range).
pub fn ensemble(
    sizes: &SizeDistribution,
    wavelength_nm: f64,
    index: &dyn Fn(f64) -> RefractiveIndex,
    sampling: &Sampling,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Ensemble, OpticsError> {
    let spheres = spheres(sizes, wavelength_nm, index, sampling);
    let half = grid_deg().len().div_ceil(2);
    let cosines: Vec<f64> = grid_deg().iter().take(half).map(|a| a.to_radians().cos()).collect();

    let cost = |group: &[Sphere]| group.last().map_or(0.0, |sphere| sphere.size + 10.0);
    let total: f64 = spheres.chunks(GROUP).map(cost).sum();
    let done = AtomicU64::new(0);
    // From large to small: no thread is left with the dearest group at the end.
    let sums: Vec<Sums> = spheres
        .par_chunks(GROUP)
        .rev()
        .map(|group| {
            let sums = group_sums(group, &cosines);
            let part = (cost(group) / PROGRESS_SCALE) as u64;
            let reached = done.fetch_add(part, Ordering::Relaxed).saturating_add(part);
            progress((reached as f64 * PROGRESS_SCALE / total).min(1.0));
            sums
        })
        .collect();

    let mut intensity = vec![0.0; grid_deg().len()];
    let (mut area, mut extinction, mut scattering, mut asymmetry) = (0.0, 0.0, 0.0, 0.0);
    for group in &sums {
        area += group.area;
        extinction += group.extinction;
        scattering += group.scattering;
        asymmetry += group.asymmetry;
        for (sum, part) in intensity.iter_mut().zip(&group.intensity) {
            *sum += part;
        }
    }
    for value in &mut intensity {
        *value /= scattering;
    }
    let phase = PhaseFunction::from_grid_values(intensity.clone())?;
    let raw_norm = intensity[0] / phase.grid_values()[0];
    let cross_section_um2 = sizes.mean_area_um2() * extinction / area;
    if !(cross_section_um2.is_finite() && cross_section_um2 > 0.0) {
        return Err(OpticsError::NotFinite);
    }
    Ok(Ensemble {
        cross_section_um2,
        // Rounding may put scattering an ulp above extinction where nothing is absorbed.
        albedo: (scattering / extinction).clamp(0.0, 1.0),
        asymmetry: asymmetry / scattering,
        raw_norm,
        phase,
    })
}

/// Mean extinction cross-section of a droplet, µm², and asymmetry, without the phase function, which is what takes long. Spheres are
/// those of [`ensemble`].
#[must_use]
pub fn bulk(
    sizes: &SizeDistribution,
    wavelength_nm: f64,
    index: &dyn Fn(f64) -> RefractiveIndex,
    sampling: &Sampling,
) -> (f64, f64) {
    let (mut area, mut extinction, mut scattering, mut asymmetry) = (0.0, 0.0, 0.0, 0.0);
    for sphere in spheres(sizes, wavelength_nm, index, sampling) {
        let efficiencies = Coefficients::new(sphere.size, sphere.index).efficiencies();
        area += sphere.area_weight;
        extinction += sphere.area_weight * efficiencies.extinction;
        scattering += sphere.area_weight * efficiencies.scattering;
        asymmetry += sphere.area_weight * efficiencies.scattering * efficiencies.asymmetry;
    }
    (sizes.mean_area_um2() * extinction / area, asymmetry / scattering)
}

/// All spheres in order of radius. The radii of different wavelengths are staggered by the golden
/// ratio, so that all size parameters differ and the set samples size and wavelength evenly.
fn spheres(
    sizes: &SizeDistribution,
    wavelength_nm: f64,
    index: &dyn Fn(f64) -> RefractiveIndex,
    sampling: &Sampling,
) -> Vec<Sphere> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let sampler = sizes.sampler();
    let wavelengths = sampling.wavelengths.max(1);
    let radii = sampling.radii.max(1);
    let mut spheres = Vec::with_capacity(radii * wavelengths);
    for j in 0..radii {
        for i in 0..wavelengths {
            let across = (2.0 * i as f64 + 1.0) / wavelengths as f64 - 1.0;
            let wavelength_nm = wavelength_nm + BAND_HALF_WIDTH_NM * across;
            let stagger = (0.5 + i as f64 * GOLDEN).fract();
            let sample = sampler.sample((j as f64 + stagger) / radii as f64, radii * wavelengths);
            let wavenumber = 2.0 * PI / (wavelength_nm * 1e-3);
            spheres.push(Sphere {
                size: wavenumber * sample.radius_um,
                wavenumber,
                index: index(wavelength_nm),
                radius_um: sample.radius_um,
                area_weight: sample.area_weight,
            });
        }
    }
    spheres
}

/// Sums over one group of spheres.
fn group_sums(group: &[Sphere], cosines: &[f64]) -> Sums {
    let mut sums = Sums { area: 0.0, extinction: 0.0, scattering: 0.0, asymmetry: 0.0, intensity: Vec::new() };
    let mut weighted = Vec::with_capacity(group.len());
    for sphere in group {
        let coefficients = Coefficients::new(sphere.size, sphere.index);
        let efficiencies = coefficients.efficiencies();
        sums.area += sphere.area_weight;
        sums.extinction += sphere.area_weight * efficiencies.extinction;
        sums.scattering += sphere.area_weight * efficiencies.scattering;
        sums.asymmetry += sphere.area_weight * efficiencies.scattering * efficiencies.asymmetry;
        // P C_sca = 4 pi intensity / wavenumber²; the weight counts area, so per area of this
        // droplet.
        let per_area = 4.0 * PI / (sphere.wavenumber.powi(2) * PI * sphere.radius_um.powi(2));
        weighted.push((coefficients, sphere.area_weight * per_area));
    }
    sums.intensity = summed_intensity(&weighted, cosines);
    sums
}
