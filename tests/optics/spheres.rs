//! Water, single spheres and populations against published values and against themselves.

use std::f64::consts::PI;

use skyloom::optics::ensemble::ensemble;
use skyloom::optics::mie::{Coefficients, RefractiveIndex, summed_intensity};
use skyloom::optics::water::{self, index};
use skyloom::optics::{Sampling, SizeDistribution, WAVELENGTHS_NM, gauss_legendre, moments};

#[test]
fn single_spheres_match_published_efficiencies() {
    // Wiscombe, "Mie scattering calculations" (NCAR/TN-140, 1979), as reprinted in the test cases
    // of MIEV0: index, size, extinction, scattering, asymmetry.
    let cases = [
        (1.5, 0.0, 10.0, 2.8820, 2.8820, 0.742_913),
        (1.5, 0.0, 100.0, 2.0944, 2.0944, 0.818_246),
        (1.5, 0.0, 1000.0, 2.0139, 2.0139, 0.827_882),
        (1.33, 1e-5, 1.0, 0.093_952, 0.093_923, 0.184_517),
        (1.33, 1e-5, 100.0, 2.101_321, 2.096_594, 0.868_959),
        (1.33, 1e-5, 10_000.0, 2.004_089, 1.723_857, 0.907_840),
        (1.5, 1.0, 0.055, 0.101_491, 0.000_011, 0.000_491),
        (1.5, 1.0, 1.0, 2.336_321, 0.663_454, 0.192_136),
        (1.5, 1.0, 100.0, 2.097_502, 1.283_697, 0.850_252),
        (1.5, 1.0, 10_000.0, 2.004_368, 1.236_574, 0.846_309),
        (10.0, 10.0, 1.0, 2.532_993, 2.049_405, -0.110_664),
        (10.0, 10.0, 100.0, 2.071_124, 1.836_785, 0.556_215),
        (10.0, 10.0, 10_000.0, 2.005_914, 1.795_393, 0.548_194),
    ];
    for (n, k, x, extinction, scattering, asymmetry) in cases {
        let found = Coefficients::new(x, RefractiveIndex::new(n, k)).efficiencies();
        println!("{n} {k} {x}: {found:?}");
        /// One unit of the last printed digit, which is four digits behind the point for the first
        /// cases.
        const PRINTED: f64 = 1.01e-6;
        let printed = if k == 0.0 { 5.1e-5 } else { PRINTED };
        assert!((found.extinction - extinction).abs() < printed, "x {x}: {found:?}");
        assert!((found.scattering - scattering).abs() < printed, "x {x}: {found:?}");
        assert!((found.asymmetry - asymmetry).abs() < PRINTED, "x {x}: {found:?}");
    }
}

#[test]
fn single_sphere_intensity_matches_bohren_and_huffman() {
    // Bohren and Huffman (1983), appendix A: radius 0.525 µm, 632.8 nm, index 1.55; S11 relative to
    // S11 at 0, every 9 degrees.
    #[allow(clippy::approx_constant, reason = "a value of the table is close to pi / 4 by chance")]
    const S11: [f64; 21] = [
        1.0,
        0.785_390,
        0.356_897,
        0.076_611_9,
        0.035_535_5,
        0.070_184_5,
        0.057_431_3,
        0.021_966_0,
        0.012_595_9,
        0.017_375_0,
        0.012_460_1,
        0.006_790_93,
        0.009_542_39,
        0.008_634_19,
        0.002_274_21,
        0.005_439_98,
        0.016_024_3,
        0.018_885_2,
        0.019_525_4,
        0.030_167_6,
        0.038_318_9,
    ];
    let sphere = Coefficients::new(2.0 * PI * 0.525 / 0.6328, RefractiveIndex::new(1.55, 0.0));
    let cosines: Vec<f64> = (0..11).map(|i| (9.0 * f64::from(i)).to_radians().cos()).collect();
    let intensity = summed_intensity(&[(sphere, 1.0)], &cosines);
    for (i, expected) in S11.iter().enumerate() {
        // Single precision was used for the book.
        assert!((intensity[i] / intensity[0] / expected - 1.0).abs() < 2e-5, "{i}: {}", intensity[i] / intensity[0]);
    }
}

#[test]
fn small_spheres_scatter_as_rayleigh_has_it() {
    let x = 1e-2;
    let sphere = Coefficients::new(x, RefractiveIndex::new(1.33, 0.0));
    let factor = (1.33_f64.powi(2) - 1.0) / (1.33_f64.powi(2) + 2.0);
    let q = sphere.efficiencies().scattering;
    assert!((q / (8.0 / 3.0 * x.powi(4) * factor * factor) - 1.0).abs() < 1e-3, "{q}");
    let intensity = summed_intensity(&[(sphere, 1.0)], &[1.0, 0.5, 0.0]);
    for (value, cosine) in intensity.iter().zip([1.0_f64, 0.5, 0.0, -0.5, -1.0]) {
        let expected = x.powi(6) * factor * factor * (1.0 + cosine * cosine) / 2.0;
        assert!((value / expected - 1.0).abs() < 1e-3, "{cosine}: {value} against {expected}");
    }
}

