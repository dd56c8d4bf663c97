//! `skyloom chart`: measurements of the methods, drawn.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::ArgMatches;
use skyloom::chart::{CHARTS, Chart};
use skyloom::tables::TableLibrary;

use super::fault::Fault;
use super::render::{LateBar, cache};
use crate::files;

pub(super) fn command(options: &ArgMatches) -> Result<(), Fault> {
    let names: Vec<&String> = options.get_many("NAME").into_iter().flatten().collect();
    let charts = if names.is_empty() {
        CHARTS.iter().collect()
    } else {
        names.iter().map(|name| chart(name)).collect::<Result<Vec<_>, _>>()?
    };
    let folder = options.get_one::<PathBuf>("output").map_or(Path::new("docs/charts"), PathBuf::as_path);
    let failure = |error: std::io::Error| Fault::Failure(format!("writing to {}: {error}", folder.display()));
    std::fs::create_dir_all(folder).map_err(failure)?;
    let library = TableLibrary::new(cache());
    for chart in charts {
        let start = Instant::now();
        let bar = LateBar::new(format!("chart {}", chart.name));
        let files = chart.make(&library, &|part| bar.set(part)).map_err(|error| Fault::Failure(error.to_string()))?;
        drop(bar);
        for file in &files {
            files::write_atomically(&folder.join(&file.name), &file.bytes).map_err(failure)?;
        }
        let written: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        let seconds = start.elapsed().as_secs_f64();
        // Nothing can be done when even stderr is closed.
        writeln!(std::io::stderr(), "{}: {} in {seconds:.1} s", chart.name, written.join(", ")).unwrap_or_default();
    }
    Ok(())
}

fn chart(name: &str) -> Result<&'static Chart, Fault> {
    Chart::named(name).ok_or_else(|| {
        let names: Vec<&str> = CHARTS.iter().map(|chart| chart.name).collect();
        Fault::Usage(format!("there is no chart {name:?}; there are {}", names.join(", ")))
    })
}
