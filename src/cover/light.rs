//! The light of one sun on, in and below a cover.

use super::level::Level;
use crate::atmosphere::COSINES;

/// Light at every height from the cover's top to the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverLight {
    /// Azimuth means of the sky on the top at the cosines of [`cosine_rule`](crate::atmosphere::cosine_rule), 1/sr.
    pub sky: [f64; COSINES],
    /// On the top: what enters and what comes back.
    pub top: Level,
    /// Below the lowest cloud; on the ground if there is none.
    pub base: Level,
    /// On the ground.
    pub ground: Level,
    /// Where layers and parts of the air meet, from the top to the ground.
    pub levels: Vec<Level>,
}

impl CoverLight {
    /// Light at a height, m; clamped to what lies between ground and top.
    ///
    /// It is linear between the levels: within the thickness of a cloud that is no more than a smooth passage.
    #[must_use]
    pub fn at(&self, height_m: f64) -> Level {
        let lower = self.levels.partition_point(|level| level.height_m > height_m);
        match (lower.checked_sub(1).and_then(|upper| self.levels.get(upper)), self.levels.get(lower)) {
            (Some(upper), Some(lower)) => {
                let share = (upper.height_m - height_m) / (upper.height_m - lower.height_m);
                upper.between(lower, share.clamp(0.0, 1.0))
            }
            (None, _) => self.top,
            (_, None) => self.ground,
        }
    }
}
