//! Stage `slice`: tables of a mix as the textures that passes read, and the closure of the orders for one sun.

use crate::gpu::layout::Remainder;
use crate::gpu::{Gpu, HostMap, Target};
use crate::method::SlabMethod;
use crate::optics::{Channel, Mix};
use crate::slab::appendix;
use crate::slab::closure::{Closure, LowOrders, Totals};
use crate::slab::fluxes::{DEPTH_COUNT, DEPTHS_PER_OCTAVE, FluxTable, MU_COUNT, root_mu};
use crate::slab::phases::{AUREOLE_COLUMNS, AUREOLE_ROWS, PEAK_DEG, PHASE_COLUMNS, PhaseTables, phase_angle};
use crate::slab::radiance::{Scaling, Side, Slice, TableSize, aureole};
use crate::slab::veil::{Scattered, Veil};
use crate::tables::{MixTables, Radiance};
use half::f16;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Quantities of the closure's table: factors of orders 1 and 2, flux of the higher ones; reflected, then transmitted.
pub const CLOSURE_ROWS: usize = 6;
/// Quantities of the veil's table: see [`Veil`].
pub const VEIL_ROWS: usize = 6;
/// Quantities of the phase functions' table.
pub const PHASE_ROWS: usize = 3;

/// Tables as textures, for one mix and one ratio of extinctions: every row holds each channel at its own optical depth,
/// which goes with that at 550 nm, so that one fetch serves three channels.
#[derive(Debug, Clone, PartialEq)]
pub struct HostTables {
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: HostMap,
    /// Reflected part of a beam.
    pub reflectance: HostMap,
    /// Light from a whole hemisphere: columns of optical depth; row 0 transmitted, row 1 not reflected.
    pub diffuse: HostMap,
    /// Columns of scattering angle, [`PHASE_ROWS`] rows per steradian: scattered once and twice by the medium without its
    /// forward peak; the whole phase function.
    pub phase: HostMap,
    /// Light that met the forward peak alone: columns of scattering angle, rows of optical path.
    pub aureole: HostMap,
    /// What tabulated light lacks near the sun: columns of scattering angle, rows of optical path.
    pub near_sun: HostMap,
    /// Extinctions relative to that at 550 nm.
    pub ratio: [f64; 3],
}

fn interleave(width: usize, height: usize, value: impl Fn(usize, usize, usize) -> f64 + Sync) -> HostMap {
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        [value(x, y, 0) as f32, value(x, y, 1) as f32, value(x, y, 2) as f32, 0.0]
    };
    let data = (0..width * height).into_par_iter().flat_map_iter(texel).collect();
    HostMap { width: width as u32, height: height as u32, channels: 4, data }
}

/// The table of phase functions.
fn phase(tables: &MixTables) -> HostMap {
    interleave(PHASE_COLUMNS, PHASE_ROWS, |x, y, c| match y {
        0 => tables.phases[c].once[x],
        1 => tables.phases[c].twice[x],
        _ => tables.channels[c].phase.value(phase_angle(x)) / (4.0 * PI),
    })
}

impl HostTables {
    /// The tables of a mix whose channels have the given extinctions.
    pub fn new(tables: &MixTables, extinction_per_m: [f64; 3]) -> Self {
        let ratio = extinction_per_m.map(|extinction| extinction / extinction_per_m[1]);
        let depths = FluxTable::optical_depths();
        let beam = |x: usize, y: usize, c: usize| tables.fluxes[c].beam(depths[y] * ratio[c], root_mu(x).powi(2));
        let even = |x: usize, c: usize| tables.fluxes[c].isotropic(depths[x] * ratio[c]);
        Self {
            transmittance: interleave(MU_COUNT, DEPTH_COUNT, |x, y, c| beam(x, y, c).transmittance),
            reflectance: interleave(MU_COUNT, DEPTH_COUNT, |x, y, c| beam(x, y, c).reflectance),
            diffuse: interleave(DEPTH_COUNT, 2, |x, y, c| match y {
                0 => even(x, c).transmittance,
                _ => even(x, c).one_minus_reflectance(),
            }),
            phase: phase(tables),
            aureole: interleave(AUREOLE_COLUMNS, AUREOLE_ROWS, |x, y, c| {
                tables.phases[c].aureole[y * AUREOLE_COLUMNS + x]
            }),
            near_sun: interleave(aureole::COLUMNS, aureole::ROWS, |x, y, c| {
                tables.aureoles[c].texels()[y * aureole::COLUMNS + x].into()
            }),
            ratio,
        }
    }
}

