//! Which renderers have something of a sky: what one keeps of fields and light is its own.

use std::collections::HashMap;

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

    /// A renderer is at a sky.
    pub(super) fn renders(&mut self, renderer: usize, sky: &str) {
        self.clock += 1;
        let home = self.skies.entry(sky.to_owned()).or_default();
        home.used = self.clock;
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

    #[test]
    fn the_latest_comes_first_and_a_lost_renderer_has_nothing() {
        let mut homes = Homes::default();
        homes.renders(0, "a");
        homes.renders(1, "a");
        homes.renders(1, "b");
        assert_eq!((homes.of("a"), homes.of("b"), homes.of("c")), (&[1, 0][..], &[1][..], &[][..]));
        homes.renders(0, "a");
        assert_eq!((homes.of("a"), homes.count(0), homes.count(1)), (&[0, 1][..], 1, 2));
        homes.forget(1);
        assert_eq!((homes.of("a"), homes.of("b"), homes.count(1)), (&[0][..], &[][..], 0));
    }

    #[test]
    fn skies_that_nobody_asked_for_lately_are_forgotten() {
        let mut homes = Homes::default();
        for sky in 0..=SKIES {
            homes.renders(0, &sky.to_string());
            homes.renders(0, "0");
        }
        assert_eq!((homes.count(0), homes.of("0"), homes.of("1")), (SKIES, &[0][..], &[][..]));
    }
}
