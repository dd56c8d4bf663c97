//! Hazards of scattering angles and phase functions.

use crate::setup::{METHODS, SHADER, Seen, Slab, henyey_greenstein};
use serde_json::{Value, json};
use skyloom::optics::{PhaseTable, moments, resum};
use skyloom::slab::phases::{PHASE_COLUMNS, phase_angle};
use std::f64::consts::PI;
use std::fs;
use std::sync::LazyLock;

/// Phase function of droplets of 7 micrometres at 550 nm: 4124 in the forward direction, half of it at 0.55 degrees.
static DROPLETS: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    let path = format!("{}/tests/data/phase/phase_re07.csv", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).unwrap();
    let number = |line: &str, i: usize| line.split(',').nth(i).unwrap().trim().parse::<f64>().unwrap();
    text.lines().skip(1).map(|line| (number(line, 0), number(line, 2))).collect()
});

fn droplets() -> Value {
    let points: Vec<[f64; 2]> = DROPLETS.iter().map(|point| [point.0, point.1]).collect();
    json!({ "phase_function": points, "albedo": 1 })
}

/// 13: the forward peak. Half floats step by 4 at 4124, Legendre sums ring, coarse angles miss it. The function itself
/// must hold it, and so must the light that it makes around the sun, against the sum over all its moments.
#[test]
fn hazard_13_forward_peak() {
    let phase = PhaseTable::new(&DROPLETS).unwrap().phase().clone();
    let degrees = |angle: f64| phase.value(angle.to_radians());
    assert!((degrees(0.0) / 4123.9 - 1.0).abs() < 0.005, "{}", degrees(0.0));
    // Between the points of the table, log P is linear; at them nothing changes but the norm.
    for (angle, value) in DROPLETS.iter().filter(|point| point.0 < 5.0) {
        assert!((degrees(*angle) / value - 1.0).abs() < 0.005, "{angle}: {}", degrees(*angle));
    }
    let cut = phase.smooth_cut(4f64.to_radians(), 6f64.to_radians()).unwrap();
    let shape = moments(&cut.peak, 3000);
    /// Aureole table: linear between 256 angles and between 4 depths an octave.
    const TABLE: f64 = 0.01;
    for depth in [0.05, 0.8, 4.0] {
        for offset in [0.0, 0.05, 0.2, 0.5, 1.0, 2.0, 3.0] {
            let seen = Slab::new(40.0, depth, droplets()).seen("below", (40.0 + offset, 180.0));
            let path = seen.depth() / f64::from(-seen.stages.view.towards[2]);
            let b = path * cut.peak_fraction;
            let sums: Vec<f64> = shape.iter().map(|f| (-path).exp() * (b * f).exp_m1()).collect();
            let aureole = resum(&sums, &[seen.angle()])[0] / (4.0 * PI);
            let found = seen.radiance() - seen.expected_parts().sum();
            let error = (found / aureole - 1.0).abs();
            assert!(error < TABLE, "depth {depth}, {offset} degrees: {found} {aureole}");
        }
    }
}

/// A narrow glory: 60 times brighter within a tenth of a degree of the antisolar point.
fn narrow() -> Value {
    json!({ "phase_function": [[0, 1], [179.8, 1], [179.9, 5], [179.95, 20], [180, 60]], "albedo": 0.5 })
}

/// 14: scattering angles near 0 and 180 degrees. From the cosine, single precision has steps of 0.02 degrees there, and
/// a cosine above 1 gives NaN. Checked where the phase function changes most, against the angle in double precision.
#[test]
fn hazard_14_angles_near_0_and_180() {
    for zenith in [0.0, 25.0, 71.0] {
        for offset in [0.0, 0.003, 0.01, 0.02, 0.04, 0.07, 0.12] {
            let seen = Slab::new(zenith, 0.1, narrow()).seen("above", (zenith + offset, 0.0));
            let parts = seen.expected_parts();
            assert!(parts.order1 > 0.5 * parts.sum());
            // A rounding of the two directions, 1e-7 radians, in a function that changes e-fold in 0.03 degrees.
            let (found, tolerance) = (seen.radiance(), SHADER + 1.2e-7 / 0.03f64.to_radians() * 2.0);
            assert!((found / parts.sum() - 1.0).abs() < tolerance, "{zenith} + {offset}: {found} {parts:?}");
        }
        // Straight into the sun and away from it, for all azimuths: never NaN.
        for azimuth in [0.0, 33.3, 123.4, 287.0] {
            for (view, opposite) in [("above", 0.0), ("below", 180.0)] {
                let slab = Slab { azimuth_deg: azimuth, ..Slab::new(zenith, 0.1, narrow()) };
                assert!(slab.seen(view, (zenith, (azimuth + opposite) % 360.0)).radiance().is_finite());
            }
        }
    }
}