/// Radiance tables cut at one sun: a 3-D texture for each side, over optical depth at 550 nm, view zenith and azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct HostSlice {
    /// Nodes of the axes.
    pub size: TableSize,
    /// Reflected light, then transmitted: red, green, blue, 0.
    pub texels: [Vec<f16>; 2],
    /// What the texels are multiplied by.
    pub remainder: Remainder,
}

impl HostSlice {
    /// Cuts the tables of three channels whose extinctions have the given ratio to that at 550 nm.
    pub fn new(tables: &Radiance, ratio: [f64; 3], cosine_sun: f64) -> Self {
        let size = tables[1].size();
        let slices: [Slice; 3] = std::array::from_fn(|c| tables[c].slice(cosine_sun, ratio[c]));
        let interleaved = |side: Side| {
            let channels = slices.each_ref().map(|slice| slice.texels(side));
            let texel = |i: usize| [channels[0][i], channels[1][i], channels[2][i], 0.0].map(f16::from_f32);
            (0..channels[0].len()).flat_map(texel).collect()
        };
        let constant = |value: fn(&Scaling) -> f64| tables.each_ref().map(|table| value(table.scaling()) as f32);
        let remainder = Remainder {
            depth_scale: constant(|scaling| scaling.depth_scale),
            order1_albedo: constant(|scaling| scaling.order1_albedo),
            decay: constant(|scaling| scaling.decay),
            extrapolation: constant(|scaling| scaling.extrapolation),
            depths: size.depths() as f32,
            zeniths: size.zeniths as f32,
            azimuths: size.azimuths as f32,
            depths_per_octave: size.depths_per_octave as f32,
        };
        Self { size, texels: Side::BOTH.map(interleaved), remainder }
    }
}

/// What a method of slab light keeps for one droplet mix and one sun.
#[derive(Debug, Clone, PartialEq)]
pub enum HostSlab {
    /// A veil: see [`veil`].
    Forward(HostMap),
    /// The closure of the orders: see [`closure`].
    Analytic(HostMap),
    /// The radiance tables cut at the sun.
    Tabulated(HostSlice),
}

impl HostSlab {
    /// Makes it. `ratio`: extinctions relative to that at 550 nm; `cosine` of the sun's zenith. Radiance tables are made here
    /// if nobody made them before.
    pub fn new(method: SlabMethod, tables: &MixTables, ratio: [f64; 3], cosine: f64) -> Self {
        match method {
            SlabMethod::Forward => Self::Forward(veil(tables, ratio, cosine)),
            SlabMethod::Analytic => Self::Analytic(closure(tables, ratio, cosine)),
            SlabMethod::Tabulated(detail) => {
                Self::Tabulated(HostSlice::new(&tables.radiance(detail, &|_| ()), ratio, cosine))
            }
        }
    }
}

/// A slice on the device.
pub(crate) struct DeviceSlice {
    pub(crate) sides: [wgpu::TextureView; 2],
    pub(crate) remainder: wgpu::Buffer,
}

impl DeviceSlice {
    pub(crate) fn new(gpu: &Gpu, host: &HostSlice) -> Self {
        let size = [host.size.depths(), host.size.zeniths, host.size.azimuths].map(|count| count as u32);
        let side = |texels: &Vec<f16>| gpu.volume_from("slice", size, wgpu::TextureFormat::Rgba16Float, texels);
        Self { sides: host.texels.each_ref().map(side), remainder: gpu.uniform("remainder", &host.remainder) }
    }
}

/// Part of extinction that takes light out of the forward peak, and the single-scattering albedo of what remains.
pub(crate) fn without_peak(channel: &Channel, phases: &PhaseTables) -> (f64, f64) {
    let forward = channel.albedo * phases.forward_fraction;
    (1.0 - forward, (channel.albedo - forward) / (1.0 - forward))
}

