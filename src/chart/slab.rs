//! Chart "slab": cost of each method against its error.

use super::cost::{self, Cost};
use super::csv::Csv;
use super::errors::{SLAB_MEDIA, SlabErrors, slab_errors};
use super::figure::{Axis, BLACK, Figure, Key, Mark, Panel, Stroke};
use super::file::{ChartError, ChartFile};
use super::row::SlabRow;
use super::statistics::ErrorSummary;
use crate::tables::TableLibrary;

/// Channels of a texel: each is a Monte Carlo run of its own.
const COLOURS: f64 = 3.0;

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let methods = SlabRow::all();
    let mut costs = cost::costs(library, &methods, &|part| progress(0.1 * part))?;
    let mut csv = Csv::new(&[
        "method",
        "medium",
        "ms_per_megatexel",
        "ms_quartile1",
        "ms_quartile3",
        "reflected_rms",
        "reflected_p99",
        "transmitted_rms",
        "transmitted_p99",
        "near_sun_rms",
        "near_sun_p99",
        "reflected_cases",
        "transmitted_cases",
        "near_sun_cases",
    ]);
    let mut all = vec![SlabErrors::default(); methods.len()];
    let mut rows = Vec::new();
    for medium in 0..SLAB_MEDIA {
        let report = |part: f64| progress(0.1 + 0.9 * (medium as f64 + part) / SLAB_MEDIA as f64);
        let (name, errors) = slab_errors(library, medium, &methods, &report)?;
        for ((method, errors), all) in methods.iter().zip(&errors).zip(&mut all) {
            all.extend(errors);
            rows.push((*method, name.clone(), errors.summaries()));
        }
    }
    for ((method, errors), cost) in methods.iter().zip(&all).zip(&mut costs) {
        // Monte Carlo's time is that of single views.
        if errors.runs.1 > 0 {
            let mean = errors.runs.0.as_secs_f64() / f64::from(errors.runs.1) * COLOURS * 1e9;
            *cost = Some(Cost { median: mean, quartiles: [mean; 2] });
        }
        write_row(&mut csv, *method, "all", *cost, &errors.summaries());
    }
    for method in methods.iter().copied() {
        for (_, name, summaries) in rows.iter().filter(|row| row.0 == method) {
            write_row(&mut csv, method, name, None, summaries);
        }
    }
    let results: Vec<_> = methods.iter().zip(&costs).zip(&all).map(|((m, c), e)| (*m, *c, e.summaries())).collect();
    Ok(vec![picture(&results).draw("slab")?, ChartFile { name: "slab.csv".to_owned(), bytes: csv.into_bytes() }])
}

fn write_row(csv: &mut Csv, method: SlabRow, medium: &str, cost: Option<Cost>, summaries: &[ErrorSummary; 3]) {
    let mut numbers =
        vec![cost.map(|cost| cost.median), cost.map(|cost| cost.quartiles[0]), cost.map(|cost| cost.quartiles[1])];
    numbers.extend(summaries.iter().flat_map(|summary| [Some(summary.rms), Some(summary.percentile99)]));
    numbers.extend(summaries.iter().map(|summary| Some(summary.count as f64)));
    csv.row(&[method.name(), medium], &numbers);
}

fn picture(results: &[(SlabRow, Option<Cost>, [ErrorSummary; 3])]) -> Figure {
    let titles = ["reflected light", "transmitted, beyond 10° from the sun", "transmitted, within 10° of the sun"];
    let (drawn, reference): (Vec<_>, Vec<_>) = results.iter().partition(|(method, _, _)| *method != SlabRow::Reference);
    let costs = || drawn.iter().filter_map(|(_, cost, _)| *cost);
    let least = costs().map(|cost| cost.quartiles[0]).fold(f64::MAX, f64::min);
    let most = costs().map(|cost| cost.quartiles[1]).fold(0.0, f64::max);
    let ends = [least / 1.25, most * 1.25];
    let panel = |(at, title): (usize, &&str)| {
        let mut marks = Vec::new();
        for (method, _, summaries) in &reference {
            // Its cost is far outside the picture.
            let level = |part: f64| vec![[ends[0], 100.0 * part], [ends[1], 100.0 * part]];
            marks.push(Mark::Line(level(summaries[at].rms), Stroke::dashed(method.colour(), 1.5)));
            marks.push(Mark::Line(level(summaries[at].percentile99), Stroke::dotted(method.colour(), 1.5)));
        }
        for (method, cost, summaries) in &drawn {
            let (Some(cost), summary) = (cost, summaries[at]) else { continue };
            let colour = method.colour();
            let (rms, tail) = (100.0 * summary.rms, 100.0 * summary.percentile99);
            let median = cost.median;
            marks.push(Mark::Line(vec![[median, rms], [median, tail]], Stroke::solid(colour, 1.5)));
            marks.push(Mark::Line(cost.quartiles.map(|cost| [cost, rms]).to_vec(), Stroke::solid(colour, 1.5)));
            marks.push(Mark::Dots { points: vec![[median, tail, 0.0]], colour, ring: true });
            marks.push(Mark::Dots { points: vec![[median, rms, 0.0]], colour, ring: false });
        }
        Panel {
            title: (*title).to_owned(),
            x: Axis::log("milliseconds per million texels (bars: quartiles)", ends),
            y: Axis::log("error of radiance, %", [0.03, 300.0]),
            marks,
        }
    };
    let dot = |(method, _, _): &(SlabRow, Option<Cost>, _)| {
        (Key::Dot { colour: method.colour(), ring: false }, method.name().to_owned())
    };
    let mut first: Vec<(Key, String)> = drawn.iter().map(dot).collect();
    first.push((Key::Dot { colour: BLACK, ring: false }, "root mean square".to_owned()));
    first.push((Key::Dot { colour: BLACK, ring: true }, "99 of 100 cases".to_owned()));
    let mut second = Vec::new();
    for (method, cost, _) in &reference {
        let hours = cost.map_or(0.0, |cost| cost.median) / 3.6e6;
        let name =
            format!("{} (Monte Carlo, 1 %), {hours:.0} hours per million texels: root mean square", method.name());
        second.push((Key::Line(Stroke::dashed(method.colour(), 1.5)), name));
        second.push((Key::Line(Stroke::dotted(method.colour(), 1.5)), "99 of 100 cases".to_owned()));
    }
    Figure {
        title: "Slab light: cost against error".to_owned(),
        subtitle:
            "Six media, optical depth 0.045 to 111, sun 0 to 88°, view 0 to 85°. Errors against adding-doubling at the \
                   exact angles; near the sun against Monte Carlo (0.5 % noise)"
                .to_owned(),
        size: [1200, 520],
        columns: 3,
        panels: titles.iter().enumerate().map(panel).collect(),
        legend: vec![first, second],
        scale: None,
    }
}
