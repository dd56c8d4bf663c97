//! Media of the charts, and each method's radiance of a slab of them in double precision.

use std::f64::consts::PI;

use super::file::ChartError;
use super::veil::MediumVeil;
use crate::optics::{Channel, Mix, PhaseFunction};
use crate::slab::analytic::{order1_reflected, order1_transmitted, order2_reflected, order2_transmitted};
use crate::slab::appendix::DROPLETS_PER_M3;
use crate::slab::closure::{Closure, LowOrders, OrderFluxes, Totals};
use crate::slab::fluxes::{DEPTHS_PER_OCTAVE, FIRST_LOG2_DEPTH, FluxTable};
use crate::slab::phases::{
    self, AUREOLE_COLUMNS, AUREOLE_HALF_SIN_MAX, AUREOLE_LOG2_MIN, AUREOLE_ROWS, AUREOLE_ROWS_PER_OCTAVE, PEAK_DEG,
    PhaseTables,
};
use crate::slab::radiance::{Aureole, Completion, RadianceTable, Scaling, Side, Slice, TableSize};
use crate::slab::veil::Scattered;
use crate::slice::{totals, without_peak};
use crate::tables::TableLibrary;

/// Red, green, blue.
const WAVELENGTHS: [&str; 3] = ["650 nm", "550 nm", "450 nm"];

/// One colour channel of a droplet mix.
#[derive(Clone, Debug)]
pub(super) struct Medium {
    pub(super) name: String,
    mix: Mix,
    pub(super) channel: Channel,
    pub(super) fluxes: FluxTable,
    pub(super) phases: PhaseTables,
    aureole: Aureole,
}

/// Droplets of an effective radius (micrometres) with the paper's broadness.
pub(super) fn droplets(effective_radius_um: f64) -> Mix {
    Mix::Gamma { effective_radius_um, broadness: 2.0, refractive_index: None }
}

/// Henyey-Greenstein scatterers without absorption.
pub(super) const SMOOTH: Mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };

impl Medium {
    /// Channel `colour` (0 red, 1 green, 2 blue) of a mix.
    pub(super) fn new(library: &TableLibrary, mix: &Mix, colour: usize) -> Result<Self, ChartError> {
        let tables = library.get(mix, None, &|_| ())?;
        let name = match mix {
            Mix::Gamma { effective_radius_um, .. } => format!("{effective_radius_um} um {}", WAVELENGTHS[colour]),
            Mix::HenyeyGreenstein { asymmetry, .. } => format!("Henyey-Greenstein {asymmetry}"),
            Mix::Tabulated { .. } => "tabulated".to_owned(),
        };
        let channel = tables.channels[colour].clone();
        let aureole = Aureole::build(channel.albedo, &channel.moments);
        Ok(Self {
            name,
            mix: mix.clone(),
            fluxes: tables.fluxes[colour].clone(),
            phases: tables.phases[colour].clone(),
            aureole,
            channel,
        })
    }

    /// Extinction of the paper's 300 droplets per cubic centimetre, 1/m.
    pub(super) fn extinction_per_m(&self) -> f64 {
        DROPLETS_PER_M3 * self.channel.cross_section_um2 * 1e-12
    }

    /// Part of the extinction that takes light out of the forward peak, and the albedo of what remains.
    pub(super) fn without_peak(&self) -> (f64, f64) {
        without_peak(&self.channel, &self.phases)
    }

    /// Phase function of what is scattered outside the forward peak.
    pub(super) fn phase_without_peak(&self) -> Result<PhaseFunction, ChartError> {
        let cut = phases::cut(&self.channel.phase);
        cut.map(|cut| cut.rest).ok_or_else(|| ChartError::Drawing(format!("{} has no forward peak", self.name)))
    }

    /// The low orders of method "analytic", closed against `totals`.
    fn with_low_orders<T>(&self, totals: Totals<'_>, use_them: impl FnOnce(&LowOrders<'_>) -> T) -> T {
        let (smooth_part, albedo) = self.without_peak();
        use_them(&LowOrders {
            totals,
            albedo,
            forward_fraction: 1.0 - smooth_part,
            forward_edge: PEAK_DEG.to_radians(),
            order1_phase: &|angle| PhaseTables::value(&self.phases.once, angle),
            order2_phase: &|angle| PhaseTables::value(&self.phases.twice, angle),
        })
    }

    /// Fluxes of orders 1 and 2 of method "analytic" before they are closed.
    pub(super) fn low_orders(&self, depth: f64, mu_sun: f64) -> OrderFluxes {
        self.low_orders_at(&[depth], mu_sun).first().copied().unwrap_or_default()
    }

    /// The same at many depths.
    pub(super) fn low_orders_at(&self, depths: &[f64], mu_sun: f64) -> Vec<OrderFluxes> {
        self.with_low_orders(Totals::Exact(&self.fluxes), |orders| orders.fluxes(depths, mu_sun))
    }

    /// Method "analytic" for one sun: of the paper's droplets with the paper's fluxes.
    pub(super) fn analytic(&self, mu_sun: f64) -> Analytic<'_> {
        self.closed(mu_sun, totals(&self.mix, &self.channel, &self.fluxes))
    }

    /// Method "analytic" for one sun with exact fluxes for every medium.
    pub(super) fn analytic_exact(&self, mu_sun: f64) -> Analytic<'_> {
        self.closed(mu_sun, Totals::Exact(&self.fluxes))
    }

    fn closed(&self, mu_sun: f64, totals: Totals<'_>) -> Analytic<'_> {
        Analytic { medium: self, mu_sun, closure: self.with_low_orders(totals, |orders| orders.close(mu_sun)) }
    }

    /// Method "forward" for one sun.
    pub(super) fn veil(&self, mu_sun: f64) -> MediumVeil<'_> {
        MediumVeil { medium: self, scattered: Scattered::new(&self.channel, &self.phases, mu_sun), mu_sun }
    }

    /// Tables of method "tabulated".
    pub(super) fn table(&self, size: TableSize) -> RadianceTable {
        RadianceTable::build(self.channel.albedo, &self.channel.moments, size, &|_| ())
    }

    /// Method "tabulated" for one sun.
    pub(super) fn tabulated(&self, table: &RadianceTable, mu_sun: f64) -> Tabulated<'_> {
        Tabulated { medium: self, mu_sun, slice: table.slice(mu_sun, 1.0), scaling: *table.scaling() }
    }
}

