//! The charts of error against cost as pages: `/charts`, and the picture and the table of each, built into the program.

use std::fmt::Write as _;
use std::sync::Arc;

use axum::Router;
use axum::routing::get;
use skyloom::chart::CHARTS;

use crate::app::App;
use crate::viewer::{HTML, file};

const SVG: &str = "image/svg+xml";
const CSV: &str = "text/csv; charset=utf-8";

/// Pictures and tables, the pictures of a chart next to each other.
macro_rules! files {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../docs/charts/", $name)))),*]
    };
}

const FILES: &[(&str, &str)] = files! {
    "slab.svg" "slab.csv" "slab-fluxes.svg" "slab-fluxes.csv" "slab-radiance.svg" "slab-radiance.csv" "slab-modified.svg"
    "slab-modified.csv" "slab-validity-forward.svg" "slab-validity-analytic.svg" "slab-validity-tabulated.svg" "slab-validity.csv"
    "field.svg" "field.csv" "fields.svg" "fields.csv" "exchange.svg" "exchange.csv" "light.svg" "light.csv" "air.svg" "air.csv"
    "coupling.svg" "coupling.csv" "sky-view.svg" "sky-view.csv" "formats.svg" "formats.csv" "frame.svg" "frame.csv" "cumulus.svg"
    "cumulus.csv" "cumulus-growth.svg" "cumulus-growth.csv"
};

/// The page, and its files.
pub fn routes() -> Router<Arc<App>> {
    let page = Router::new().route("/charts", get(async || file(HTML, page())));
    FILES.iter().fold(page, |page, (name, text)| {
        let media_type = if name.ends_with(".svg") { SVG } else { CSV };
        page.route(&format!("/charts/{name}"), get(async move || file(media_type, *text)))
    })
}

/// What belongs to a chart: files with its name, and with more words behind it that are no other chart's.
fn files_of(chart: &str) -> impl Iterator<Item = &'static str> {
    let belongs = move |name: &str| {
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        stem == chart
            || stem.starts_with(&format!("{chart}-"))
                && CHARTS.iter().all(|other| !stem.starts_with(other.name) || other.name.len() <= chart.len())
    };
    FILES.iter().map(|(name, _)| *name).filter(move |name| belongs(name))
}

fn page() -> String {
    let mut body = String::new();
    for chart in CHARTS {
        let _ = write!(body, "<section><h2 id=\"{0}\">{0}: {1}</h2>", chart.name, chart.about);
        for name in files_of(chart.name) {
            let _ = if name.ends_with(".svg") {
                write!(
                    body,
                    "<a href=\"/charts/{name}\"><img loading=\"lazy\" src=\"/charts/{name}\" alt=\"{}\"></a>",
                    chart.about
                )
            } else {
                write!(body, "<p><a href=\"/charts/{name}\">{name}</a>, the same in numbers</p>")
            };
        }
        body.push_str("</section>");
    }
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\"><title>Charts of Skyloom</title><link rel=\"icon\" href=\"data:,\">\
         <link rel=\"stylesheet\" href=\"/viewer.css\"></head><body><header><h1>Error against cost</h1><a href=\"/\">to the viewer</a></header>\
         <main class=\"charts\"><p>What every method costs and how far it is from the truth, as measured on two cores with a software driver. The plan takes its expected errors from here.</p>{body}</main></body></html>"
    )
}
