//! What the renders of a request cost, for its line in the log.

use std::cell::Cell;
use std::future::Future;

tokio::task_local! {
    static COST: Cell<f64>;
}

/// Answers a request, and gives what its renders cost, as the line before the device counts: texels of a layer. None where nothing was
/// rendered for it.
pub async fn counted<T>(answer: impl Future<Output = T>) -> (T, Option<u64>) {
    let answered = async {
        let done = answer.await;
        (done, COST.with(Cell::get))
    };
    let (done, cost) = COST.scope(Cell::new(0.0), answered).await;
    (done, (cost > 0.0).then_some(cost.round() as u64))
}

/// Counts a render for the request that is being answered. Those of jobs are for none.
pub fn add(cost: f64) {
    COST.try_with(|sum| sum.set(sum.get() + cost)).unwrap_or_default();
}
