//! Extinction over the height of adiabatic cloud: where rising air condenses water in proportion to the height above the base, on as many droplets
//! everywhere, their radius grows with its cube root and extinction with its power of 2/3 (Brenguier et al. 2000, J. Atmos. Sci. 57, 803).

/// Extinction at the top, relative to that of the whole column.
pub(crate) const GROWTH: f64 = 5.0 / 3.0;

/// Parts closer than this are taken as one: a difference of two depths would have no digits.
const CLOSE: f64 = 1e-3;

/// Extinction at a part of a column's height from its base, 0 to 1, relative to that of the whole.
pub(crate) fn growth_at(part: f64) -> f64 {
    let root = part.cbrt();
    GROWTH * root * root
}

/// Mean extinction between two parts of a column's height from its base, 0 to 1, relative to that of the whole.
pub(crate) fn growth([low, high]: [f64; 2]) -> f64 {
    if (high - low).abs() < CLOSE {
        return growth_at(0.5 * (low + high));
    }
    let depth = |part: f64| {
        let root = part.cbrt();
        part * root * root
    };
    (depth(high) - depth(low)) / (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_a_column_is_as_deep_as_it_was() {
        assert!((growth([0.0, 1.0]) - 1.0).abs() < 1e-15);
        // The middle of a part, by its own mean, and as a limit.
        let mean = |parts: u32| {
            (0..parts).map(|i| growth_at((f64::from(i) + 0.5) / f64::from(parts))).sum::<f64>() / f64::from(parts)
        };
        assert!((mean(1000) - 1.0).abs() < 1e-4, "{}", mean(1000));
        for part in [0.001, 0.1, 0.5, 0.999] {
            let apart = growth([part, part + 1.01 * CLOSE]) / growth([part, part + 0.99 * CLOSE]) - 1.0;
            assert!(apart.abs() < 0.02, "{part}: {apart}");
        }
        assert!(growth([0.0, 0.0]) == 0.0 && (growth([1.0, 1.0]) - GROWTH).abs() < 1e-15);
    }
}
