//! Numbers in names.

/// Exact text of a number; both zeros give the same.
pub(super) fn bits(value: f64) -> String {
    format!("{:016x}", (value + 0.0).to_bits())
}
