//! When the layers of displacement are born, how old they are, and which steps lead to a time: whole numbers of steps from
//! the start of time, so that every replica takes the same steps.

/// Steps of a layer's life. The two layers are half a life apart.
pub(crate) const STEPS: i64 = 64;
/// Lives end before the eddies have folded the field: after this many turnings at the root mean square of their gradient
/// (measured: 2 keeps the determinant of the mapping above 0.3).
const TURNINGS: f64 = 2.0;
/// Life at most, s: weak turbulence moves a field little, and not at all in the limit.
const LONGEST_S: f64 = 3600.0;

/// The clock of one field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    /// Life of a layer, s.
    pub(crate) life_s: f64,
}

/// A time by the clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instant {
    /// Whole steps since the start.
    pub(crate) step: i64,
    /// Part of the next step.
    pub(crate) part: f64,
    /// Weights of the two layers, which sum to 1: 0 at birth, 1 in the middle of life.
    pub(crate) weights: [f64; 2],
}

impl Clock {
    /// `gradient_per_s`: of the velocity, root mean square, above 0.
    pub(crate) fn new(gradient_per_s: f64) -> Self {
        Self { life_s: (TURNINGS / gradient_per_s).min(LONGEST_S) }
    }

    /// A step, s.
    pub(crate) fn step_s(&self) -> f64 {
        self.life_s / STEPS as f64
    }

    pub(crate) fn at(&self, time_s: f64) -> Instant {
        let steps = time_s / self.step_s();
        let whole = steps.floor();
        let life = steps / STEPS as f64;
        let weight = |life: f64| 1.0 - (2.0 * life.rem_euclid(1.0) - 1.0).abs();
        let first = weight(life);
        Instant { step: whole as i64, part: steps - whole, weights: [first, 1.0 - first] }
    }
}

/// Layers that are born in a step: the first at multiples of a life, the second half a life later.
pub(crate) fn born(step: i64) -> [bool; 2] {
    [step.rem_euclid(STEPS) == 0, step.rem_euclid(STEPS) == STEPS / 2]
}

/// The step in which the older of the two layers that live in a step was born: where a replay begins.
pub(crate) fn first_step(step: i64) -> i64 {
    step - step.rem_euclid(STEPS).max((step - STEPS / 2).rem_euclid(STEPS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_go_with_age() {
        let clock = Clock { life_s: 64.0 };
        for time in [0.0, 0.25, 17.0, 31.999, 32.0, 63.99, 64.0, 1e9 + 0.5] {
            let Instant { step, part, weights } = clock.at(time);
            assert_eq!(step as f64 + part, time);
            assert_eq!(weights[0] + weights[1], 1.0);
            let age = time.rem_euclid(64.0);
            assert!((weights[0] - (1.0 - (age / 32.0 - 1.0).abs())).abs() < 1e-6, "{time}: {weights:?}");
        }
        assert_eq!(clock.at(64.0).weights[0], 0.0);
        assert_eq!(clock.at(32.0).weights[1], 0.0);
    }

    #[test]
    fn replay_begins_at_a_birth_and_is_bounded() {
        for step in [0, 1, 31, 32, 33, 63, 64, 1_000_000_007, -5] {
            let first = first_step(step);
            assert!((0..STEPS).contains(&(step - first)), "{step} from {first}");
            assert!(born(first).contains(&true));
            // Both layers that live now are born on the way.
            let births = (first..=step).map(born).fold([false; 2], |all, now| [all[0] | now[0], all[1] | now[1]]);
            assert_eq!(births, [true; 2], "{step} from {first}");
        }
    }
}
