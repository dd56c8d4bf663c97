//! Air between an eye and what it sees, as maps that a device samples: what it adds to light, and what it leaves of it.
//!
//! A map has a band of rows, from the horizon to straight up or down (their distance from the horizon grows as the square),
//! and columns from the sun's azimuth to the opposite one. Three such bands lie one below the other: light of the air but for what
//! aerosol scattered once (red, green, blue), the factors of the aerosol's phase function (of the four wavelengths), and
//! transmittance (red, green, blue). Beside the map are the phase function and the matrix that makes colours of the four wavelengths.

use crate::atmosphere::{Band, End, Layout, SunSky};
use crate::gpu::HostMap;
use crate::gpu::layout::{AEROSOL_ROWS, AirColours};
use crate::scene_air::{CoverMoment, SceneAir, UnderCover, sky};
use crate::spectrum::Spectrum;

use rayon::prelude::*;
use std::f64::consts::PI;

/// Azimuths of a map, and steps along a ray: [`SunSky`] tells what they err.
const COLUMNS: usize = 32;
const STEPS: usize = 32;
/// Rows above the horizon and below it, where less changes.
const ROWS: [usize; 2] = [64, 32];

/// Less than this is no light.
const DARK: f64 = 1e-30;

/// Which side of the horizon a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Half {
    Above,
    Below,
}

/// A map, and where its horizon lies.
#[derive(Debug, Clone)]
pub(crate) struct AirMap {
    pub(crate) map: HostMap,
    pub(crate) colours: AirColours,
    /// Elevation of the horizon, radians, 0 or below.
    pub(crate) horizon: f64,
}

impl AirMap {
    /// Without air: the same light from everywhere, nothing taken away. `horizon` in radians.
    pub(crate) fn vacuum(light: [f64; 3], horizon: f64) -> Self {
        let texel = |[r, g, b]: [f64; 3]| [r, g, b, 0.0];
        let bands = [light, [0.0; 3], [1.0; 3]].map(|value| vec![texel(value); 4]);
        Self { map: map(2, bands), colours: colours(|_| [0.0; 4], Spectrum::Visible), horizon }
    }

    /// Air from an eye at a height to where the rays of one side of the horizon end, in kcd/m². `cover` is the light of the
    /// clouds in it at the moment. Of the sun the cosine of its zenith, and its irradiance relative to that at its mean distance.
    pub(crate) fn new(
        air: &SceneAir,
        cover: Option<&CoverMoment>,
        eye_m: f64,
        [sun_cosine, nearness]: [f64; 2],
        half: Half,
        end: End,
    ) -> Self {
        let [above, below] = match half {
            Half::Above => [ROWS[0], 0],
            Half::Below => [0, ROWS[1]],
        };
        let layout = Layout { above, below, columns: COLUMNS, steps: STEPS };
        let one = |wave: usize| {
            let covered = air.covered.as_ref().zip(cover);
            let under = covered.map(|(tables, cover)| UnderCover::new(air, tables, cover, wave));
            SunSky::new(sky(air, under.as_ref(), wave), eye_m, sun_cosine, layout, end)
        };
        let waves: Vec<SunSky> = (0..4).into_par_iter().map(one).collect();
        let band = |wave: usize| match half {
            Half::Above => &waves[wave].above,
            Half::Below => &waves[wave].below,
        };
        let four = |value: &dyn Fn(&Band) -> f64| [0, 1, 2, 3].map(|wave| value(band(wave)));
        let texel = |[r, g, b]: [f64; 3]| [r, g, b, 0.0];
        // Of light as white as the sun's.
        let spectrum = air.clear.spectrum;
        let white = spectrum.colour([1.0; 4]);
        let through = |i: usize| {
            let through = spectrum.colour(four(&|band| band.transmittance[i / COLUMNS]));
            std::array::from_fn(|c| (through[c] / white[c]).clamp(0.0, 1.0))
        };
        let texels = 0..(above + below) * COLUMNS;
        let bands = [
            texels.clone().map(|i| texel(spectrum.colour(four(&|band| nearness * band.sky[i])))).collect(),
            texels.clone().map(|i| four(&|band| nearness * band.aureole[i])).collect(),
            texels.map(|i| texel(through(i))).collect(),
        ];
        let phase = |row: usize| {
            let angle = PI * (row as f64 / (AEROSOL_ROWS - 1) as f64).powi(2);
            std::array::from_fn(|wave| (waves[wave].phase(angle.cos()) / (4.0 * PI)).max(DARK).ln())
        };
        let colours = colours(phase, spectrum);
        Self { map: map(COLUMNS, bands), colours, horizon: waves[0].horizon_deg.to_radians() }
    }
}

fn single(row: [f64; 4]) -> [f32; 4] {
    row.map(|value| value as f32)
}

fn colours(phase: impl Fn(usize) -> [f64; 4] + Sync, spectrum: Spectrum) -> AirColours {
    let mut colours = AirColours { matrix: spectrum.matrix().map(single), ..AirColours::default() };
    colours.phase.par_iter_mut().enumerate().for_each(|(row, value)| *value = single(phase(row)));
    colours
}

/// Lays out a map.
fn map(columns: usize, bands: [Vec<[f64; 4]>; 3]) -> HostMap {
    let height = (bands.iter().map(Vec::len).sum::<usize>() / columns) as u32;
    let data = bands.into_iter().flatten().flat_map(single).collect();
    HostMap { width: columns as u32, height, channels: 4, data }
}
