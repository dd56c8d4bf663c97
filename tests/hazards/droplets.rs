//! Hazards of single droplets and of their sampling.

use skyloom::optics::ensemble::ensemble;
use skyloom::optics::mie::{Coefficients, RefractiveIndex};
use skyloom::optics::water::{self, index};
use skyloom::optics::{Sampling, SizeDistribution};

/// 25: where the downward recurrence starts (1e-4 of extinction at size 800 when too low), the sign of the imaginary
/// index (droplets that make light), and too few radii (10 % of ripples).
#[test]
fn hazard_25_mie_recurrence_and_sign_of_k() {
    // Extinction by the same series with 50 digits' worth of margin in the recurrence.
    for (size, extinction) in [(400.0, 2.024_060_762_021), (800.0, 2.033_357_627_577_941)] {
        let found = Coefficients::new(size, RefractiveIndex::new(1.333, 0.0)).efficiencies();
        assert!((found.extinction / extinction - 1.0).abs() < 1e-11, "size {size}: {found:?}");
    }
    for size in [0.3, 20.0, 800.0] {
        for k in [-1e-3, 0.0, 1e-9, 1e-3] {
            let found = Coefficients::new(size, RefractiveIndex::new(1.333, k)).efficiencies();
            let albedo = found.scattering / found.extinction;
            assert!(albedo <= 1.0 + 1e-12 && (k > 1e-8 || albedo > 1.0 - 1e-5), "size {size}, k {k}: {albedo}");
            assert!(k < 1e-8 || albedo < 1.0 - 1e-4, "size {size}, k {k}: {albedo}");
        }
    }
    assert!([380.0, 450.0, 550.0, 650.0, 780.0].iter().all(|nm| water::imaginary_index(*nm) > 0.0));
    let sizes = SizeDistribution { effective_radius_um: 7.0, broadness: 2.0 };
    let mean = |wavelengths, radii| {
        let sampling = Sampling { wavelengths, radii };
        ensemble(&sizes, 550.0, &|nm| index(nm, None), &sampling, &|_| ()).unwrap()
    };
    let usual = Sampling::default();
    let (few, default, many) =
        (mean(1, 100), mean(usual.wavelengths, usual.radii), mean(usual.wavelengths, 2 * usual.radii));
    assert!((0.999_99..=1.0).contains(&default.albedo), "{}", default.albedo);
    let ripples = |of: &skyloom::optics::ensemble::Ensemble| {
        let angles = (1200..1750).map(|tenth| (f64::from(tenth) / 10.0).to_radians());
        let squares = angles.map(|angle| (of.phase.value(angle) / many.phase.value(angle) - 1.0).powi(2));
        (squares.sum::<f64>() / 550.0).sqrt()
    };
    assert!(ripples(&default) < 0.005, "{}", ripples(&default));
    assert!(ripples(&few) > 0.05, "the measure sees ripples: {}", ripples(&few));
}