#[test]
fn extinction_of_large_spheres_holds_to_the_last_digits() {
    // Worked out with 90 decimal digits from the same series (index 1.333). A downward recurrence
    // started at |mx| + 16 is off by 3e-5 at size 400 and by 1e-4 at 800.
    for (x, extinction) in [
        (40.0, 1.958_264_167_740_473),
        (400.0, 2.024_060_762_021),
        (800.0, 2.033_357_627_577_941),
        (3000.0, 2.009_008_017_135_177_5),
    ] {
        let found = Coefficients::new(x, RefractiveIndex::new(1.333, 0.0)).efficiencies();
        println!("x {x}: {:.1e}", found.extinction / extinction - 1.0);
        assert!((found.extinction / extinction - 1.0).abs() < 1e-11, "x {x}: {found:?}");
    }
}

#[test]
fn intensity_adds_up_to_the_scattering_of_the_coefficients() {
    for x in [0.5, 40.0, 400.0] {
        let sphere = Coefficients::new(x, RefractiveIndex::new(1.333, 0.0));
        let found = sphere.efficiencies();
        assert!((found.extinction / found.scattering - 1.0).abs() < 1e-11, "x {x}: {found:?}");
        let (nodes, weights) = gauss_legendre(2 * sphere.terms() + 10);
        // The symmetric grid wants nodes from 1 to 0 and a node at 0, whose weight here is 0.
        let half: Vec<f64> = nodes.iter().rev().copied().take(nodes.len() / 2).chain([0.0]).collect();
        let intensity = summed_intensity(&[(sphere, 1.0)], &half);
        let middle = half.len() - 1;
        let mut scattering = 0.0;
        for i in 0..middle {
            scattering += weights[i] * (intensity[i] + intensity[2 * middle - i]);
        }
        assert!((2.0 * scattering / (x * x) / found.scattering - 1.0).abs() < 1e-10, "x {x}");
    }
}

#[test]
fn a_sphere_cannot_make_light() {
    assert_eq!(RefractiveIndex::new(1.33, -1e-3), RefractiveIndex::new(1.33, 0.0));
}

#[test]
fn water_follows_iapws_r9_97() {
    for (wavelength, index) in [(450.0, 1.33966), (550.0, 1.33473), (650.0, 1.33171)] {
        assert!((water::real_index(wavelength) - index).abs() < 5.1e-6, "{}", water::real_index(wavelength));
    }
    // Values for checking programs, relative to vacuum.
    assert!((water::absolute_index(226.5, 298.15, 997.047_435) - 1.392_778_24).abs() < 1e-8);
    assert!((water::absolute_index(589.3, 773.15, 30.475_853_4) - 1.009_493_07).abs() < 1e-8);
    for (wavelength, k) in [(450.0, 8.076e-10), (550.0, 2.463e-9), (650.0, 1.672e-8)] {
        assert!((water::imaginary_index(wavelength) / k - 1.0).abs() < 1e-12);
    }
}

#[test]
fn grid_resolves_the_largest_droplets() {
    // Integrals over the grid against sums of the series, which know no grid.
    for broadness in [0.5, 2.0, 20.0] {
        let sizes = SizeDistribution { effective_radius_um: 50.0, broadness };
        let mean = ensemble(
            &sizes,
            WAVELENGTHS_NM[2],
            &|nm| index(nm, None),
            &Sampling { wavelengths: 3, radii: 60 },
            &|_| {},
        )
        .unwrap();
        println!(
            "b {broadness}: norm - 1 {:.1e}, g {:.1e}",
            mean.raw_norm - 1.0,
            mean.phase.asymmetry() - mean.asymmetry
        );
        assert!((mean.raw_norm - 1.0).abs() < 2e-3, "{}", mean.raw_norm);
        assert!((mean.phase.asymmetry() - mean.asymmetry).abs() < 5e-4);
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let sizes = SizeDistribution { effective_radius_um: 3.0, broadness: 2.0 };
    let sampling = Sampling { wavelengths: 5, radii: 100 };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mean = ensemble(&sizes, WAVELENGTHS_NM[1], &|nm| index(nm, None), &sampling, &|_| {}).unwrap();
            (moments(&mean.phase, 100), mean.cross_section_um2, mean.phase)
        })
    };
    let one = run(1);
    assert_eq!(one, run(3));
    assert_eq!(one, run(8));
}
