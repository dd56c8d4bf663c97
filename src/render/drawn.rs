//! Which layers a texture shows, in which order.

use crate::job::Job;
use crate::projection::Side;

/// Stratiform layers that a texture shows, in the order in which they are drawn: from the viewer on.
pub(super) fn drawn(job: &Job) -> Vec<usize> {
    let wanted = &job.request().wanted;
    let mut layers: Vec<usize> = match wanted.layer() {
        Some(layer) => job.scene().stratiform_index(layer as usize).into_iter().collect(),
        None => (0..job.scene().stratiform_count()).collect(),
    };
    if wanted.plane().is_some_and(|plane| plane.side == Side::Above) {
        layers.reverse();
    }
    layers
}

/// How many of the layers that a texture shows are drawn before one at a place of the scene's list.
pub(super) fn cumulus_place(job: &Job, place: usize) -> usize {
    let from_above = job.request().wanted.plane().is_some_and(|plane| plane.side == Side::Above);
    drawn(job).into_iter().filter(|&number| (job.scene().place(number) < place) != from_above).count()
}
