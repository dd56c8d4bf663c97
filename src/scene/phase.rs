//! Tables of phase functions, of droplets and of aerosol.

use super::quantity::{PhaseValue, Quantity as _};
use super::read::{Reader, describe};
use crate::optics::{PhaseTable, TABLE_POINTS, TableFault};
use serde_json::Value;

/// A phase function as a list of pairs, judged.
pub(super) fn phase_function(reader: &mut Reader, value: &Value, pointer: &str) -> Option<PhaseTable> {
    let rows = value.as_array().filter(|rows| TABLE_POINTS.contains(&rows.len()));
    let Some(rows) = rows else {
        let given = value.as_array().map_or_else(|| describe(value), |rows| format!("a list of {}", rows.len()));
        let (least, most) = TABLE_POINTS.into_inner();
        reader.wrong(pointer, format!("{given} where {least} to {most} pairs [degrees, value] are expected"));
        return None;
    };
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(rows.len());
    for (i, row) in rows.iter().enumerate() {
        let at = format!("{pointer}/{i}");
        let Some([angle, value]) = row.as_array().map(Vec::as_slice) else {
            reader.wrong(at, format!("{} where a pair [degrees, value] is expected", describe(row)));
            return None;
        };
        // The table judges all angles together: it knows what they look like when they are no degrees.
        let angle = reader.plain(angle, &format!("{at}/0"), "0 to 180 degrees")?;
        points.push((angle, reader.quantity::<PhaseValue>(value, &format!("{at}/1"))?.get()));
    }
    let judged = PhaseTable::new(&points);
    let wrong = |TableFault { point, detail }| {
        let at = point.map_or_else(|| pointer.to_owned(), |point| format!("{pointer}/{point}"));
        reader.wrong(at, detail);
    };
    judged.map_err(wrong).ok()
}
