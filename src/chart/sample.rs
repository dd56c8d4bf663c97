//! Values of a chart computed again, to be compared with the committed table.

/// A row of a chart's table, computed again.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledRow {
    /// Its first cells, which name it.
    pub cells: Vec<String>,
    /// Column, value and standard error of the value; the error is 0 where nothing is random.
    pub values: Vec<(&'static str, f64, f64)>,
}
