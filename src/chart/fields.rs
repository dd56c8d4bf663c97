//! Chart "fields": what synthetic stratiform fields are like: how their variance is spread over lengths and directions, how their
//! optical depths are distributed, and what a texture finer than the scene's resolution adds.
//!
//! `kind` is what is asked for, `measure` the numbers of a field, `picture` draws.

mod kind;
mod measure;
mod picture;

use super::csv::{Csv, short};
use super::device::{self, Device};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::job::Watch;
use crate::tables::TableLibrary;
use kind::{COVERS, EXTENT_M, Kind, MEAN_M};
use measure::{Depths, FIRST_OCTAVE, OCTAVES, Spectrum, middle};
use picture::{Curve, Curves};

/// Fields of each kind.
const SEEDS: u32 = 8;
/// Wave numbers between which slopes are fitted, cycles a domain: cells and below, and below cells.
const SLOPES: [(&str, [f64; 2]); 2] = [("slope_8_32", [8.0, 32.0]), ("slope_32_128", [32.0, 128.0])];
/// Of the octaves, those whose mean is the ratio of directions: the first has too few waves for one field.
const MEAN_OCTAVES: std::ops::Range<usize> = 1..OCTAVES;
/// Columns of the table that a test computes again.
const RATIO: &str = "axes_over_diagonals";
/// Depths at which distributions are told, over the mean.
const DEPTHS: usize = 41;
/// Texels a side of a scene whose textures are finer, and theirs.
const COARSE: usize = 256;
const SIZES: [usize; 4] = [256, 512, 1024, 2048];

/// Columns and values of a field's row.
fn row(kind: Kind, spectrum: &Spectrum, depths: &Depths) -> Vec<(String, f64)> {
    let octave = |i: usize| (FIRST_OCTAVE * f64::from(1 << i)).round();
    let by_octave = spectrum.axes_over_diagonals.iter().enumerate();
    let mut row: Vec<_> =
        by_octave.map(|(i, ratio)| (format!("axes_{}_{}", octave(i), octave(i + 1)), *ratio)).collect();
    let [ratio, across] =
        [&spectrum.axes_over_diagonals, &spectrum.across_over_along].map(|all| middle(&all[MEAN_OCTAVES]));
    let slopes = SLOPES.map(|(name, [from, to])| (name, spectrum.slope(from..to)));
    let [fifth_of_depth, fifth_of_thickness] = depths.fifths;
    // The law's own numbers; the other law is compared with gamma of the same mean and spread.
    let off = depths.off_gamma(kind.spread.unwrap_or(depths.spread));
    let others = [(RATIO, ratio), ("across_over_along", across)].into_iter().chain(slopes).chain([
        ("half_of_variance_m", EXTENT_M / spectrum.half()),
        ("cover", depths.cover),
        ("thickness_over_asked", depths.thickness_m / MEAN_M),
        ("depth_over_asked", depths.path_m / MEAN_M),
        ("spread", depths.spread),
        ("fifth_of_depth", fifth_of_depth),
        ("fifth_of_thickness", fifth_of_thickness),
        ("off_gamma", off),
    ]);
    row.extend(others.map(|(name, value)| (name.to_owned(), value)));
    row
}

fn words(kind: Kind, seed: &str) -> Vec<String> {
    let asked = kind.spread.map_or_else(String::new, short);
    vec![kind.pattern.to_owned(), kind.law().to_owned(), short(kind.coverage), asked, seed.to_owned()]
}

fn measured(device: &mut Device<'_>, kind: Kind, seed: u32) -> Result<(Spectrum, Depths), ChartError> {
    let columns = kind.columns(device, seed)?;
    let paths: Vec<f32> = columns.iter().map(|column| column.path_m).collect();
    Ok((Spectrum::of(&paths), Depths::of(&columns)))
}

/// Means of points with the same places.
fn mean(curves: &[Vec<[f64; 2]>]) -> Vec<[f64; 2]> {
    let count = curves.len() as f64;
    let points = curves.first().map_or(0, Vec::len);
    (0..points).map(|i| [curves[0][i][0], curves.iter().map(|curve| curve[i][1]).sum::<f64>() / count]).collect()
}

/// From cycles a domain to cycles per km.
fn per_km(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let domain_km = 1e-3 * EXTENT_M;
    points.into_iter().map(|[cycles, power]| [cycles / domain_km, power * domain_km]).collect()
}

