//! How far every method is from Monte Carlo.

use super::light::{Droplets, Prepared, rows};
use super::truth::Picture;
use crate::chart::file::ChartError;

/// How far a method is from Monte Carlo on one picture of one cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CumulusError {
    /// Name of the method.
    pub method: &'static str,
    /// Name of the cloud.
    pub cloud: &'static str,
    /// Where light comes from, or from where the cloud is seen: `front`, `side`, `top`, `back`, `above`, `below`; `sky` for light of an even sky.
    pub set: &'static str,
    /// Whether the sun is behind the cloud, at most 30 degrees off.
    pub from_behind: bool,
    /// Root mean square error, part of the truth's own root mean square.
    pub rms: f64,
    /// How much brighter the picture is in the mean, part of the truth's.
    pub energy: f64,
}

/// Sets of pictures.
pub(super) const SETS: [&str; 7] = ["front", "side", "top", "back", "above", "below", "sky"];

/// The set of a picture under a sun.
fn set(view: &'static str, sun: &str) -> &'static str {
    let of_side = || SETS.into_iter().find(|set| sun.starts_with(set)).unwrap_or(view);
    if view == "side" { of_side() } else { view }
}

/// Errors of every method on every picture, of all clouds or of one.
pub(super) fn errors(cloud: Option<&str>, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<CumulusError>, ChartError> {
    let (droplets, mut clouds) = (Droplets::new()?, Prepared::all()?);
    clouds.retain(|prepared| cloud.is_none_or(|cloud| prepared.cloud.name == cloud));
    let mut found = Vec::new();
    let all = rows();
    for (number, row) in all.iter().enumerate() {
        for prepared in &clouds {
            let mut suns: Vec<&str> =
                prepared.cloud.pictures.iter().flat_map(|picture| &picture.suns).map(String::as_str).collect();
            suns.sort_unstable();
            suns.dedup();
            for sun in suns.into_iter().map(Some).chain([None]) {
                let light = prepared.lit(*row, &droplets, sun);
                let shows = |picture: &&Picture| sun.is_none_or(|sun| picture.suns.iter().any(|own| own == sun));
                for picture in prepared.cloud.pictures.iter().filter(shows) {
                    let [rms, energy] = picture.score(&light.picture(picture), sun);
                    found.push(CumulusError {
                        method: row.name(),
                        cloud: prepared.cloud.name,
                        set: sun.map_or("sky", |sun| set(picture.view, sun)),
                        from_behind: sun.is_some_and(|sun| sun.starts_with("back")),
                        rms,
                        energy,
                    });
                }
            }
        }
        progress((number + 1) as f64 / all.len() as f64);
    }
    Ok(found)
}
