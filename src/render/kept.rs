//! A handful of results kept by key; the one that was not used for longest goes first, also where all that is kept takes too much memory.

use std::convert::Infallible;

/// Most recently used last.
pub(super) struct Kept<K, T> {
    entries: Vec<(K, T)>,
    capacity: usize,
    /// Bytes of one.
    size: fn(&T) -> u64,
}

/// Results of some kind, whatever names them.
pub(super) trait Results {
    /// Bytes of all that is kept.
    fn size(&self) -> u64;
    /// Drops the one that was not used for longest.
    fn drop_oldest(&mut self);
}

/// Drops results until they take no more than so many bytes: of the kind that takes most the one that was not used for longest.
pub(super) fn shrink(kinds: &mut [&mut dyn Results], bytes: u64) {
    while kinds.iter().map(|kind| kind.size()).sum::<u64>() > bytes {
        if let Some(largest) = kinds.iter_mut().max_by_key(|kind| kind.size()) {
            largest.drop_oldest();
        }
    }
}

impl<K, T> Results for Kept<K, T> {
    fn size(&self) -> u64 {
        self.entries.iter().map(|(_, value)| (self.size)(value)).sum()
    }

    fn drop_oldest(&mut self) {
        if !self.entries.is_empty() {
            self.entries.remove(0);
        }
    }
}

impl<K: PartialEq, T: Clone> Kept<K, T> {
    /// Keeps so many results of a few MB at most.
    pub(super) fn new(capacity: usize) -> Self {
        Self::sized(capacity, |_| 0)
    }

    /// Keeps so many results, each of some size in bytes.
    pub(super) fn sized(capacity: usize, size: fn(&T) -> u64) -> Self {
        Self { entries: Vec::new(), capacity, size }
    }

    /// The value of a key, made if it is not there.
    pub(super) fn get_or<E>(&mut self, key: K, make: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let entry = match self.entries.iter().position(|(kept, _)| *kept == key) {
            Some(at) => self.entries.remove(at),
            None => (key, make()?),
        };
        if self.entries.len() >= self.capacity {
            self.entries.remove(0);
        }
        let value = entry.1.clone();
        self.entries.push(entry);
        Ok(value)
    }

    /// The same where making cannot fail.
    pub(super) fn get_or_make(&mut self, key: K, make: impl FnOnce() -> T) -> T {
        match self.get_or::<Infallible>(key, || Ok(make())) {
            Ok(value) => value,
            Err(never) => match never {},
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(kept: &mut Kept<&str, u32>, key: &'static str) -> bool {
        let mut made = false;
        kept.get_or_make(key, || {
            made = true;
            1
        });
        made
    }

    #[test]
    fn the_longest_unused_goes_first() {
        let mut kept = Kept::new(2);
        assert!(made(&mut kept, "a"));
        assert!(made(&mut kept, "b"));
        assert!(!made(&mut kept, "a"));
        assert!(made(&mut kept, "c"));
        assert!(!made(&mut kept, "a"));
        assert!(made(&mut kept, "b"));
    }

    #[test]
    fn what_takes_most_memory_shrinks_first() {
        let (mut small, mut large) = (Kept::sized(8, |size: &u64| *size), Kept::sized(8, |size: &u64| *size));
        for key in 0..4 {
            small.get_or_make(key, || 10);
            large.get_or_make(key, || 100);
        }
        shrink(&mut [&mut small, &mut large], 250);
        assert_eq!((small.size(), large.size()), (40, 200));
        // The last used ones are there still.
        assert_eq!(large.get_or_make(3, || 7), 100);
        shrink(&mut [&mut small, &mut large], 30);
        assert_eq!(small.size() + large.size(), 30);
        shrink(&mut [&mut small, &mut large], 0);
        assert_eq!(small.size() + large.size(), 0);
    }

    #[test]
    fn failures_are_not_kept() {
        let mut kept: Kept<&str, u32> = Kept::new(2);
        assert_eq!(kept.get_or("a", || Err("no")), Err("no"));
        assert!(made(&mut kept, "a"));
    }
}
