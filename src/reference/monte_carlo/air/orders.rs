//! Light by the number of scatterings.

use crate::reference::monte_carlo::estimate::Estimate;
use crate::reference::monte_carlo::run::Sums;

/// Orders told apart.
pub const ORDERS_APART: usize = 8;
/// Outcomes of a path: the orders apart, those above, all.
pub(super) const OUTCOMES: usize = ORDERS_APART + 2;

/// Light by the number of scatterings; a reflection by the ground is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirOrders {
    /// Orders 1 to [`ORDERS_APART`], each on its own.
    pub apart: [Estimate; ORDERS_APART],
    /// All orders above.
    pub higher: Estimate,
    /// All orders. Its error is not that of independent orders.
    pub total: Estimate,
}

impl AirOrders {
    pub(super) fn of(sums: &Sums<OUTCOMES>) -> Self {
        Self {
            apart: std::array::from_fn(|i| sums.estimate(i)),
            higher: sums.estimate(ORDERS_APART),
            total: sums.estimate(ORDERS_APART + 1),
        }
    }
}

/// Adds a contribution of an order, from 1, to the outcomes of a path.
pub(super) fn tally(outcomes: &mut [f64; OUTCOMES], order: usize, value: f64) {
    outcomes[(order - 1).min(ORDERS_APART)] += value;
    outcomes[ORDERS_APART + 1] += value;
}