/// Spectra of thickness as textures of one scene show it, and as a scene of the finest's own resolution has it.
fn detail(device: &mut Device<'_>) -> Result<Vec<Curve>, ChartError> {
    let mut curves = Vec::new();
    for spread in [Some(COVERS[0].1), None] {
        let kind = Kind { pattern: "open", spread, coverage: COVERS[0].0 };
        let finest = SIZES[SIZES.len() - 1];
        for (resolution, size) in SIZES.map(|size| (COARSE, size)).into_iter().chain([(finest, finest)]) {
            let scene = device::scene(&kind.scene(0, resolution))?;
            let job = device.job(&scene, "thickness", &[("size", &size.to_string())])?;
            let texture = device.renderer.render(&job, &Watch::default())?;
            let points = per_km(Spectrum::of(&texture.data).binned());
            curves.push(Curve { kind, resolution, size, points });
        }
    }
    Ok(curves)
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let mut device = Device::open(library)?;
    let kinds = Kind::all();
    let mut table: Option<Csv> = None;
    let mut curves = Curves::default();
    for (number, kind) in kinds.iter().enumerate() {
        let (mut spectra, mut depths, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        let mut sums: Vec<f64> = Vec::new();
        for seed in 0..SEEDS {
            let (spectrum, depth) = measured(&mut device, *kind, seed)?;
            let row = row(*kind, &spectrum, &depth);
            let csv = table.get_or_insert_with(|| {
                let asked = ["pattern", "law", "coverage_asked", "spread_asked", "seed"];
                Csv::new(&asked.into_iter().chain(row.iter().map(|(name, _)| name.as_str())).collect::<Vec<_>>())
            });
            let numbers: Vec<_> = row.iter().map(|(_, value)| Some(*value)).collect();
            csv.row(&words(*kind, &seed.to_string()).iter().map(String::as_str).collect::<Vec<_>>(), &numbers);
            sums.resize(row.len(), 0.0);
            sums.iter_mut().zip(&row).for_each(|(sum, (_, value))| *sum += value / f64::from(SEEDS));
            ratios.push(spectrum.axes_over_diagonals);
            spectra.push(spectrum.binned());
            let place = |i: usize| 10.0_f64.powf(-2.0 + i as f64 / 15.0);
            depths.push((0..DEPTHS).map(|i| [place(i), depth.below(place(i))]).collect());
            progress((number as f64 + f64::from(seed + 1) / f64::from(SEEDS)) / (kinds.len() + 1) as f64);
        }
        if let Some(csv) = &mut table {
            let words = words(*kind, "mean");
            csv.row(
                &words.iter().map(String::as_str).collect::<Vec<_>>(),
                &sums.into_iter().map(Some).collect::<Vec<_>>(),
            );
        }
        let curve = |points| Curve { kind: *kind, resolution: kind::SIDE, size: kind::SIDE, points };
        curves.spectra.push(curve(per_km(mean(&spectra))));
        curves.depths.push(curve(mean(&depths)));
        curves.ratios.push((*kind, ratios));
    }
    curves.detail = detail(&mut device)?;
    progress(1.0);
    let table = table.ok_or(ChartError::Empty("kinds of fields"))?.into_bytes();
    let figure = curves.figure().draw("fields")?;
    Ok(vec![
        figure,
        ChartFile { name: "fields.csv".to_owned(), bytes: table },
        ChartFile { name: "fields-curves.csv".to_owned(), bytes: curves.table().into_bytes() },
    ])
}

/// The first field of every kind.
pub(super) fn sample(library: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    const COLUMNS: [&str; 7] =
        [RATIO, SLOPES[0].0, SLOPES[1].0, "cover", "depth_over_asked", "spread", "fifth_of_depth"];
    let mut device = Device::open(library)?;
    let mut of_kind = |kind: Kind| {
        let (spectrum, depths) = measured(&mut device, kind, 0)?;
        let row = row(kind, &spectrum, &depths);
        let value = |name: &'static str| Some((name, row.iter().find(|(column, _)| column == name)?.1, 0.0));
        Ok(SampledRow { cells: words(kind, "0"), values: COLUMNS.into_iter().filter_map(value).collect() })
    };
    Kind::all().into_iter().map(&mut of_kind).collect()
}
