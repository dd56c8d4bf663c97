//! How many renderers take jobs that are alike side by side.

use super::renderer::Adapter;

/// Most of them where nothing is said: each takes memory of its own.
const MOST: usize = 4;

/// What the settings say of it.
#[derive(Clone, Copy, Debug)]
pub struct SideBySide {
    /// So many, whatever the device is.
    wanted: Option<usize>,
    cores: usize,
}

impl SideBySide {
    /// As `render.side_by_side` says; 0 leaves it to the device.
    pub fn new(wanted: usize) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self { wanted: Some(wanted).filter(|wanted| *wanted > 0), cores }
    }

    /// So many at most, whatever device there will be.
    pub(super) fn most(self) -> usize {
        self.wanted.unwrap_or(self.cores.min(MOST))
    }

    /// So many on this device: a software one is the processor's cores, which the short passes of a small job cannot all use; a real one is
    /// busy with one job.
    pub(super) fn of(self, adapter: &Adapter) -> usize {
        self.wanted.unwrap_or(if adapter.is_software() { self.most() } else { 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_software_device_takes_as_many_as_it_has_cores_and_a_real_one_one_unless_told() {
        let adapter = |kind: &str| Adapter {
            name: String::new(),
            backend: String::new(),
            kind: kind.to_owned(),
            driver: String::new(),
        };
        let of = |wanted: usize, cores: usize, kind: &str| {
            SideBySide { cores, ..SideBySide::new(wanted) }.of(&adapter(kind))
        };
        assert_eq!([1, 2, 4, 64].map(|cores| of(0, cores, "software")), [1, 2, 4, 4]);
        assert_eq!([1, 64].map(|cores| of(0, cores, "discrete")), [1, 1]);
        assert_eq!((of(1, 8, "software"), of(8, 2, "software"), of(2, 8, "discrete")), (1, 8, 2));
        // Where something is said it holds for all devices, and room is made for so many before a device is known.
        for (wanted, cores) in (0..=16).flat_map(|wanted| (1..=128).map(move |cores| (wanted, cores))) {
            for kind in ["software", "discrete", "integrated", "virtual", "other"] {
                let found = of(wanted, cores, kind);
                assert!(wanted == 0 || found == wanted, "{wanted} {cores} {kind}: {found}");
                let most = SideBySide { cores, ..SideBySide::new(wanted) }.most();
                assert!(
                    (1..=most).contains(&found) && (wanted > 0 || most <= 4),
                    "{wanted} {cores} {kind}: {found} of {most}"
                );
            }
        }
    }
}
