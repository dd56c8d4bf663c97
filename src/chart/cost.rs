//! Time of the cloud pass with each method, all in one run.

use serde_json::json;

use super::device::{self, Device};
use super::file::ChartError;
use super::row::SlabRow;
use crate::job::Watch;
use crate::tables::TableLibrary;

/// Texels a side.
const SIDE: u32 = 512;
/// Times that every method is run, in turn.
const ROUNDS: usize = 31;

/// Milliseconds per million texels: median, and the quartiles below and above it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    pub(super) median: f64,
    pub(super) quartiles: [f64; 2],
}

/// Cost of stage "shade" of a cloud seen from below; `None` where it is not measured. The methods
/// take turns, so that all of them see the same load of the machine.
pub(super) fn costs(
    library: &TableLibrary,
    methods: &[SlabRow],
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Option<Cost>>, ChartError> {
    // Cloud everywhere, of every thickness: no texel is skipped.
    let scene = json!({
        "domain": { "extent_m": 20_000, "resolution": SIDE },
        "sun": { "zenith_deg": 60, "azimuth_deg": 160 },
        "layers": [{ "base_m": 1000,
            "thickness": { "kind": "stratocumulus", "pattern": "closed", "coverage": 1, "seed": 7 },
            "droplets": { "effective_radius_um": 7, "broadness": 2, "number_per_cm3": 300 } }],
    });
    let scene = device::scene(&scene)?;
    let mut device = Device::open(library)?;
    let job = |method: &SlabRow| {
        let query = method.query();
        let given = query.as_ref().map(|query| query.each_ref().map(|(name, value)| (*name, value.as_str())));
        given.map(|query| device.job(&scene, "cloud", &query)).transpose()
    };
    let jobs = methods.iter().map(job).collect::<Result<Vec<_>, ChartError>>()?;
    let mut times = vec![Vec::new(); methods.len()];
    // The first round makes tables and field.
    for round in 0..=ROUNDS {
        for (job, times) in jobs.iter().zip(&mut times) {
            let Some(job) = job else { continue };
            let texture = device.renderer.render(job, &Watch::default())?;
            let shade = texture.timings.iter().find(|(stage, _)| *stage == "shade");
            if let (Some((_, time)), 1..) = (shade, round) {
                times.push(time.as_secs_f64());
            }
        }
        progress(round as f64 / ROUNDS as f64);
    }
    let megatexels = f64::from(SIDE).powi(2) / 1e6;
    Ok(times
        .into_iter()
        .map(|mut times| {
            times.sort_by(f64::total_cmp);
            let at = |quarter: usize| times.get(times.len() * quarter / 4).map(|time| time * 1e3 / megatexels);
            Some(Cost { median: at(2)?, quartiles: [at(1)?, at(3)?] })
        })
        .collect())
}
