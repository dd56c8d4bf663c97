//! Chart "air": light of clear air by every method, against Monte Carlo on a round Earth.

mod cases;
mod errors;
mod method;
mod picture;
mod truth;

use super::csv::Csv;
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::tables::TableLibrary;
use cases::{Origin, SAMPLED};
use errors::{Found, errors};
use method::METHODS;

/// Part of the work that the truth of the chart's own is.
const TRUTH: f64 = 0.6;

pub(super) fn make(_: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let cases = cases::all();
    let mut exact = Vec::new();
    let own = cases.iter().filter(|case| case.origin == Origin::Own).count();
    let mut traced = 0;
    for case in &cases {
        let begun = traced;
        exact.push(truth::of(case, &|part| progress(TRUTH * (begun as f64 + part) / own as f64))?);
        traced += usize::from(case.origin == Origin::Own);
    }
    let mut found: Vec<Found> = Vec::new();
    for number in 0..cases.len() {
        // Cases of the same air come one after the other, and are solved once.
        let first = cases[..number].iter().all(|before| !before.is_air_of(&cases[number]));
        if !first {
            continue;
        }
        let same: Vec<usize> = (number..cases.len()).filter(|&other| cases[other].is_air_of(&cases[number])).collect();
        for (method, named) in METHODS.iter().enumerate() {
            let prepared = named.prepare(&cases[number], true);
            found.extend(same.iter().flat_map(|&case| errors(method, case, &prepared, &exact[case])));
        }
        progress(TRUTH + (1.0 - TRUTH) * (number + 1) as f64 / cases.len() as f64);
    }
    found.sort_by_key(|found| (found.method, found.case));
    let mut csv = Csv::new(&[
        "method",
        "set",
        "truth",
        "wavelength_nm",
        "sun_zenith_deg",
        "rms_percent",
        "worst_percent",
        "noise_percent",
        "views",
        "seconds_per_air",
        "ms_per_sun",
    ]);
    for found in &found {
        let case = &cases[found.case];
        let percent = [found.rms, found.worst, found.noise].map(|part| Some(100.0 * part));
        let mut numbers = vec![Some(case.wavelength_nm), Some(found.sun_deg)];
        numbers.extend(percent);
        numbers.extend([Some(found.views as f64), Some(found.seconds), Some(found.milliseconds)]);
        csv.row(&[METHODS[found.method].name, case.name, case.origin.name()], &numbers);
    }
    progress(1.0);
    let figure = picture::of(&cases, &found);
    Ok(vec![figure.draw("air")?, ChartFile { name: "air.csv".to_owned(), bytes: csv.into_bytes() }])
}

/// Every method but the slowest in one case; compared with the committed table.
pub(super) fn sample(_: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let cases = cases::all();
    let Some(number) = cases.iter().position(|case| (case.name, case.wavelength_nm) == SAMPLED) else {
        return Err(ChartError::Empty("the case of the sample"));
    };
    let exact = truth::of(&cases[number], &|_| ())?;
    let mut rows = Vec::new();
    for (method, named) in METHODS.iter().enumerate().filter(|(_, method)| !method.is_slow()) {
        let prepared = named.prepare(&cases[number], false);
        for found in errors(method, number, &prepared, &exact) {
            let case = &cases[number];
            rows.push(SampledRow {
                cells: vec![
                    named.name.to_owned(),
                    case.name.to_owned(),
                    case.origin.name().to_owned(),
                    case.wavelength_nm.to_string(),
                    found.sun_deg.to_string(),
                ],
                values: vec![
                    ("rms_percent", 100.0 * found.rms, 0.0),
                    ("worst_percent", 100.0 * found.worst, 0.0),
                    ("noise_percent", 100.0 * found.noise, 0.0),
                ],
            });
        }
    }
    Ok(rows)
}