/// 15: the convolution of the phase function with itself: no ringing below 0, norm 1, and what a plain integral over
/// the sphere gives.
#[test]
fn hazard_15_convolution() {
    /// Trapezoids between 2048 angles.
    const NORM: f64 = 1e-4;
    for droplets in
        [henyey_greenstein(0.85, 1.0), henyey_greenstein(0.98, 1.0), henyey_greenstein(-0.6, 1.0), droplets()]
    {
        let seen = Slab::new(30.0, 1.0, droplets).seen("above", (0.0, 0.0));
        let map = &seen.stages.tables.phase;
        let column = |row: usize, x: usize| f64::from(map.data[4 * (row * PHASE_COLUMNS + x) + 1]);
        for row in 0..2 {
            let panel = |x: usize| {
                let (a, b) = (phase_angle(x), phase_angle(x + 1));
                PI * (b - a) * (a.sin() * column(row, x) + b.sin() * column(row, x + 1))
            };
            let norm: f64 = (0..PHASE_COLUMNS - 1).map(panel).sum();
            assert!((norm - 1.0).abs() < NORM, "row {row}: {norm}");
            assert!((0..PHASE_COLUMNS).all(|x| column(row, x) >= 0.0));
        }
    }
    // Smooth enough for a plain sum over a grid of directions.
    let seen = Slab::new(30.0, 1.0, henyey_greenstein(0.5, 1.0)).seen("above", (0.0, 0.0));
    let map = &seen.stages.tables.phase;
    let at = |row: usize, angle: f64| {
        let x = (0..PHASE_COLUMNS - 2).find(|x| phase_angle(x + 1) >= angle).unwrap_or(PHASE_COLUMNS - 2);
        let value = |x: usize| f64::from(map.data[4 * (row * PHASE_COLUMNS + x) + 1]);
        let part = (angle - phase_angle(x)) / (phase_angle(x + 1) - phase_angle(x));
        value(x) + (value(x + 1) - value(x)) * part
    };
    let steps = 240;
    for angle in [0.3, 1.0, 2.0, 3.0_f64] {
        let mut sum = 0.0;
        for i in 0..steps {
            let polar = PI * (f64::from(i) + 0.5) / f64::from(steps);
            let once = at(0, polar) * polar.sin();
            for j in 0..steps {
                let turn = PI * (f64::from(j) + 0.5) / f64::from(steps);
                let cosine = polar.cos() * angle.cos() + polar.sin() * angle.sin() * turn.cos();
                sum += 2.0 * once * at(0, cosine.clamp(-1.0, 1.0).acos()) * (PI / f64::from(steps)).powi(2);
            }
        }
        // The edge of the cut at 4 to 6 degrees on a grid of 0.75 degrees.
        assert!((at(1, angle) / sum - 1.0).abs() < 3e-3, "{angle}: {} {sum}", at(1, angle));
    }
}

