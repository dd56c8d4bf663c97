//! Which renderers have something of a sky: what one keeps of fields and light is its own.

use std::collections::HashMap;
use std::time::Duration;

/// Skies that are remembered. Renderers keep what was used last, some dozens of skies by default; one that is remembered for too long costs
/// a short wait, one that is forgotten its light once more.
const SKIES: usize = 64;

/// Renderers by sky.
#[derive(Debug, Default)]
pub(super) struct Homes {
    skies: HashMap<String, Home>,
    clock: u64,
}

#[derive(Debug, Default)]
struct Home {
    /// The one that rendered it last comes first.
    renderers: Vec<usize>,
    used: u64,
    /// How long its jobs waited in line since a renderer came to have it.
    waited: Duration,
}

impl Homes {
    /// Those that have something of a sky, the latest first.
    pub(super) fn of(&self, sky: &str) -> &[usize] {
        self.skies.get(sky).map_or(&[], |home| &home.renderers)
    }

    /// Skies of which a renderer has something.
    pub(super) fn count(&self, renderer: usize) -> usize {
        self.skies.values().filter(|home| home.renderers.contains(&renderer)).count()
    }

    /// How long jobs of a sky waited in line since a renderer came to have it.
    pub(super) fn waited(&self, sky: &str) -> Duration {
        self.skies.get(sky).map_or(Duration::ZERO, |home| home.waited)
    }

    /// A renderer is at a sky, for a job that waited in line for so long.
    pub(super) fn renders(&mut self, renderer: usize, sky: &str, waited: Duration) {
        self.clock += 1;
        let home = self.skies.entry(sky.to_owned()).or_default();
        home.used = self.clock;
        home.waited = if home.renderers.contains(&renderer) { home.waited + waited } else { Duration::ZERO };
        home.renderers.retain(|other| *other != renderer);
        home.renderers.insert(0, renderer);
        if self.skies.len() > SKIES {
            let oldest = self.skies.iter().min_by_key(|(_, home)| home.used).map(|(sky, _)| sky.clone());
            oldest.and_then(|sky| self.skies.remove(&sky));
        }
    }

    /// A renderer has nothing any more.
    pub(super) fn forget(&mut self, renderer: usize) {
        self.skies.retain(|_, home| {
            home.renderers.retain(|other| *other != renderer);
            !home.renderers.is_empty()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAITED: Duration = Duration::from_secs(1);

    #[test]
    fn the_latest_comes_first_and_a_lost_renderer_has_nothing() {
        let mut homes = Homes::default();
        homes.renders(0, "a", WAITED);
        homes.renders(1, "a", WAITED);
        homes.renders(1, "b", WAITED);
        assert_eq!((homes.of("a"), homes.of("b"), homes.of("c")), (&[1, 0][..], &[1][..], &[][..]));
        homes.renders(0, "a", WAITED);
        assert_eq!((homes.of("a"), homes.count(0), homes.count(1)), (&[0, 1][..], 1, 2));
        homes.forget(1);
        assert_eq!((homes.of("a"), homes.of("b"), homes.count(1)), (&[0][..], &[][..], 0));
    }

    #[test]
    fn what_jobs_of_a_sky_waited_adds_up_until_another_renderer_has_it() {
        let mut homes = Homes::default();
        (0..3).for_each(|_| homes.renders(0, "a", WAITED));
        assert_eq!((homes.waited("a"), homes.waited("b")), (2 * WAITED, Duration::ZERO));
        homes.renders(1, "a", WAITED);
        assert_eq!(homes.waited("a"), Duration::ZERO);
    }

    #[test]
    fn skies_that_nobody_asked_for_lately_are_forgotten() {
        let mut homes = Homes::default();
        for sky in 0..=SKIES {
            homes.renders(0, &sky.to_string(), WAITED);
            homes.renders(0, "0", WAITED);
        }
        assert_eq!((homes.count(0), homes.of("0"), homes.of("1")), (SKIES, &[0][..], &[][..]));
    }
}
