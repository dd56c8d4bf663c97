//! What is really seen: rows of the reference data, or the Monte Carlo of this program.

use std::sync::atomic::AtomicBool;

use super::cases::{Case, Origin};
use crate::atmosphere::View;
use crate::chart::file::ChartError;
use crate::reference::monte_carlo::Effort;
use crate::reference::monte_carlo::air::{AirProblem, AirView, PreparedAir, radiance};

/// Views closer to the sun are left out, degrees: nearer, a reference's phase function is too sharp for its noise.
const NEAREST_DEG: f64 = 3.0;
/// Most paths of a view, and the relative error at which they are enough.
const PATHS: u64 = 150_000;
const RELATIVE_ERROR: f64 = 0.003;
/// Height of an eye on the ground, m.
const STANDING_M: f64 = 1.0;

/// A radiance, 1/sr, with its standard error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) sun_deg: f64,
    pub(super) eye_m: f64,
    pub(super) elevation_deg: f64,
    pub(super) azimuth_deg: f64,
    pub(super) radiance: f64,
    pub(super) standard_error: f64,
}

/// The truth of a case, sun by sun.
pub(super) fn of(case: &Case, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<Seen>, ChartError> {
    let mut seen = match case.origin {
        Origin::Independent(file) => {
            read(file, case).ok_or(ChartError::Empty("a row of the reference data is not one"))?
        }
        Origin::Own => traced(case, progress)?,
    };
    seen.sort_by(|a, b| a.sun_deg.total_cmp(&b.sun_deg));
    if seen.is_empty() { Err(ChartError::Empty("the reference data have no row of a case")) } else { Ok(seen) }
}

/// Whether a view is far enough from the sun.
fn is_beside_the_sun(sun_deg: f64, elevation_deg: f64, azimuth_deg: f64) -> bool {
    View::new(elevation_deg, azimuth_deg, sun_deg.to_radians().cos()).sun <= NEAREST_DEG.to_radians().cos()
}

/// Rows of a file that belong to a case; none if one of them is no row. A column of one name is where each file has it.
fn read(file: &str, case: &Case) -> Option<Vec<Seen>> {
    let mut lines = file.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next()?;
    let column = |name: &str| header.iter().position(|column| column.starts_with(name));
    let [set, eye] = ["set", "eye_km"].map(column);
    let [nm, sun, elevation, azimuth] =
        [column("lambda_nm")?, column("sun_zenith_deg")?, column("view_elevation_deg")?, column("view_azimuth")?];
    let radiance = column(if case.polarised { "L_vector" } else { "L_total" })?;
    let error = column("se_")?;
    let mut seen = Vec::new();
    for line in lines {
        let number = |column: usize| line.get(column)?.parse::<f64>().ok();
        let of_set = set.is_none_or(|set| line.get(set) == Some(&case.air.name));
        if !of_set || number(nm)? != case.wavelength_nm {
            continue;
        }
        let (sun_deg, elevation_deg, azimuth_deg) = (number(sun)?, number(elevation)?, number(azimuth)?);
        if is_beside_the_sun(sun_deg, elevation_deg, azimuth_deg) {
            let eye_m = eye.map_or(Some(0.0), number)?;
            seen.push(Seen {
                sun_deg,
                eye_m: (1e3 * eye_m).max(STANDING_M),
                elevation_deg,
                azimuth_deg,
                radiance: number(radiance)?,
                standard_error: number(error)?,
            });
        }
    }
    Some(seen)
}

fn traced(case: &Case, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<Seen>, ChartError> {
    let medium = case.air.medium(case.wavelength_nm);
    let air = PreparedAir::new(&medium)?;
    let mut seen = Vec::new();
    for (number, &sun_zenith_deg) in case.suns_deg.iter().enumerate() {
        let beside = |view: &&[f64; 2]| is_beside_the_sun(sun_zenith_deg, view[0], view[1]);
        let views: Vec<AirView> = case
            .views_deg
            .iter()
            .filter(beside)
            .map(|&[elevation_deg, azimuth_deg]| AirView::new(STANDING_M, elevation_deg, azimuth_deg))
            .collect();
        let problem =
            AirProblem { air: &air, ground_albedo: case.air.ground, sun_zenith_deg, polarised: case.polarised };
        let effort = Effort { relative_error: RELATIVE_ERROR, ..Effort::photons(PATHS, number as u64) };
        let report = |part: f64| progress((number as f64 + part) / case.suns_deg.len() as f64);
        let found = radiance(&problem, &views, &effort, &report, &AtomicBool::new(false))?;
        seen.extend(views.iter().zip(found).map(|(view, found)| Seen {
            sun_deg: sun_zenith_deg,
            eye_m: view.eye_m,
            elevation_deg: view.elevation_deg,
            azimuth_deg: view.azimuth_deg,
            radiance: found.total.value,
            standard_error: found.total.standard_error,
        }));
    }
    Ok(seen)
}