/// 16: truncated expansions ripple in thin slabs and depend on azimuth at the zenith. No expansion is summed here: a
/// thin slab must show the phase function itself, bow and glory included.
#[test]
fn hazard_16_no_ripples_in_thin_slabs() {
    const DEPTH: f64 = 1e-3;
    for (view, method) in ["below", "above"].into_iter().flat_map(|view| METHODS.map(|method| (view, method))) {
        for zenith in [0.0, 10.0, 20.0, 35.0, 50.0, 65.0] {
            for azimuth in [0.0, 90.0, 180.0] {
                let seen = Slab::new(30.0, DEPTH, droplets()).seen_by(view, (zenith, azimuth), method);
                let angle = seen.angle().to_degrees();
                if angle < 8.0 {
                    continue;
                }
                let at = DROPLETS.partition_point(|point| point.0 <= angle).clamp(1, DROPLETS.len() - 1);
                let ((a, low), (b, high)) = (DROPLETS[at - 1], DROPLETS[at]);
                let phase = (low.ln() + (high / low).ln() * (angle - a) / (b - a)).exp();
                let expected = phase / (4.0 * PI) * seen.depth() / zenith.to_radians().cos();
                // Light scattered more than once: most where the phase function is least.
                let more = 0.5 * DEPTH / phase + 2.0 * DEPTH;
                let error = (seen.radiance() / expected - 1.0).abs();
                assert!(error < 0.006 + more, "{method:?} {view} {zenith} {azimuth}, {angle} degrees: {error}");
            }
        }
    }
}

/// 17: no azimuth at the zenith, neither of the view nor of the sun.
#[test]
fn hazard_17_azimuth_at_the_zenith() {
    for (view, method) in ["below", "above"].into_iter().flat_map(|view| METHODS.map(|method| (view, method))) {
        let straight = |azimuth: f64| {
            let slab = Slab { sky: 0.1, ground: 0.3, ..Slab::new(50.0, 2.0, droplets()) };
            slab.seen_by(view, (0.0, azimuth), method).stages.output
        };
        let noon = |azimuth_deg: f64, to: f64| {
            let slab = Slab { azimuth_deg, sky: 0.1, ground: 0.3, ..Slab::new(0.0, 2.0, droplets()) };
            slab.seen_by(view, (40.0, to), method)
        };
        let (first, first_noon) = (straight(0.0), noon(0.0, 10.0));
        assert!(first.iter().all(|value| value.is_finite() && *value > 0.0), "{first:?}");
        for azimuth in [1.0, 90.0, 211.0, -77.0, 360.0] {
            // The same numbers in, to the bit.
            assert_eq!(straight(azimuth), first, "{method:?} {view} {azimuth}");
            assert_eq!(noon(azimuth, 10.0).stages.output, first_noon.stages.output, "{method:?} {view} {azimuth}");
            // Another view of the same height: the angle is rounded differently.
            let (other, same) = (noon(0.0, azimuth).radiance(), first_noon.radiance());
            assert!((other / same - 1.0).abs() < 1e-6, "{method:?} {view} {azimuth}: {other} {same}");
        }
    }
}

/// 24: whether light was reflected or transmitted is told by the sides of the slab, not by the angle between view and
/// sun, which is wrong for 44 % of all views at a sun of 80 degrees.
#[test]
fn hazard_24_side_by_normals() {
    let slab = Slab::new(80.0, 15.0, henyey_greenstein(0.2, 1.0));
    let dot =
        |seen: &Seen| -> f32 { (0..3).map(|i| seen.stages.view.towards[i] * seen.stages.frame.sun.towards[i]).sum() };
    // Far side, towards the sun's azimuth: the sign of V.L says reflected.
    let far = slab.seen("below", (75.0, 0.0));
    assert!(dot(&far) > 0.5);
    far.check(far.expected_parts().sum());
    assert!(far.radiance() < 0.03, "dark under a thick cloud: {}", far.radiance());
    // Sunlit side, away from the sun: the sign of V.L says transmitted.
    let near = slab.seen("above", (75.0, 180.0));
    assert!(dot(&near) < -0.5);
    near.check(near.expected_parts().sum());
    assert!(near.radiance() > 0.05, "bright above: {}", near.radiance());
    // By the tables too: nothing of order 1 comes through, ten times as much comes back.
    let tabulated = |view, azimuth| slab.seen_by(view, (75.0, azimuth), METHODS[1]).radiance();
    assert!(tabulated("below", 0.0) < 0.03 && tabulated("above", 180.0) > 0.05);
    // And the two where the sign is right.
    for (view, azimuth) in [("below", 180.0), ("above", 0.0)] {
        let seen = slab.seen(view, (45.0, azimuth));
        seen.check(seen.expected_parts().sum());
    }
}