/// What method "analytic" closes its orders against: the paper's own fit for the paper's own droplets, so that it stays the model
/// of 2006 there, exact fluxes for all others.
pub(crate) fn totals<'a>(mix: &Mix, channel: &Channel, fluxes: &'a FluxTable) -> Totals<'a> {
    match appendix::metres_per_depth(mix, channel.cross_section_um2) {
        Some(metres_per_depth) => Totals::Fitted { metres_per_depth },
        None => Totals::Exact(fluxes),
    }
}

/// The closure of the orders for one sun, as a texture: columns of optical depth at 550 nm, [`CLOSURE_ROWS`] rows.
pub fn closure(tables: &MixTables, ratio: [f64; 3], cosine_sun: f64) -> HostMap {
    let closures: Vec<Closure> = (0..3)
        .into_par_iter()
        .map(|c| {
            let (channel, phases) = (&tables.channels[c], &tables.phases[c]);
            let (smooth_part, albedo) = without_peak(channel, phases);
            LowOrders {
                totals: totals(&tables.mix, channel, &tables.fluxes[c]),
                albedo,
                forward_fraction: 1.0 - smooth_part,
                forward_edge: PEAK_DEG.to_radians(),
                order1_phase: &|angle| PhaseTables::value(&phases.once, angle),
                order2_phase: &|angle| PhaseTables::value(&phases.twice, angle),
            }
            .close(cosine_sun)
        })
        .collect();
    let columns = (DEPTH_COUNT - 1) as f64;
    interleave(DEPTH_COUNT, CLOSURE_ROWS, |x, y, c| {
        // The node of this channel's own depth, which is a fraction of a column away.
        let place = (x as f64 + ratio[c].log2() * DEPTHS_PER_OCTAVE as f64).clamp(0.0, columns);
        let low = (place as usize).min(DEPTH_COUNT - 2);
        let rows = if y < 3 { &closures[c].reflected } else { &closures[c].transmitted };
        let pick = |i: usize| match y % 3 {
            0 => rows[i].order1_scale,
            1 => rows[i].order2_scale,
            _ => rows[i].higher_flux,
        };
        pick(low) + (pick(low + 1) - pick(low)) * (place - low as f64)
    })
}

/// The veil under one sun, as a texture: columns of optical depth at 550 nm, [`VEIL_ROWS`] rows: factor of single scattering and even
/// light, reflected and then transmitted; part of the optical depth that counts; factor of transmitted light without the forward peak.
pub fn veil(tables: &MixTables, ratio: [f64; 3], cosine_sun: f64) -> HostMap {
    let of_channel = |c: usize| Scattered::new(&tables.channels[c], &tables.phases[c], cosine_sun);
    let scattered: Vec<Scattered> = (0..3).into_par_iter().map(of_channel).collect();
    let veil =
        |depth: &f64| -> [Veil; 3] { std::array::from_fn(|c| scattered[c].veil(&tables.fluxes[c], depth * ratio[c])) };
    let veils: Vec<[Veil; 3]> = FluxTable::optical_depths().par_iter().map(veil).collect();
    interleave(DEPTH_COUNT, VEIL_ROWS, |x, y, c| {
        let Veil { kept, single, smooth, even } = veils[x][c];
        [single[0], even[0], single[1], even[1], kept, smooth][y]
    })
}

/// Tables of a mix on the device.
pub(crate) struct DeviceTables {
    pub(crate) transmittance: Target,
    pub(crate) reflectance: Target,
    pub(crate) diffuse: Target,
    pub(crate) phase: Target,
    pub(crate) aureole: Target,
    pub(crate) near_sun: Target,
}

/// Brings a host table to the device.
pub(crate) fn upload(gpu: &Gpu, label: &str, map: &HostMap) -> Target {
    gpu.texture_from(label, [map.width, map.height], map.channels, &map.data)
}

impl DeviceTables {
    pub(crate) fn new(gpu: &Gpu, host: &HostTables) -> Self {
        Self {
            transmittance: upload(gpu, "transmittance", &host.transmittance),
            reflectance: upload(gpu, "reflectance", &host.reflectance),
            diffuse: upload(gpu, "diffuse", &host.diffuse),
            phase: upload(gpu, "phase", &host.phase),
            aureole: upload(gpu, "aureole", &host.aureole),
            near_sun: upload(gpu, "near_sun", &host.near_sun),
        }
    }
}
