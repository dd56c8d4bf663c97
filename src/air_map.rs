//! Air between an eye and what it sees, as maps that a device samples: what it adds to light, and what it leaves of it.
//!
//! A map has a band of rows, from the horizon to straight up or down (their distance from the horizon grows as the square),
//! and columns from the sun's azimuth to the opposite one. Three such bands lie one below the other: light of the air but for what
//! aerosol scattered once, the factor of the aerosol's phase function, and transmittance; red, green and blue.

use crate::atmosphere::{Band, End, Layout, SunSky};
use crate::gpu::HostMap;
use crate::scene_air::{CoverMoment, SceneAir, UnderCover, sky};
use crate::spectrum::rec709;

use rayon::prelude::*;

/// Azimuths of a map, and steps along a ray: [`SunSky`] tells what they err.
const COLUMNS: usize = 32;
const STEPS: usize = 32;
/// Rows above the horizon and below it, where less changes.
const ROWS: [usize; 2] = [64, 32];

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
    /// Elevation of the horizon, radians, 0 or below.
    pub(crate) horizon: f64,
}

impl AirMap {
    /// Without air: the same light from everywhere, nothing taken away. `horizon` in radians.
    pub(crate) fn vacuum(light: [f64; 3], horizon: f64) -> Self {
        let band = |[r, g, b]: [f64; 3]| [r as f32, g as f32, b as f32, 0.0].repeat(4);
        let data = [band(light), band([0.0; 3]), band([1.0; 3])].concat();
        Self { map: HostMap { width: 2, height: 6, channels: 4, data }, horizon }
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
        let colour = |value: &dyn Fn(&Band) -> f64| rec709([0, 1, 2, 3].map(|wave| value(band(wave))));
        // Of light as white as the sun's.
        let white = rec709([1.0; 4]);
        let rows = above + below;
        let mut data = Vec::with_capacity(4 * 3 * rows * COLUMNS);
        let texels = rows * COLUMNS;
        let mut add = |[r, g, b]: [f64; 3]| data.extend([r as f32, g as f32, b as f32, 0.0]);
        (0..texels).for_each(|i| add(colour(&|band| nearness * band.sky[i])));
        (0..texels).for_each(|i| add(colour(&|band| nearness * band.aureole[i])));
        for i in 0..texels {
            let through = colour(&|band| band.transmittance[i / COLUMNS]);
            add(std::array::from_fn(|c| (through[c] / white[c]).clamp(0.0, 1.0)));
        }
        let map = HostMap { width: COLUMNS as u32, height: 3 * rows as u32, channels: 4, data };
        Self { map, horizon: waves[0].horizon_deg.to_radians() }
    }
}
