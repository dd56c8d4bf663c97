//! Comparison of what the device computed with its twin in double precision.

use std::fmt::Write as _;

/// How far a device's value may be from its twin's: `abs + rel |twin|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    pub abs: f64,
    pub rel: f64,
}

impl Tolerance {
    pub const fn new(abs: f64, rel: f64) -> Self {
        Self { abs, rel }
    }

    fn allows(&self, gpu: f64, twin: f64) -> bool {
        // Written so that NaN is beyond every tolerance.
        (gpu - twin).abs() <= self.abs + self.rel * twin.abs()
    }
}

/// Fails with a census of the differences unless all of them are within the tolerance. Returns the largest difference,
/// as a part of what the tolerance allows at its site.
pub fn assert_close(name: &str, gpu: &[f32], twin: &[f64], tolerance: Tolerance) -> f64 {
    assert_eq!(gpu.len(), twin.len(), "{name}: lengths of device and twin");
    let mut sites: Vec<(usize, f64, f64)> =
        gpu.iter().zip(twin).enumerate().map(|(i, (gpu, twin))| (i, f64::from(*gpu), *twin)).collect();
    let used = |&(_, gpu, twin): &(usize, f64, f64)| {
        let part = (gpu - twin).abs() / (tolerance.abs + tolerance.rel * twin.abs()).max(f64::MIN_POSITIVE);
        if part.is_nan() { f64::INFINITY } else { part }
    };
    let worst = sites.iter().map(used).fold(0.0, f64::max);
    let beyond = sites.iter().filter(|(_, gpu, twin)| !tolerance.allows(*gpu, *twin)).count();
    {
        let most = sites.iter().map(|(_, gpu, twin)| (gpu - twin).abs()).fold(0.0, f64::max);
        let rel = sites.iter().map(|(_, gpu, twin)| (gpu - twin).abs() / twin.abs().max(1e-30)).fold(0.0, f64::max);
        let big = sites.iter().map(|(_, _, twin)| twin.abs()).fold(0.0, f64::max);
        eprintln!("RAW|{name}|{most:.3e}|{rel:.3e}|{big:.3e}");
    }
    if beyond > 0 {
        let count = sites.len();
        let bias = sites.iter().map(|(_, gpu, twin)| gpu - twin).sum::<f64>() / count as f64;
        let most = sites.iter().map(|(_, gpu, twin)| (gpu - twin).abs()).fold(0.0, f64::max);
        let mut text = format!(
            "{name}: {beyond} of {count} beyond {} + {} |twin|; largest difference {most:.3e}, mean difference {bias:.3e}",
            tolerance.abs, tolerance.rel
        );
        sites.sort_by(|a, b| used(b).total_cmp(&used(a)));
        for site in sites.iter().take(5) {
            let (i, gpu, twin) = site;
            let _ = write!(text, "\n  at {i}: device {gpu:e}, twin {twin:e}, {:.2} of the tolerance", used(site));
        }
        panic!("{text}");
    }
    worst
}
