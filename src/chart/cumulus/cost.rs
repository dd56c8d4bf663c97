//! What every method takes.

use super::light::{Droplets, Prepared, Row, rows};
use crate::chart::file::ChartError;
use crate::cumulus::Ray;
use crate::method::CumulusMethod;
use std::time::Instant;

/// What a row takes: microseconds a ray that meets cloud, on one core, also against the lattice's, and milliseconds a sun, on all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cost {
    pub(super) row: Row,
    pub(super) us_per_pixel: f64,
    pub(super) ratio: f64,
    pub(super) ms_per_sun: f64,
}

/// Times that every row is run, in turn.
const ROUNDS: usize = 9;

/// Costs of the rows, on the largest of the clouds seen from the side: the shortest of suns in turn, which other work on the machine disturbs least.
pub(super) fn costs(progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<Cost>, ChartError> {
    let (droplets, clouds) = (Droplets::new()?, Prepared::all()?);
    let missing = ChartError::Empty("pictures of cumulus");
    let prepared = clouds.last().ok_or_else(|| missing.clone())?;
    let picture = prepared.cloud.pictures.first().ok_or(missing)?;
    let rows = rows();
    let mut times = vec![(Vec::new(), Vec::new()); rows.len()];
    let cloudy = picture.cloudy();
    for round in 0..ROUNDS {
        let sun = picture.suns[round % picture.suns.len()].as_str();
        for (row, (pixel, per_sun)) in rows.iter().zip(&mut times) {
            let begun = Instant::now();
            let light = prepared.lit(*row, &droplets, Some(sun));
            per_sun.push(begun.elapsed().as_secs_f64() * 1e3);
            let begun = Instant::now();
            let sum: f64 = cloudy.iter().map(|&towards| light.green(Ray { from: picture.eye, towards })).sum();
            std::hint::black_box(sum);
            pixel.push(begun.elapsed().as_secs_f64() * 1e6 / cloudy.len() as f64);
        }
        progress((round + 1) as f64 / ROUNDS as f64);
    }
    let least = |times: Vec<f64>| times.into_iter().fold(f64::INFINITY, f64::min);
    let shortest: Vec<[f64; 2]> = times.into_iter().map(|(pixel, per_sun)| [least(pixel), least(per_sun)]).collect();
    let lattice = rows.iter().zip(&shortest).find(|(row, _)| **row == Row::Asked(CumulusMethod::Lattice));
    let lattice = lattice.map_or(f64::NAN, |(_, [us, _])| *us);
    let cost = |(&row, &[us_per_pixel, ms_per_sun]): (&Row, &[f64; 2])| Cost {
        row,
        us_per_pixel,
        ratio: us_per_pixel / lattice,
        ms_per_sun,
    };
    Ok(rows.iter().zip(&shortest).map(cost).collect())
}
