//! Light by the number of scatterings, from that which was never scattered on.

use super::air::AirOrders;
use super::estimate::Estimate;
use super::run::Sums;

pub use super::air::ORDERS_APART;

/// Outcomes of a path by order: the orders apart from 0 on, and those above.
pub(super) const BY_ORDER: usize = ORDERS_APART + 2;
/// These, and all light.
pub(super) const OUTCOMES: usize = BY_ORDER + 1;
/// All light.
pub(super) const TOTAL: usize = BY_ORDER;

/// Light by the number of scatterings by clouds and air; a reflection by the ground is one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orders {
    /// Orders 0 to [`ORDERS_APART`], each on its own. Of order 0 is light of an even sky that comes straight.
    pub apart: [Estimate; ORDERS_APART + 1],
    /// All orders above.
    pub higher: Estimate,
}

impl Orders {
    /// Of sums whose outcomes from the one of a number on are the orders.
    pub(super) fn of<const N: usize>(sums: &Sums<N>, first: usize) -> Self {
        Self {
            apart: std::array::from_fn(|order| sums.estimate(first + order)),
            higher: sums.estimate(first + ORDERS_APART + 1),
        }
    }

    /// With exactly known light of an order added.
    pub(crate) fn plus(mut self, order: usize, exact: f64) -> Self {
        self.apart[order] = self.apart[order].plus(exact);
        self
    }

    /// Orders from `first` to `last`, each on its own, then all above. The error of these is that of independent orders.
    pub(crate) fn split(&self, first: usize, last: usize) -> Vec<Estimate> {
        let (apart, above) = self.apart.split_at(last + 1);
        let add = |sum: Estimate, more: &Estimate| Estimate {
            value: sum.value + more.value,
            standard_error: sum.standard_error.hypot(more.standard_error),
        };
        let rest = above.iter().fold(self.higher, add);
        apart[first..].iter().copied().chain([rest]).collect()
    }
}

impl From<&AirOrders> for Orders {
    fn from(orders: &AirOrders) -> Self {
        let mut apart = [Estimate::default(); ORDERS_APART + 1];
        apart[1..].copy_from_slice(&orders.apart);
        Self { apart, higher: orders.higher }
    }
}

/// The place of an order among the outcomes by order.
pub(super) fn place(order: usize) -> usize {
    order.min(ORDERS_APART + 1)
}

/// Adds light of an order to the outcomes of a path.
pub(super) fn tally(outcomes: &mut [f64; OUTCOMES], order: usize, value: f64) {
    outcomes[place(order)] += value;
    outcomes[TOTAL] += value;
}
