//! A handful of results kept by key; the one that was not used for longest goes first.

use std::convert::Infallible;

/// Most recently used last.
pub(super) struct Kept<K, T> {
    entries: Vec<(K, T)>,
    capacity: usize,
}

impl<K: PartialEq, T: Clone> Kept<K, T> {
    pub(super) fn new(capacity: usize) -> Self {
        Self { entries: Vec::new(), capacity }
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
    fn failures_are_not_kept() {
        let mut kept: Kept<&str, u32> = Kept::new(2);
        assert_eq!(kept.get_or("a", || Err("no")), Err("no"));
        assert!(made(&mut kept, "a"));
    }
}