/// A method that gives the diffuse radiance of a slab under one sun, 1/sr per unit irradiance on a plane facing the sun.
pub(super) trait Radiance: Sync {
    /// At a true optical depth, a cosine of the view's zenith and an azimuth of travel relative to the sunlight's (radians).
    fn radiance(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64;
}

/// Method "analytic", see [`Medium::analytic`].
pub(super) struct Analytic<'a> {
    medium: &'a Medium,
    mu_sun: f64,
    closure: Closure,
}

/// Factors of orders 1 and 2, and radiance of the higher ones.
pub(super) type Factors = [f64; 3];

impl Analytic<'_> {
    /// What the closure gives at a true optical depth.
    pub(super) fn factors(&self, side: Side, depth: f64) -> Factors {
        let completions = if side == Side::Reflected { &self.closure.reflected } else { &self.closure.transmitted };
        let place = (depth.log2() - f64::from(FIRST_LOG2_DEPTH)) * DEPTHS_PER_OCTAVE as f64;
        let place = place.clamp(0.0, (completions.len() - 1) as f64);
        let low = (place as usize).min(completions.len() - 2);
        let [a, b] = [low, low + 1].map(|node| {
            let completion = &completions[node];
            [completion.order1_scale, completion.order2_scale, completion.higher_flux * self.mu_sun / PI]
        });
        std::array::from_fn(|i| a[i] + (b[i] - a[i]) * (place - low as f64))
    }

    /// The radiance with other factors than the closure's.
    pub(super) fn assembled(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64, factors: Factors) -> f64 {
        let angle = side.scattering_cosine(self.mu_sun, mu_view, azimuth).acos();
        let forward = if side == Side::Transmitted { self.forward_light(angle, depth / mu_view) } else { 0.0 };
        self.scattered(side, depth, mu_view, azimuth, factors) + forward
    }

    /// The same without light that met the forward peak alone.
    pub(super) fn scattered(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64, factors: Factors) -> f64 {
        let medium = self.medium;
        let (smooth_part, albedo) = medium.without_peak();
        let angle = side.scattering_cosine(self.mu_sun, mu_view, azimuth).acos();
        let smooth_depth = smooth_part * depth;
        let (order1, order2) = match side {
            Side::Reflected => (
                order1_reflected(smooth_depth, self.mu_sun, mu_view),
                order2_reflected(smooth_depth, self.mu_sun, mu_view),
            ),
            Side::Transmitted => (
                order1_transmitted(smooth_depth, self.mu_sun, mu_view),
                order2_transmitted(smooth_depth, self.mu_sun, mu_view),
            ),
        };
        let once = albedo * PhaseTables::value(&medium.phases.once, angle) * order1;
        let twice = albedo * albedo * PhaseTables::value(&medium.phases.twice, angle) * order2;
        factors[0] * once + factors[1] * twice + factors[2]
    }

    /// Light that met the forward peak alone, over a path of true optical depth.
    fn forward_light(&self, angle: f64, path: f64) -> f64 {
        let half_sin = (0.5 * angle).sin();
        if half_sin >= AUREOLE_HALF_SIN_MAX {
            return 0.0;
        }
        let cell = |place: f64, count: usize| {
            let place = place.clamp(0.0, (count - 1) as f64);
            let low = (place as usize).min(count - 2);
            [(low, 1.0 - (place - low as f64)), (low + 1, place - low as f64)]
        };
        let columns = cell((half_sin / AUREOLE_HALF_SIN_MAX).sqrt() * (AUREOLE_COLUMNS - 1) as f64, AUREOLE_COLUMNS);
        let rows = cell((path.log2() - AUREOLE_LOG2_MIN) * AUREOLE_ROWS_PER_OCTAVE, AUREOLE_ROWS);
        let mut shape = 0.0;
        for (row, row_weight) in rows {
            for (column, weight) in columns {
                shape += row_weight * weight * self.medium.phases.aureole[row * AUREOLE_COLUMNS + column];
            }
        }
        shape * path * (-self.medium.without_peak().0 * path).exp()
    }
}

impl Radiance for Analytic<'_> {
    fn radiance(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64 {
        self.assembled(side, depth, mu_view, azimuth, self.factors(side, depth))
    }
}

/// Method "tabulated", see [`Medium::tabulated`].
pub(super) struct Tabulated<'a> {
    medium: &'a Medium,
    mu_sun: f64,
    slice: Slice,
    scaling: Scaling,
}

impl Radiance for Tabulated<'_> {
    fn radiance(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64 {
        let medium = self.medium;
        let phase = |angle: f64| medium.channel.phase.value(angle);
        let completion = Completion { scaling: &self.scaling, aureole: &medium.aureole, phase: &phase };
        let remainder = self.slice.remainder(side, depth, mu_view, azimuth);
        completion.radiance(side, remainder, depth, self.mu_sun, mu_view, azimuth)
    }
}
